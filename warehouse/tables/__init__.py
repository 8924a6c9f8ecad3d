"""What is kept: a table or kind of file each, and what a parameter set says of itself."""
