"""What each source of error does at the information limit: cells with one source changed, and what they show."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from benchmarks.information_result import Case, Cell, Run, gather
from benchmarks.result_page import table
from pipeline.normalise.series import Float


def six(values: Float, shown: str) -> str:
    """Return the numbers of the six parameters as one field of a table."""
    return " ".join(f"{v:{shown}}" for v in values)


def cell_row(first: list[str], c: Cell) -> list[str]:
    """Return the fields of a cell's line, after the first ones."""
    return [
        *first,
        f"{c.failures} of {c.runs}",
        six(100 * c.rms, ".2g"),
        six(c.rms / c.bound, ".2f"),
        six(c.rms / c.own, ".2f"),
        six(100 * c.covered, ".0f"),
        six(c.bias / c.own, "+.2f"),
    ]


def sources(cells: Sequence[Cell], runs: Mapping[Case, Sequence[Run]]) -> list[str]:
    """Return the lines on what each source of error does: a table, and what it shows."""
    names = {
        "paper": "the paper's",
        "drawn": "drawn from eq. (16)",
        "constant": "constants, no slow part",
        "calm": "none",
    }
    shown = [c for c in cells if c.case.with_heading and not c.case.on_grid]
    parents = {(c.case.hull, c.case.scale) for c in shown}
    shown += [c for c in cells if c.case.on_grid and (c.case.hull, c.case.scale) in parents]
    order = list(dict.fromkeys(c.case.hull for c in cells))
    shown.sort(key=lambda c: (order.index(c.case.hull), c.case.scale, not c.case.on_grid, c.case.environment))
    rows = [
        cell_row([c.case.hull, f"x {c.case.scale:g}", names[c.case.environment], c.case.control or "as is"], c)
        for c in shown
    ]
    head = ["ship", "noise", "force and stream", "what differs", "failed"]
    head += ["rms error, %", "rms / true bound", "rms / own bound", "covered, %", "bias / own"]
    return [
        "## One source at a time",
        "",
        "Runs of one ship at one noise share their draws, fewer runs the first ones; the sentences below "
        "compare equal draws.",
        "",
        *table(head, rows),
        "",
        *_reading(runs),
    ]


def _reading(runs: Mapping[Case, Sequence[Run]]) -> list[str]:
    """Say what the tables show, each sentence with its numbers, over the draws that its cells have in common."""
    pairs: list[tuple[Callable[..., str], tuple[Case, ...]]] = [
        (_constants, (Case("mariner", 1.0), Case("mariner", 1.0, environment="drawn"))),
        (_walks, (Case("tanker", 1.0), Case("tanker", 1.0, control="random walks"))),
        (_heading, (Case("mariner", 1.0), Case("mariner", 1.0, control="y_v from the exact heading"))),
        (_corners, (Case("ferry", 0.3), Case("ferry", 0.3, control="rudder at 2 Hz"))),
        (
            _boat,
            (
                Case("usv", 1.0),
                Case("usv", 1.0, control="exact rudder and log"),
                Case("usv", 1.0, control="noise of her size"),
            ),
        ),
    ]
    said = []
    for say, needed in pairs:
        groups = [runs.get(case, ()) for case in needed]
        common = min(len(group) for group in groups)
        if all(any(one.usable for one in group[:common]) for group in groups):
            said.append(say(*(gather(group[:common]) for group in groups)))
    return said


def _biases(c: Cell) -> str:
    return six(c.bias / c.own, "+.2f")


def _constants(as_is: Cell, drawn: Cell) -> str:
    return (
        "- **Constants.** The simulator's force and stream are constants and a small slow part; eq. (16) follows them "
        "by processes without a mean, whose levels come out larger than the slow parts: on the Mariner sigma_F "
        f"{as_is.levels['sigma_F']:.2g} m/s2 for 0.001 and sigma_V {as_is.levels['sigma_V']:.2g} m/s for 0. The ship "
        "then appears less well known than she is, and intervals cover too much: rms error over own bound "
        f"{six(as_is.rms / as_is.own, '.2f')}. With force and stream drawn from eq. (16) itself it is "
        f"{six(drawn.rms / drawn.own, '.2f')}, and over the true bound {six(drawn.rms / drawn.bound, '.2f')}."
    )


def _walks(as_is: Cell, walking: Cell) -> str:
    return (
        "- **Random walks.** Fitted with disturbances that hardly forget (correlation rates 1e-5 and 1e-6 1/s) they "
        "can stay where constants stay. On the tanker rms error over true bound falls from "
        f"{six(as_is.rms / as_is.bound, '.2f')} to {six(walking.rms / walking.bound, '.2f')}, and over own bound it is "
        f"{six(walking.rms / walking.own, '.2f')}."
    )


def _heading(as_is: Cell, exact: Cell) -> str:
    return (
        "- **Heading in eq. (18).** The heading's noise enters y_v, where it is measured as psi too; the likelihood "
        f"takes the two for independent. With y_v from the exact heading the bias is {_biases(exact)}, as it is "
        f"{_biases(as_is)}."
    )


def _corners(as_is: Cell, slow: Cell) -> str:
    return (
        "- **Corners of the rudder.** The rudder starts and stops between its readings, and a straight line between "
        f"two readings cuts the corner. On the ferry at noise x 0.3, rudder at 2 Hz, the bias is {_biases(slow)}, at 4 "
        f"Hz {_biases(as_is)}."
    )


def _boat(as_is: Cell, exact: Cell, sized: Cell) -> str:
    return (
        f"- **The boat.** Her log's 0.05 m/s is 3 % of her speed while her b2 could be known to "
        f"{100 * exact.bound[5]:.1g} %. With an exact rudder and log the bias is {_biases(exact)} in the "
        f"{len(exact.z)} of {exact.runs} runs that converge; as it is {_biases(as_is)}, and sigma_r comes out at "
        f"{np.rad2deg(as_is.levels['sigma_r']):.3f} deg/s where it is 0.030. The likely reason: the estimator takes "
        "the speed's error for a shake of the rudder of twice its relative size, though in a turn a V v + a V r gives "
        "half of that back. Too much process noise makes the filter follow the measured yaw rate, a regression on "
        f"noisy values. With noise as small beside her motion as a ship's is the bias is {_biases(sized)}."
    )
