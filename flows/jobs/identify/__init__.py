"""From manoeuvres to parameter sets."""
