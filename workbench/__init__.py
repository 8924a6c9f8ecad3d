"""What a person touches: the command line, and what it shows. Asks `flows` for work and does none itself."""
