"""Estimators: each a file, from a segment's record to parameters with their uncertainty and a report."""
