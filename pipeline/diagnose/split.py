"""Which manoeuvres are fitted and which are held out: decided before anything is looked at."""

from __future__ import annotations

from collections.abc import Sequence

from kempf.pipeline.estimate.record.grid_run import GridRun

#: fewer runs than this are all fitted: one held out would leave too little
FEWEST_TO_HOLD_OUT = 3
_SHARE = 0.3


def split(runs: Sequence[GridRun]) -> tuple[list[int], list[int]]:
    """Return the numbers of the runs to fit and of those held out.

    About three in ten are held out, spread over time by their order alone, so that nothing that was measured decides.

    Parameters
    ----------
    runs : sequence of GridRun
        In order of time.
    """
    n = len(runs)
    if n < FEWEST_TO_HOLD_OUT:
        return list(range(n)), []
    count = max(1, round(_SHARE * n))
    held = sorted({int((k + 0.5) * n / count) for k in range(count)})
    return [i for i in range(n) if i not in held], held
