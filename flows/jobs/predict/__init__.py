"""Standard manoeuvres from a parameter set, beside those that were measured."""
