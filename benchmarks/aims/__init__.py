"""The figures to reach, all on one page."""
