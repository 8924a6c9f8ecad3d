"""What an effect is made of: terms written as expressions, parsed, never evaluated as Python, and compiled to programs."""
