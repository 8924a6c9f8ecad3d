"""Identification without a speed log: the speed from the longitudinal equation."""
