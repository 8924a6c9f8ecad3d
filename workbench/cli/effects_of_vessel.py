"""``kempf effects try|add|undo``: effects on a vessel's own manoeuvres."""

from __future__ import annotations

from collections.abc import Mapping
from math import nan
from pathlib import Path
from typing import Any

import click

from kempf.schemas.errors import UsageError
from kempf.schemas.motion_channel import MOTION
from kempf.workbench.cli.given_once import GivenOnce
from kempf.workbench.cli.ladder import print_rungs
from kempf.workbench.cli.options import json_option, verbose_option, vessel_option, warehouse_option
from kempf.workbench.documents.tried import refits
from kempf.workbench.numbers import number
from kempf.workbench.ranked_warnings import show_warnings
from kempf.workbench.rungs import by_manoeuvre, compared, in_words
from kempf.workbench.terminal import print_json, print_note, print_table, progress_bar


@click.command("try", cls=GivenOnce)
@click.argument("formula")
@vessel_option(required=True)
@click.option("--name", default="own", show_default=True, help="What the effect is called.")
@warehouse_option
@json_option
def try_formula(formula: str, vessel: str, name: str, uri: str, as_json: bool) -> None:
    """Try a formula of your own, such as 'yaw: r*abs(r)': what it would explain, and whether it holds.

    Beside the vessel's current model; nothing is stored.
    """
    from kempf.flows.jobs.diagnose.try_formula import formula_of_ones_own, tried
    from kempf.flows.jobs.state.out_of_date import said_of_vessel
    from kempf.warehouse.storage.store import Warehouse

    formula_of_ones_own(name, formula)
    warehouse = Warehouse(uri)
    with progress_bar() as progress:
        document = tried(warehouse, vessel, formula, name, progress)
    print_note(said_of_vessel(warehouse, vessel))
    if as_json:
        print_json(document)
        return
    _print_candidate(document)


def _print_candidate(document: Mapping[str, Any]) -> None:
    (candidate,) = document["candidates"]
    click.echo(click.style(f"{document['formula']} on {document['vessel']}", bold=True))
    click.echo(f"  score {number(candidate['score'])}, p = {number(candidate['p_adjusted'], 2)}")
    click.echo(f"  absorbed by the model as it is: {number(candidate['absorption'])}")
    for refit in refits(document):
        for parameter, value in refit["parameters"].items():
            shown = f"  {parameter} = {number(value['value'])} ± {number(value['std'], 2)} {value['unit']}"
            click.echo(shown.rstrip())
        better = f", {refit['better']} of {refit['of']} manoeuvres better" if refit["of"] else ""
        click.echo(f"  refitted: BIC {number(refit['bic_change'], 3)}{better}")
    kept = bool(document["sets"])
    if document["immaterial"]:
        click.echo(f"  it holds, but is immaterial: {candidate['why']}")
    else:
        click.echo("  it holds" if kept else f"  it does not hold: {_why(document, candidate)}")


def _why(document: Mapping[str, Any], candidate: Mapping[str, Any]) -> str:
    refused = document["refused"] and candidate["verdict"] != "suspected"
    return str(document["refused"][-1]["why"] if refused else candidate["why"])


