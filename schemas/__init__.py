"""What the data look like: names, units, tables, files. Nothing here touches a disk, but for the catalogue in it."""
