"""What a person says of logs and manoeuvres: removed, moved, purged, corrected, noted."""
