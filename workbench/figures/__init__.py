"""Figures for a person, one file a figure; matplotlib is loaded when one is drawn."""
