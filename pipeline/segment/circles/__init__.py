"""Turning circles: found, put on their track without the current, and what they measure."""
