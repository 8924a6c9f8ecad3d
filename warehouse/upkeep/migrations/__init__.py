"""Bringing an earlier warehouse forward: one file a layout, carried out in order."""
