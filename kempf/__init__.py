"""Raw ship sea-trial logs in, versioned manoeuvring models out."""
