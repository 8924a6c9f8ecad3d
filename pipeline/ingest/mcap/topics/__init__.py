"""Topics and their fields: which are read, under what name, and which are left."""
