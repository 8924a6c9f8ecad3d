"""Zigzag manoeuvres found in whole logs: executes, overshoots, phases, and the IMO criteria."""
