"""From manoeuvres to parameter sets, and which set of a vessel is meant."""
