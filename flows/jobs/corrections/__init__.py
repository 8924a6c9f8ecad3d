"""What a person changes afterwards: logs and vessels removed, moved, renamed or purged, manoeuvres corrected, notes."""
