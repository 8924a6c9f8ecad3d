"""The tables: raw logs by content hash, readings, segments, parameter sets, runs; provenance and history.

Alone in touching storage. Holds no arithmetic on measurements and knows neither flows nor the workbench.
"""
