"""``kempf compare``."""

from __future__ import annotations

import sys
from itertools import zip_longest
from math import isfinite
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

import click

from kempf.schemas.enumeration import as_words, counted
from kempf.schemas.errors import ThresholdExceeded, UsageError
from kempf.schemas.motion_channel import MOTION
from kempf.workbench.cli.given_once import GivenOnce
from kempf.workbench.cli.options import figure_option, json_option, verbose_option, vessel_option, warehouse_option
from kempf.workbench.new_file import require_figures, writing
from kempf.workbench.numbers import number
from kempf.workbench.ranked_warnings import MOST
from kempf.workbench.terminal import print_json, print_note, print_table, progress_bar, short_ids

if TYPE_CHECKING:
    from kempf.flows.jobs.compare.compare_vessel import Comparison

#: probability below which a band or a correlation is shown
_LEVEL = 0.01
#: fit, %, below which the number of a fit says nothing: the error is twice the motion
_WORST_FIT = -100.0
_SAMPLES = {"held_out": "held out", "fitted": "fitted"}


@click.command("compare", cls=GivenOnce)
@vessel_option(required=True)
@click.option(
    "--set",
    "sets",
    multiple=True,
    metavar="ID",
    help="Parameter set, by id or alias; default: current. May be repeated: one block a set.",
)
@click.option(
    "--horizon",
    default="free",
    show_default=True,
    metavar="1|10s|60s|free|legs",
    help="One step, so many seconds ahead, or freely from the first instant on; legs: freely, with the parameters "
    "fitted to legs where predictions of manoeuvres take these.",
)
@click.option("--where", "with_where", is_flag=True, help="Say also where the model fails.")
@figure_option("Draw measured over predicted")
@click.option(
    "--fail-above",
    type=float,
    metavar="PERCENT",
    help="Exit code 5 where the mean free-run error (100 - fit %) of held-out, else fitted, manoeuvres is larger.",
)
@verbose_option
@warehouse_option
@json_option
def command(
    vessel: str,
    sets: tuple[str, ...],
    horizon: str,
    with_where: bool,
    figure: Path | None,
    fail_above: float | None,
    verbose: bool,
    uri: str,
    as_json: bool,
) -> None:
    """Put what was measured beside what a parameter set predicts, on fitted and on held-out manoeuvres apart.

    A manoeuvre that the set was identified from is fitted, every other held out. A free run takes no measurement
    in: its initial state and a constant wind force and current are fitted to the manoeuvre itself.
    """
    from kempf.flows.jobs.compare.compare_vessel import compare_vessel
    from kempf.flows.jobs.state.out_of_date import said_of_vessel
    from kempf.warehouse.storage.store import Warehouse

    if fail_above is not None and not isfinite(fail_above):
        raise UsageError("threshold", f"--fail-above {fail_above} is no limit.", "Give a percentage such as 20.")
    names: list[str | None] = [*dict.fromkeys(sets)] or [None]
    figures = require_figures(figure, len(names))
    warehouse = Warehouse(uri)
    with progress_bar() as progress:
        compared = [compare_vessel(warehouse, vessel, name, horizon, progress) for name in names]
    print_note(said_of_vessel(warehouse, vessel))
    documents = []
    for comparison, path in zip_longest(compared, figures):
        document = comparison.as_json()
        if with_where:
            document["where"] = comparison.where()
        if path is not None:
            _draw(comparison, path)
        if fail_above is not None:
            judged = document["judged"]
            exceeded = not judged["free_run_error_percent"] <= fail_above
            document["fail_above"] = {"limit_percent": fail_above, "exceeded": exceeded, **judged}
        documents.append(document)
    if as_json:
        print_json(documents if len(documents) > 1 else documents[0])
    else:
        for document in documents:
            _print_comparison(document, verbose=verbose)
    above = [document for document in documents if fail_above is not None and document["fail_above"]["exceeded"]]
    for document in above:
        judged = document["judged"]
        click.echo(
            f"{document['parameter_set_id']}: the free-run error of {_SAMPLES[judged['sample']]} manoeuvres is "
            f"{judged['free_run_error_percent']:.2f} %, above {fail_above:g} %",
            err=True,
        )
    if above:
        sys.exit(ThresholdExceeded.exit_code)


def _draw(comparison: Comparison, figure: Path) -> None:
    from kempf.workbench.figures.measured_over_predicted import draw_measured_over_predicted

    title = f"{comparison.vessel}, {comparison.parameter_set.parameter_set_id}: {comparison.horizon.words}"
    with writing(figure):
        draw_measured_over_predicted(comparison.runs, figure, title)