@click.command("add", cls=GivenOnce)
@click.argument("name")
@vessel_option(required=True)
@click.option("--formula", help="The effect is your own: its formula.")
@click.option("--file", "path", type=click.Path(path_type=Path), help="The effect is your own: its YAML file.")
@click.option(
    "--model", type=click.Path(path_type=Path), help="Add it to the model of this file, not to the current one."
)
@click.option("--force", is_flag=True, help="Add it though it makes predictions worse.")
@verbose_option
@warehouse_option
@json_option
def add(
    name: str,
    vessel: str,
    formula: str | None,
    path: Path | None,
    model: Path | None,
    force: bool,
    verbose: bool,
    uri: str,
    as_json: bool,
) -> None:
    """Add an effect to a vessel's current model, refit, and show the error before and after.

    An effect that makes predictions worse beyond their error is fitted and stored, but becomes the current model only
    with --force.
    """
    from kempf.flows.jobs.diagnose.add_effect import add_effect
    from kempf.flows.jobs.identify.standing_model import Own, rungs_to
    from kempf.warehouse.storage.store import Warehouse
    from kempf.workbench.chosen_model import chosen_model, read_effect_files

    if formula is not None and path is not None:
        raise UsageError("two_effects", "Both --formula and --file say what the effect is.", "Give one of them.")
    mine = Own({name: (formula,)} if formula is not None else {}, read_effect_files([path]) if path is not None else {})
    if path is not None and name not in mine.files:
        raise UsageError(
            "effect_name", f"{path} holds the effect {next(iter(mine.files))!r}, not {name!r}.", "Name it as it is."
        )
    warehouse = Warehouse(uri)
    begin = chosen_model(warehouse, vessel, None, model, mine)
    with progress_bar() as progress:
        parameter_set = add_effect(warehouse, vessel, name, mine, progress, begin=begin, force=force)
    rungs = rungs_to(warehouse, parameter_set)
    if as_json:
        print_json(
            {"vessel": vessel, "added": name, "before": rungs[-2], "after": rungs[-1], "set": parameter_set.as_json()}
        )
        return
    print_rungs(rungs[-2:], vessel)
    _print_runs(rungs[-2], rungs[-1])
    show_warnings(parameter_set.warnings, verbose=verbose)
    click.echo(f"next: kempf ladder --vessel {vessel}, kempf effects undo --vessel {vessel}")


def _print_runs(before: Mapping[str, Any], after: Mapping[str, Any]) -> None:
    """Print the free-run errors manoeuvre by manoeuvre, before and after, fitted and held out apart."""
    if compared([before, after])[-1].by_legs:
        _print_legs(before, after)
        return
    units = {name: channel.shown for name, channel in MOTION.items()}
    rows = []
    for sample, key in (("fitted", "in_sample"), ("held out", "held_out")):
        for name, rms in before[key].items():
            then = after[key].get(name)
            if then is None:
                continue
            cells = []
            for channel, (_, factor) in units.items():
                cells += [number(_scaled(rms[channel], factor), 3), number(_scaled(then[channel], factor), 3)]
            rows.append([name, sample, *cells])
    head = ["manoeuvre", "sample"]
    for channel, (unit, _) in units.items():
        head += [f"{channel}, {unit}", "after"]
    print_table(head, rows, "Free-run rms, before and after")


def _print_legs(before: Mapping[str, Any], after: Mapping[str, Any]) -> None:
    """Print the errors a leg ahead and of free runs, all by the parameters fitted to legs, manoeuvre by manoeuvre."""
    free = by_manoeuvre(before), by_manoeuvre(after)
    rows = []
    for sample, key, leg in (("fitted", "in_sample", "left_out_percent"), ("held out", "held_out", "held_out_percent")):
        legs = [(rung.get("one_leg_ahead") or {}).get(leg) or {} for rung in (before, after)]
        for name in before[key]:
            if name in after[key]:
                # null where it diverges, missing of a manoeuvre that came later
                ahead = [nan if errors.get(name, 0.0) is None else errors.get(name) for errors in legs]
                rows.append([name, sample, *(in_words(error) for error in (*ahead, *(f.get(name) for f in free)))])
    head = ["manoeuvre", "sample", "leg", "after", "free run", "after"]
    title = "Error, % of the motion, before and after; one leg ahead, fitted manoeuvres are predicted from the others"
    print_table(head, rows, title)


def _scaled(value: float | None, factor: float) -> float | None:
    return None if value is None else value * factor


@click.command("undo", cls=GivenOnce)
@vessel_option(required=True)
@warehouse_option
@json_option
def undo(vessel: str, uri: str, as_json: bool) -> None:
    """Go back to the model before the last effect was added; nothing is deleted."""
    from kempf.flows.jobs.identify.standing_model import undo as go_back
    from kempf.warehouse.storage.store import Warehouse

    now = go_back(Warehouse(uri), vessel)
    if as_json:
        print_json(now.as_json())
    else:
        click.echo(f"{vessel}: the current model is {now.model_name} again, {now.parameter_set_id}")
