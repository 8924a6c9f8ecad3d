"""What is kept, a table or kind of file each."""
