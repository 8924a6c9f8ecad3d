"""What a manoeuvre that nobody has sailed yet would say of a ship: optimal design of the next trial."""
