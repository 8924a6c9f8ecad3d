"""Lanes: several sets of parameters that go through one compiled filter side by side, innermost in memory.

The compiler knows the length of a tuple, but not its elements: a filter compiled for `ONE` has no loops over lanes at
all, and one for `LANES` has loops of a length that it cannot know, which it hands to the processor's vector unit. (A
loop of a short length that it does know it would write out number by number.)
"""

from __future__ import annotations

from kempf.pipeline.compiled import STEP, njit

#: for one set of parameters, and for so many
ONE, LANES = (1,), (16, 16)
#: how many go through together
MOST = LANES[0]
#: numbers that the processor takes at once: where lanes are cheap and many, their number is a multiple of it
VECTOR = 4


@njit(**STEP)
def each(lanes):  # type: ignore[no-untyped-def]
    """Return the number of lanes."""
    return 1 if len(lanes) == 1 else lanes[0]
