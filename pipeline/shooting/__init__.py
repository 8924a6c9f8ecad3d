"""Multiple shooting: models fitted to, and judged by, what they predict one leg ahead of what was measured."""
