"""Every figure that the documents quote, each by a command that writes its own page."""

import os

# As `kempf.flows` has it for all commands, and before numpy is imported: with more threads the linear algebra sums in
# another order, and the last bits are others.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
