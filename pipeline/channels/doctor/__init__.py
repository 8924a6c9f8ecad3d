"""The channel doctor: which channel of a log is wrong, how, and what would correct it. One check a file."""
