"""The ship of eqs. (16)-(17), her disturbances and the filter of eqs. (3)-(5)."""
