"""The page of the Monte Carlo at the information limit: what was wanted, what came out, cell by cell, and why."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from benchmarks.draw_information import draw_information
from benchmarks.information_result import Case, Cell, Run, gather
from benchmarks.result_page import RESULTS, table, write
from pipeline.normalise.series import Float
from schemas.model_spec import HULL_PARAMETERS

PARAMETERS = tuple(HULL_PARAMETERS)
#: errors after 25 iterations that the paper reports of its simulated trial, percent
PAPER_PERCENT = np.array([10.0, 10.0, 25.0, 20.0, 20.0, 5.0])
#: wanted of every cell
RMS_OVER_BOUND, COVERED, BIAS, FAILURES, BETTER = 1.1, (0.93, 0.97), 0.2, 0.005, 3.0

Judge = Callable[[Cell], tuple[Float, Float]]


def write_page(runs: Sequence[Run], options: str) -> Path:
    """Write ``results/information_limit.md`` and its figure; return the page's path."""
    by_case: dict[Case, list[Run]] = {}
    for one in runs:
        by_case.setdefault(one.case, []).append(one)
    cells = [gather(group) for group in by_case.values() if any(one.usable for one in group)]
    lost = [case for case, group in by_case.items() if not any(one.usable for one in group)]
    grid = [c for c in cells if is_grid(c.case)]
    draw_information(grid, cells, PAPER_PERCENT, RESULTS / "information_limit.png")
    lines = [
        *_setting(max(len(group) for group in by_case.values())),
        *[f"**No run of {_named(case)} gave an estimate.**" for case in lost],
        *_targets(grid),
        *_grid_tables(grid),
        *_paper(cells),
        *_controls(cells),
    ]
    return write("information_limit", "Maximum likelihood at the information limit", lines, options=options)


def is_grid(case: Case) -> bool:
    """Whether the cell belongs to the five hulls and three noise levels in the paper's wind and stream."""
    return case.environment == "paper" and case.with_heading and not case.control


def _named(case: Case) -> str:
    said = [case.hull, f"noise x {case.scale:g}"]
    said += [] if case.environment == "paper" else [case.environment]
    said += [] if case.with_heading else ["y_v and y_r only"]
    return ", ".join([*said, case.control] if case.control else said)


def _setting(runs: int) -> list[str]:
    return [
        f"Simulated 20-minute 20/20 zigzags, up to {runs} a cell: GNSS velocity 0.05 m/s, yaw rate 0.03 deg/s, heading "
        "0.05 deg and log 0.05 m/s at 1 Hz, rudder 0.1 deg at 2 Hz, all on one clock; times 0.3, 1 and 3. Wind force "
        "5e-3 m/s2 with a slow part of 1e-3, stream 0.3 m/s, base headings all round. The 3 m boat (usv) lives twelve "
        "times faster: 12 Hz, 24 Hz and 100 s, but the same noise. Every cell has its own draws.",
        "",
        "Two bounds: **true**, the Cramer-Rao bound from the expected information at the simulator's parameters and "
        "noise levels, averaged over the runs (noise levels unknown but for those that are nothing); **own**, the "
        "root mean square of the standard errors that the estimator reports. They differ because the simulator's force "
        "and stream are constants (and a small slow part), which eq. (16) has to follow by processes without a mean: "
        "the estimated levels are larger than the true ones, and the ship appears less well known than she is.",
        "",
        "![Errors over both bounds, coverage, bias, and the paper's errors](information_limit.png)",
        "",
    ]


