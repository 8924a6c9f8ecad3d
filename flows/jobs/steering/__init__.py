"""Course keeping from a parameter set."""
