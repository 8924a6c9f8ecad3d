"""How tables and files are kept in a folder or bucket."""