def _targets(grid: Sequence[Cell]) -> list[str]:
    failed, total = sum(c.failures for c in grid), sum(c.runs for c in grid)

    def row(said: str, wanted: str, judge: Judge, within: Callable[[Float], Float], shown: str) -> list[str]:
        values = np.array([judge(c)[0] for c in grid])
        spread = np.array([judge(c)[1] for c in grid])
        met = within(values)
        # how far the nearest value that would do lies, in standard errors of the Monte Carlo itself
        clear = ~met & ~(within(values - 2.0 * spread) | within(values + 2.0 * spread))
        low, middle, high = np.percentile(values, [0.0, 50.0, 100.0])
        which = ", ".join(_cells_of(grid, clear)) or "none"
        return [
            said,
            wanted,
            " ... ".join(f"{v:{shown}}" for v in (low, middle, high)),
            f"{np.count_nonzero(met)} of {met.size}",
            f"{np.count_nonzero(clear)}: {which}" if clear.any() else "0",
        ]

    def half(c: Cell) -> float:
        return 1.0 / np.sqrt(2.0 * len(c.z))

    rows = [
        row(
            "rms error / true bound",
            f"<= {RMS_OVER_BOUND}",
            lambda c: (c.rms / c.bound, half(c) * c.rms / c.bound),
            lambda v: v <= RMS_OVER_BOUND,
            ".2f",
        ),
        row(
            "rms error / own bound",
            f"<= {RMS_OVER_BOUND}",
            lambda c: (c.rms / c.own, half(c) * c.rms / c.own),
            lambda v: v <= RMS_OVER_BOUND,
            ".2f",
        ),
        row(
            "95 % interval covers, %",
            f"{100 * COVERED[0]:.0f} to {100 * COVERED[1]:.0f}",
            lambda c: (100 * c.covered, np.full(6, 100 * np.sqrt(0.95 * 0.05 / len(c.z)))),
            lambda v: (v >= 100 * COVERED[0]) & (v <= 100 * COVERED[1]),
            ".1f",
        ),
        row(
            "bias / own standard error",
            f"within {BIAS}",
            lambda c: (c.bias / c.own, np.full(6, 1.0 / np.sqrt(len(c.z)))),
            lambda v: np.abs(v) <= BIAS,
            "+.2f",
        ),
    ]
    whole, ships = _pooled(grid), _pooled([c for c in grid if c.case.hull != "usv"])
    return [
        "## Wanted and found, five hulls and three noise levels",
        "",
        f"Failures (no estimate, not converged, no standard errors): {failed} of {total}, "
        f"{100 * failed / total:.2f} % (wanted: below {100 * FAILURES:g} %). "
        f"All cells together: {whole}. The four ships alone: {ships}.",
        "",
        *table(
            ["", "wanted", "least ... median ... largest", "met by", "missed by more than 2 Monte Carlo errors"], rows
        ),
        "",
    ]


def _pooled(cells: Sequence[Cell]) -> str:
    z = np.concatenate([c.z for c in cells])
    bound = np.sqrt(np.mean([np.mean((c.rms / c.bound) ** 2) for c in cells]))
    return (
        f"95 % intervals cover {100 * np.mean(np.abs(z) <= 1.96):.1f} %, rms z {np.sqrt(np.mean(z**2)):.2f}, "
        f"rms error over true bound {bound:.2f}, mean z "
        + ", ".join(f"{name} {value:+.2f}" for name, value in zip(PARAMETERS, z.mean(axis=0), strict=True))
    )


def _cells_of(grid: Sequence[Cell], mask: np.ndarray) -> list[str]:
    hits = [
        (c.case, [n for n, hit in zip(PARAMETERS, row, strict=True) if hit]) for c, row in zip(grid, mask, strict=True)
    ]
    return [f"{case.hull} x{case.scale:g} ({' '.join(names)})" for case, names in hits if names]


def _row(values: Float, shown: str) -> str:
    return " ".join(f"{v:{shown}}" for v in values)


def _grid_tables(grid: Sequence[Cell]) -> list[str]:
    head = [
        "ship",
        "noise",
        "failed",
        "rms error, %",
        "rms / true bound",
        "rms / own bound",
        "covered, %",
        "bias / own",
    ]
    return [
        f"Six numbers a field: {', '.join(PARAMETERS)}. With n runs the Monte Carlo itself is good to "
        "1/sqrt(2n) of a ratio (200 runs: 5 %), 1.5 % of a coverage, 0.07 of a bias.",
        "",
        *table(head, [_cell_row([c.case.hull, f"x {c.case.scale:g}"], c) for c in grid]),
        "",
    ]


def _cell_row(first: list[str], c: Cell) -> list[str]:
    return [
        *first,
        f"{c.failures} of {c.runs}",
        _row(100 * c.rms, ".2g"),
        _row(c.rms / c.bound, ".2f"),
        _row(c.rms / c.own, ".2f"),
        _row(100 * c.covered, ".0f"),
        _row(c.bias / c.own, "+.2f"),
    ]


def _paper(cells: Sequence[Cell]) -> list[str]:
    chosen = [c for c in cells if c.case.environment == "paper" and c.case.scale == 1.0 and not c.case.control]
    chosen.sort(key=lambda c: c.case.with_heading)
    rows = []
    for c in chosen:
        ratio = PAPER_PERCENT / (100 * c.rms)
        rows.append(
            [
                c.case.hull,
                "y_v, y_r, heading" if c.case.with_heading else "y_v, y_r",
                _row(100 * c.rms, ".2g"),
                _row(100 * c.bound, ".2g"),
                _row(ratio, ".1f"),
                "yes" if np.all(ratio >= BETTER) else f"no: {', '.join(np.array(PARAMETERS)[ratio < BETTER])}",
            ]
        )
    head = [
        "ship",
        "measured",
        "rms error, %",
        "true bound, %",
        "paper's error / rms error",
        "all at least 3 times better",
    ]
    return [
        "## The paper's scenario",
        "",
        f"1 Hz, 0.05 m/s, 0.03 deg/s, 20 minutes of 20/20. The paper's errors: {_row(PAPER_PERCENT, '.0f')} %; it names "
        "no ship.",
        "",
        *table(head, rows),
        "",
        *_out_of_reach(chosen),
    ]


