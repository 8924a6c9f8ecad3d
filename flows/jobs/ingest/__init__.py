"""From raw logs to readings and manoeuvres."""
