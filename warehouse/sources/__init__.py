"""Folders and buckets that logs arrive in."""
