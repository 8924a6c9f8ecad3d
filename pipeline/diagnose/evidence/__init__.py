"""What a diagnosis shows: the curves and figures behind it."""
