"""What a diagnosis found, what is left unexplained, in words and in JSON."""
