"""Joins pipeline and warehouse into jobs, and the jobs into Prefect flows. Holds no arithmetic.

The jobs are plain functions that a terminal calls at once; only `kempf.flows.fleet` knows Prefect.
"""

import os

# Segments and vessels share the cores, and the matrices are small: threads of the linear algebra below them cost a
# quarter more of the processor and win nothing. numpy asks once, when it is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
