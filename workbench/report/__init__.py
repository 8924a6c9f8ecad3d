"""The report that one can send: what it shows, gathered from a diagnosis, and the page made of it."""
