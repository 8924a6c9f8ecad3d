"""Measured over predicted: what a model says beside what was measured."""
