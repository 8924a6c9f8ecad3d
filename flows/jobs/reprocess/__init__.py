"""Vessels brought up to date, and stored sets made again."""
