"""Standard manoeuvres from a parameter set, beside those that were measured, and which to sail next."""
