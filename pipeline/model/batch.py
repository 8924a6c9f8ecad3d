"""Lanes: several sets of parameters that go through one compiled filter side by side, innermost in memory.

The compiler knows the length of a tuple, but not its elements: kernels are compiled once for `ONE`, where a place of an
array is a plain number, and once for `LANES`, where it is a vector (`kempf.pipeline.model.lanes`).
"""

from __future__ import annotations

from kempf.pipeline.compiled import STEP, njit

#: for one set of parameters, and for so many; a power of two, or the processor takes them one by one
ONE, LANES = (1,), (16, 16)
#: how many go through together
MOST = LANES[0]


@njit(**STEP)
def each(lanes):  # type: ignore[no-untyped-def]
    """Return the number of lanes."""
    return 1 if len(lanes) == 1 else lanes[0]
