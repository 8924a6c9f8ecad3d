"""Numbers, words and times in text, many at once."""
