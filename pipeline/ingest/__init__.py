"""Raw bytes in, readings in canonical channels out, with everything that was refused and why."""