def _out_of_reach(chosen: Sequence[Cell]) -> list[str]:
    """Say where the bound itself forbids what is wanted."""
    said = []
    for c in chosen:
        beyond = [n for n, b, p in zip(PARAMETERS, 100 * c.bound, PAPER_PERCENT, strict=True) if BETTER * b > p]
        if beyond:
            how = "with the heading" if c.case.with_heading else "by y_v and y_r only"
            said.append(f"{c.case.hull} {how} ({', '.join(beyond)})")
    if not said:
        return []
    return [f"No unbiased estimator can be three times better, as the bound forbids it, for {'; '.join(said)}.", ""]


def _controls(cells: Sequence[Cell]) -> list[str]:
    names = {
        "paper": "the paper's",
        "drawn": "drawn from eq. (16)",
        "constant": "constants, no slow part",
        "calm": "none",
    }
    shown = [c for c in cells if c.case.with_heading and not is_grid(c.case)]
    parents = {c.case.hull for c in shown}
    shown += [c for c in cells if is_grid(c.case) and c.case.scale == 1.0 and c.case.hull in parents]
    order = list(dict.fromkeys(c.case.hull for c in cells))
    shown.sort(key=lambda c: (order.index(c.case.hull), not is_grid(c.case), c.case.environment, c.case.control))
    rows = [_cell_row([c.case.hull, names[c.case.environment], c.case.control or "as is"], c) for c in shown]
    head = ["ship", "force and stream", "instruments", "failed"]
    head += ["rms error, %", "rms / true bound", "rms / own bound", "covered, %", "bias / own"]
    return [
        "## One source at a time",
        "",
        "Noise x 1. Runs of one ship share their draws of noise, so what differs between her rows is the source.",
        "",
        *table(head, rows),
        "",
        *_reading(cells),
    ]


def _reading(cells: Sequence[Cell]) -> list[str]:
    """Say what the tables show, each sentence with its numbers; a sentence whose cells are missing is left out."""
    by_case = {c.case: c for c in cells}
    lines: list[str] = []

    def levels(case: Case) -> str:
        c = by_case[case]
        return f"sigma_F {c.levels['sigma_F']:.2g} m/s2 and sigma_V {c.levels['sigma_V']:.2g} m/s"

    as_is, drawn = Case("mariner", 1.0), Case("mariner", 1.0, environment="drawn")
    if as_is in by_case and drawn in by_case:
        a, b = by_case[as_is], by_case[drawn]
        lines.append(
            f"- Constants that eq. (16) has no state for: on the Mariner the median estimates are {levels(as_is)} "
            f"where the slow parts are 0.001 and 0, and rms error over own bound is {_row(a.rms / a.own, '.2f')}. With "
            f"force and stream drawn from eq. (16) itself it is {_row(b.rms / b.own, '.2f')}, and over the true bound "
            f"{_row(b.rms / b.bound, '.2f')}."
        )
    usv, exact = Case("usv", 1.0), Case("usv", 1.0, control="exact rudder and log")
    sized = Case("usv", 1.0, control="noise of her size")
    if usv in by_case and exact in by_case and sized in by_case:
        a, b, c = by_case[usv], by_case[exact], by_case[sized]
        lines.append(
            f"- The boat: her log's 0.05 m/s is 3 % of her speed, and her yaw is known to {100 * b.bound[5]:.1g} %. "
            f"With an exact rudder and log the bias is {_row(b.bias / b.own, '+.2f')} of a standard error, with the "
            f"noise as it is {_row(a.bias / a.own, '+.2f')}, with noise as small beside her motion as a ship's is "
            f"{_row(c.bias / c.own, '+.2f')}. The estimator takes the error of the smoothed speed for a white shake of "
            "the rudder of the log's full intensity; smoothing has taken it away at the frequencies at which so quick a "
            "boat answers. Too much process noise makes the filter follow the measured yaw rate, a regression on noisy "
            f"values, and sigma_r comes out at {np.rad2deg(a.levels['sigma_r']):.3f} deg/s where it is 0.030."
        )
    return lines
