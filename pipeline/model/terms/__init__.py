"""What an effect is made of: terms written as formulas, parsed, never evaluated as Python, compiled to programs."""
