"""Explain one stretch: which effect would account for it."""
