"""Kalman filters and smoothers: compiled, linear and extended."""
