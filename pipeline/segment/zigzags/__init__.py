"""Zigzags: found, described, judged by the IMO's limits."""
