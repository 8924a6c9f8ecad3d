"""The ship of eqs. (16)-(17) with her effects, and her disturbances."""