def _print_skipped(skipped: dict[str, str], *, verbose: bool) -> None:
    """Say which manoeuvres are left out, those of one reason together."""
    by_reason: dict[str, list[str]] = {}
    for name, why in skipped.items():
        # a reason that begins with the manoeuvre's name is said after it
        by_reason.setdefault(why.removeprefix(f"{name} "), []).append(name)
    for why, names in by_reason.items():
        shown = names if verbose else names[:MOST]
        more = f" and {len(names) - len(shown)} more" if len(names) > len(shown) else ""
        click.echo(f"  left out: {', '.join(shown)}{more}: {why}", err=True)


def _print_comparison(document: dict[str, Any], *, verbose: bool) -> None:
    by = f" (alias {document['alias']})" if document["alias"] else ""
    effects = f", effects {', '.join(document['effects'])}" if document["effects"] else ", without effects"
    click.echo(
        click.style(f"{document['vessel']}: {document['parameter_set_id']}{by}, {document['estimator']}", bold=True)
        + effects
    )
    click.echo(f"horizon: {document['horizon_words']}; fit % = 100 (1 - |y - y^| / |y - mean y|)")
    start = document["runs"][0]["started_from"]
    if "note" in start:
        click.echo(f"initial state and disturbances: {start['note']}")
    else:
        click.echo(f"initial state: {start['initial_state']}; {start['disturbances']}")
    for sample, title in _SAMPLES.items():
        runs = [run for run in document["runs"] if run["sample"] == sample]
        _print_sample(title, runs, document["summary"][sample], verbose=verbose)
    _print_skipped(document["skipped"], verbose=verbose)
    for sample, title in _SAMPLES.items():
        if document.get("where", {}).get(sample):
            _print_where(title, document["where"][sample])


def _print_sample(title: str, runs: list[dict[str, Any]], mean: dict[str, Any] | None, *, verbose: bool) -> None:
    if mean is None:
        click.echo(click.style(f"{title}: no manoeuvre", bold=True))
        return
    there = [name for name in MOTION if name in mean["fit_percent"]]
    head = ["manoeuvre", "what", "start UTC"]
    for name in there:
        head += [f"{MOTION[name].words} fit %", f"rms {mean['rms_display'][name]['unit']}"]
    head += ["largest free-run overshoot error deg"]
    rows, short = [], short_ids(run["segment_id"] for run in runs)
    for run in runs:
        angles = f"{run['psi0_deg']:g}/{run['delta0_deg']:g}" if "zigzag" in run["kind"] else "random"
        row = [short[run["segment_id"]], angles, run["start"][:16]]
        for name in there:
            row += [_percent(run["fit_percent"].get(name)), number(run["rms_display"].get(name, {}).get("value"), 3)]
        errors = [error for error in run["overshoot_error_deg"] if error is not None]
        rows.append([*row, _signed(max(errors, key=abs, default=None))])
    print_table(head, rows, f"{title}: {counted(len(runs), 'manoeuvre')}")
    for run in runs if verbose else ():
        every = " ".join(_signed(error) for error in run["overshoot_error_deg"])
        click.echo(f"  overshoot errors of {short[run['segment_id']]}: {every or '-'} deg")
    off = sum(any(_is_off(fit) for fit in run["fit_percent"].values()) for run in runs)
    click.echo(f"  {_fits_together(runs, mean['fit_percent'], there, off)}")
    turns = mean["overshoot_error_deg"]
    if turns["n"]:
        click.echo(
            f"  free-run overshoot, predicted less measured: {_with_error(turns)} deg over {turns['n']}; "
            f"size {turns['mean_size']:.2f} deg"
            + (f"; {turns['not_predicted']} not predicted" if turns["not_predicted"] else "")
        )
    inside = mean["inside_95_percent"]
    if inside:
        shares = [f"{MOTION[name].words} {100 * inside[name]['share']:.1f} %" for name in there if name in inside]
        click.echo(f"  inside the 95 % interval: {', '.join(shares)}")
    likelihood, legs = mean["free_run_error_percent"], mean["free_run_error_percent_fitted_to_legs"]
    if not legs:
        click.echo(f"  free-run error (100 - fit %, mean over channels): {_error(likelihood)}")
        return
    click.echo(
        f"  free-run error (100 - fit %, mean over channels): {_error(likelihood)} with the likelihood's parameters, "
        f"{_error(legs, middle=True)} with those fitted to legs (--horizon legs), which predictions of manoeuvres take"
    )


