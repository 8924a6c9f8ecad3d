"""The page of the Monte Carlo at the information limit: what was wanted, what came out, cell by cell, and why."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.identify.draw_information import draw_information
from benchmarks.identify.information_result import Case, Cell, Run, gather
from benchmarks.identify.information_sources import cell_row, six, sources
from benchmarks.result_page import RESULTS, table, write
from kempf.pipeline.channels.series import Float
from kempf.schemas.model_spec import HULL_PARAMETERS

PARAMETERS = tuple(HULL_PARAMETERS)
#: errors after 25 iterations that the paper reports of its simulated trial, percent
PAPER_PERCENT = np.array([10.0, 10.0, 25.0, 20.0, 20.0, 5.0])
#: wanted of every cell
RMS_OVER_BOUND, COVERED, BIAS, FAILURES, BETTER = 1.1, (93.0, 97.0), 0.2, 0.005, 3.0

#: how many cells that miss are named
_NAMED = 8


def write_page(runs: Sequence[Run], options: str) -> Path:
    """Write ``results/information_limit.md`` and its figure; return the page's path."""
    by_case: dict[Case, list[Run]] = {}
    for one in runs:
        by_case.setdefault(one.case, []).append(one)
    cells = [gather(group) for group in by_case.values() if any(one.usable for one in group)]
    lost = [case for case, group in by_case.items() if not any(one.usable for one in group)]
    grid = [c for c in cells if c.case.on_grid]
    draw_information(grid, cells, PAPER_PERCENT, RESULTS / "information_limit.png")
    lines = [
        *_setting(max(len(group) for group in by_case.values())),
        *[f"**No run of {_named(case)} gave an estimate.**" for case in lost],
        *_targets(grid),
        *_grid_tables(grid),
        *_paper(cells),
        *sources(cells, by_case),
    ]
    return write("identify.information_limit", "Maximum likelihood at the information limit", lines, options=options)


def _named(case: Case) -> str:
    said = [case.hull, f"noise x {case.scale:g}"]
    said += [] if case.environment == "paper" else [case.environment]
    said += [] if case.with_heading else ["y_v and y_r only"]
    return ", ".join([*said, case.control] if case.control else said)


def _setting(runs: int) -> list[str]:
    return [
        f"Simulated 20-minute 20/20 zigzags, {runs} a cell of the grid, a quarter by y_v and y_r only and with "
        "disturbances that forget, an eighth where one other source is changed. GNSS velocity 0.05 m/s, yaw rate "
        "0.03 deg/s, heading 0.05 deg and log 0.05 m/s at 1 Hz, rudder 0.1 deg at 4 Hz, all on one clock; times 0.3, "
        "1 and 3. Wind force 5e-3 m/s2 with a slow part of 1e-3, stream 0.3 m/s, base headings all round. The boat of "
        "3 m (usv) lives twelve times faster: 12 Hz, 48 Hz and 100 s, but with the same noise. Every cell of the grid "
        "has its own draws.",
        "",
        "Two bounds: **true**, the Cramer-Rao bound from the expected information at the simulator's parameters, "
        "noise levels and disturbances, averaged over runs (the constant force unknown, the stream a constant from "
        "an unknown beginning, noise levels unknown but for those that are nothing; the errors of rudder and log as "
        "large as the estimator takes them for); **own**, the root mean square of the standard errors that the "
        "estimator reports.",
        "",
        "![Errors over both bounds, coverage, bias, and the paper's errors](information_limit.png)",
        "",
    ]


def _targets(grid: Sequence[Cell]) -> list[str]:
    failed, total = sum(c.failures for c in grid), sum(c.runs for c in grid)
    n = np.array([[len(c.z)] * 6 for c in grid])
    over_true = np.array([c.rms / c.bound for c in grid])
    over_own = np.array([c.rms / c.own for c in grid])
    covered = np.array([100 * c.covered for c in grid])
    bias = np.array([c.bias / c.own for c in grid])
    most, share, fair = f"<= {RMS_OVER_BOUND}", f"{COVERED[0]:g} to {COVERED[1]:g}", f"within {BIAS}"
    rows = [
        ["rms error / true bound", most, *_judged(grid, over_true, over_true / np.sqrt(2 * n), (0.0, RMS_OVER_BOUND))],
        ["rms error / own bound", most, *_judged(grid, over_own, over_own / np.sqrt(2 * n), (0.0, RMS_OVER_BOUND))],
        ["95 % interval covers, %", share, *_judged(grid, covered, 100 * np.sqrt(0.95 * 0.05 / n), COVERED)],
        ["bias / own standard error", fair, *_judged(grid, bias, 1.0 / np.sqrt(n), (-BIAS, BIAS))],
    ]
    head = ["", "wanted", "least ... median ... largest", "met by", "missed by more than 2 Monte Carlo errors"]
    whole, ships = _pooled(grid), _pooled([c for c in grid if c.case.hull != "usv"])
    return [
        "## Wanted and found, five hulls and three noise levels",
        "",
        f"Failures (no estimate, not converged, no standard errors): {failed} of {total}, "
        f"{100 * failed / total:.2f} % (wanted: below {100 * FAILURES:g} %).",
        "",
        f"All cells together: {whole}.",
        "",
        f"The four ships alone: {ships}.",
        "",
        *table(head, rows),
        "",
    ]


def _judged(grid: Sequence[Cell], values: Float, spread: Float, wanted: tuple[float, float]) -> list[str]:
    """Return the range of the values, how many lie in the wanted one, and which lie outside beyond chance.

    ``values`` and their Monte Carlo errors ``spread`` have shape (n_cell, 6).
    """
    met = (values >= wanted[0]) & (values <= wanted[1])
    clear = (values - 2.0 * spread > wanted[1]) | (values + 2.0 * spread < wanted[0])
    cells = _cells_of(grid, clear)
    more = f" and {len(cells) - _NAMED} more" if len(cells) > _NAMED else ""
    return [
        " ... ".join(f"{v:.2f}" for v in np.percentile(values, [0.0, 50.0, 100.0])),
        f"{np.count_nonzero(met)} of {met.size}",
        f"{np.count_nonzero(clear)}: {', '.join(cells[:_NAMED])}{more}" if clear.any() else "0",
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
        *table(head, [cell_row([c.case.hull, f"x {c.case.scale:g}"], c) for c in grid]),
        "",
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
                six(100 * c.rms, ".2g"),
                six(100 * c.bound, ".2g"),
                six(ratio, ".1f"),
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
        "1 Hz, 0.05 m/s, 0.03 deg/s, 20 minutes of 20/20. "
        f"The paper's errors: {six(PAPER_PERCENT, '.0f')} %; it names no ship.",
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
