"""What each source of error does at the information limit: cells with one source changed, and what they show."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from benchmarks.identify.information_result import Case, Cell, Run, gather
from benchmarks.result_page import table
from kempf.pipeline.channels.series import Float


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
        (_walks, (Case("tanker", 1.0), Case("tanker", 1.0, control="forgetting"))),
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
        "- **Constants.** The simulator's force and stream are constants, the force with a small slow part; the "
        "estimator follows them by random walks. With force and stream drawn from eq. (16) with correlation times of "
        f"300 and 1800 s rms error over own bound is {six(drawn.rms / drawn.own, '.2f')}, and over the true bound "
        f"{six(drawn.rms / drawn.bound, '.2f')}; as it is {six(as_is.rms / as_is.own, '.2f')} and "
        f"{six(as_is.rms / as_is.bound, '.2f')}."
    )


def _walks(as_is: Cell, forgetting: Cell) -> str:
    return (
        "- **Walks.** Fitted with disturbances that forget within 300 and 1800 s, as the first version took them, a "
        "constant must be pushed back up all the time. On the tanker rms error over true bound is "
        f"{six(forgetting.rms / forgetting.bound, '.2f')} then, and over own bound "
        f"{six(forgetting.rms / forgetting.own, '.2f')}; with the walks {six(as_is.rms / as_is.bound, '.2f')} and "
        f"{six(as_is.rms / as_is.own, '.2f')}."
    )


def _heading(as_is: Cell, exact: Cell) -> str:
    return (
        "- **Heading in eq. (18).** The heading's noise enters y_v, where it is measured as psi too; the likelihood "
        f"takes the two for independent. With y_v from the exact heading the bias is {_biases(exact)}, as it is "
        f"{_biases(as_is)}."
    )


def _corners(as_is: Cell, slow: Cell) -> str:
    return (
        "- **Corners of the rudder.** The rudder starts and stops between its readings; its corners are put where the "
        f"lines before and after meet. On the ferry at noise x 0.3, rudder at 2 Hz, the bias is {_biases(slow)}, at 4 "
        f"Hz {_biases(as_is)}."
    )


def _boat(as_is: Cell, exact: Cell, sized: Cell) -> str:
    return (
        f"- **The boat.** Her log's 0.05 m/s is 3 % of her speed while her b2 could be known to "
        f"{100 * exact.bound[5]:.1g} %. What smoothing leaves of the log's noise is slow beside her, and a state of "
        f"the likelihood (decision 0022). With an exact rudder and log the bias is {_biases(exact)} in the "
        f"{len(exact.z)} of {exact.runs} runs that converge; as it is {_biases(as_is)}; with noise as "
        f"small beside her motion as a ship's is {_biases(sized)}."
    )
