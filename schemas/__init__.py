"""What the data look like: names, units, tables, files. Nothing here acts on data or touches a disk."""