def _fits_together(runs: list[dict[str, Any]], mean: dict[str, Any], there: list[str], off: int) -> str:
    """Return the fit over all runs: the mean, or the median where so many runs are off."""
    if off:
        known = {name: [run["fit_percent"][name] for run in runs if name in run["fit_percent"]] for name in there}
        middle = {name: median(fits) for name, fits in known.items()}
        parts = [f"{MOTION[name].words} {_percent(fit)} %" for name, fit in middle.items()]
        many = f"{off} of {len(runs)} have a fit below {_WORST_FIT:g} %"
        return f"median fit: {', '.join(parts)}; {many}, so that a mean says nothing"
    fits = [mean[name] for name in there]
    parts = [f"{MOTION[name].words} {_plus_minus(fit)} %" for name, fit in zip(there, fits, strict=True)]
    quoted_as = "" if any(fit["std_error"] is None for fit in fits) else " ± 1 s.e."
    return f"mean fit{quoted_as}: {', '.join(parts)}"


def _print_where(title: str, where: dict[str, Any]) -> None:
    click.echo(click.style(f"where it fails, {title} manoeuvres (whitened rms: 1 where the model is right)", bold=True))
    if not where["stands_out"]:
        click.echo("  no phase, side, bin or manoeuvre stands out from what a right model leaves")
    rows = [
        [
            MOTION[group["channel"]].words,
            f"{as_words(group['of'].removeprefix('by_'))}: {as_words(group['which'])}",
            f"{group['n']}",
            f"{group['whitened_rms']:.2f}",
            f"{group['band'][0]:.2f} to {group['band'][1]:.2f}",
        ]
        for group in where["stands_out"]
    ]
    if rows:
        print_table(["channel", "where", "n", "whitened rms", "99 % band"], rows)
    count = sum(len(bands) for bands in where["by_band"].values())
    for channel, bands in where["by_band"].items():
        out = [b for b in bands if count * b["p_value"] < _LEVEL]
        if out:
            most = max(out, key=lambda b: float(b["ratio"]))
            click.echo(
                f"  {MOTION[channel].words}: {most['ratio']:.1f} times the power of white noise between "
                f"{most['low_hz']:g} and {most['high_hz']:g} Hz, most at {most['peak_hz']:.3g} Hz"
            )
    for channel, correlations in where["correlations"].items():
        _print_correlation(MOTION[channel].words, correlations)
    short = short_ids(w["run"] for w in where["worst"])
    rows = [
        [w["start"][:19], w["end"][11:19], short[w["run"]], MOTION[w["channel"]].words, w["measure"], _size(w)]
        for w in where["worst"]
    ]
    print_table(["start UTC", "end", "manoeuvre", "channel", "horizon", "error"], rows, "  worst windows")


def _print_correlation(channel: str, correlations: dict[str, Any]) -> None:
    """Say that a channel's innovations are correlated with themselves or with the inputs, where they do."""
    p_value = correlations["auto"]["p_value"]
    if p_value is not None and p_value < _LEVEL:
        click.echo(f"  {channel}: errors one step ahead are correlated in time (Ljung-Box p = {p_value:.1g})")
    significant = [(name, entry) for name, entry in correlations["cross"].items() if entry["largest"] is not None]
    significant = [(name, entry) for name, entry in significant if entry["p_adjusted"] < _LEVEL]
    if significant:
        name, entry = min(significant, key=lambda pair: float(pair[1]["p_adjusted"]))
        click.echo(
            f"  {channel}: errors are correlated with {as_words(name)} {entry['largest_lag_s']:g} s before: "
            f"{entry['largest']:+.2f} (99 % band ±{entry['band']:.2f})"
        )


def _size(window: dict[str, Any]) -> str:
    if window["measure"] == "one step":
        return f"whitened rms {window['whitened_rms']:.2f}"
    return f"rms {number(window['free_run_rms'], 3)} {window['unit']}, {window['times_its_rms']:.1f} x"


def _is_off(fit: float) -> bool:
    """Return whether a fit is so bad that its number says nothing."""
    return fit < _WORST_FIT


def _percent(value: float | None) -> str:
    return "-" if value is None else f"< {_WORST_FIT:g}" if _is_off(value) else f"{value:.2f}"


def _error(errors: dict[str, Any], *, middle: bool = False) -> str:
    """Return a free-run error over manoeuvres: the mean, where none of them has left the course; the median."""
    median_of = "diverges" if errors["median"] is None else f"{errors['median']:.2f} %"
    if errors["off"]:
        return f"median {median_of}, {errors['off']} left the course"
    return f"{_with_error(errors)} %" + (f", median {median_of}," if middle else "")


def _signed(value: float | None) -> str:
    return "-" if value is None else f"{value:+.2f}"


def _with_error(mean: dict[str, Any]) -> str:
    return _plus_minus(mean) + ("" if mean["std_error"] is None else " (1 s.e.)")


def _plus_minus(mean: dict[str, Any]) -> str:
    return f"{mean['mean']:.2f}" + ("" if mean["std_error"] is None else f" ± {mean['std_error']:.2f}")
