"""The paper's own procedure, eqs. (11)-(15)."""
