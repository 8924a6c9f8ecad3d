"""Joins pipeline and warehouse into jobs, and the jobs into Prefect flows. Holds no arithmetic.

The jobs are plain functions that a terminal calls at once; only `flows.fleet` knows Prefect.
"""
