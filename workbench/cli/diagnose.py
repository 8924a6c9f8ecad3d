"""``kempf diagnose``."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from kempf.schemas.enumeration import as_words, counted
from kempf.workbench.cli.given_once import GivenOnce
from kempf.workbench.cli.ladder import FREE, LEG, percents, print_by_legs
from kempf.workbench.cli.options import beginning_options, json_option, vessel_option, warehouse_option
from kempf.workbench.effect_verdicts import effect_verdict
from kempf.workbench.numbers import number, percent
from kempf.workbench.rungs import compared, first_model
from kempf.workbench.terminal import print_json, print_table, progress_bar

if TYPE_CHECKING:
    from kempf.warehouse.storage.store import Warehouse

_SHOWN = 12


@click.command("diagnose", cls=GivenOnce)
@vessel_option()
@click.option("--fleet", is_flag=True, help="Every vessel of the warehouse, as a Prefect flow, and a summary.")
@beginning_options
@click.option("--all", "everything", is_flag=True, help="Also the effects that were not seen or cannot be tested.")
@warehouse_option
@json_option
def command(
    vessel: str | None,
    fleet: bool,
    set_id: str | None,
    model: Path | None,
    files: tuple[Path, ...],
    everything: bool,
    uri: str,
    as_json: bool,
) -> None:
    """Find which physical effect a vessel's model lacks, and say how sure that is.

    About three in ten manoeuvres are held out before anything is looked at. Every effect of the catalogue is screened,
    what looks present is refitted and must predict manoeuvres that it was not fitted to; what these data cannot
    distinguish is named together.
    """
    if fleet == (vessel is not None):
        raise click.UsageError("Say whose model: --vessel NAME, or --fleet for all.")
    if vessel is None:
        if set_id is not None or model is not None or files:
            raise click.UsageError("--set, --model and --effect-file need a --vessel; --fleet begins plain.")
        _fleet(uri, as_json=as_json)
        return
    from kempf.flows.jobs.diagnose.diagnose_vessel import diagnose_vessel
    from kempf.flows.jobs.identify.standing_model import Own
    from kempf.warehouse.storage.store import Warehouse
    from kempf.workbench.chosen_model import chosen_model, read_effect_files

    warehouse = Warehouse(uri)
    mine = Own(files=read_effect_files(files))
    spec, own = chosen_model(warehouse, vessel, set_id, model, mine)
    own = own.beside(mine)
    with progress_bar() as progress:
        diagnosis, _ = diagnose_vessel(warehouse, vessel, spec, own, progress=progress)
    if as_json:
        print_json(diagnosis.as_json())
        return
    document = diagnosis.as_json()
    _print_diagnosis(document, everything=everything)
    _print_at_hand(warehouse, document)
    if document["sets"]:
        click.echo(f"next: {', '.join(next_commands(document))}")


def _print_at_hand(warehouse: Warehouse, document: Mapping[str, Any]) -> None:
    """Say which manoeuvres that were kept for validation are there to hold models against that fit alike."""
    from kempf.warehouse.tables import segments

    if not any(len(group["effects"]) > 1 for group in document["sets"]):
        return
    kept = Counter(segment.kind for segment in segments.every(warehouse, document["vessel"]))
    for kind, words in (("turning_circle", "turning circle"), ("pull_out", "pull-out"), ("spiral", "spiral")):
        if kept[kind]:
            click.echo(
                f"at hand, to hold models that fit alike against: {counted(kept[kind], words)} "
                f"(kempf predict {words.replace(' ', '-')} --compare --vessel {document['vessel']})"
            )


def _fleet(uri: str, *, as_json: bool) -> None:
    from kempf.flows.fleet.flows import diagnose

    rows = diagnose(uri)
    if as_json:
        print_json(rows)
        return
    table = [
        [
            row["vessel"],
            as_words(row["verdict"]),
            row["effects"] or "-",
            row["since"][:19] or "-",
            percent(row["held_out_before"]),
            percent(row["held_out_after"]),
            row["note"],
        ]
        for row in rows
    ]
    head = ["vessel", "verdict", "lacks", "since UTC", "held out, %", "after", "note"]
    print_table(head, table, "What the models of the fleet lack")


def _print_diagnosis(document: Mapping[str, Any], *, everything: bool) -> None:
    title = f"{document['vessel']}: {as_words(document['verdict'])}"
    click.echo(click.style(title, bold=True) + f"  ({document['diagnosis_id']})")
    for sentence in document["sentences"]:
        click.echo(f"  {sentence}")
    first = first_model(document["ladder"][0])
    beside = compared(document["ladder"])
    ladder = [
        [
            str(rung["step"]),
            rung["added"] or first,
            *percents(errors),
            number(rung["disturbance_intensity"]["wind_force_m_s2_per_sqrt_s"], 2),
        ]
        for rung, errors in zip(document["ladder"], beside, strict=True)
    ]
    print_table(["step", "added", *LEG, *FREE, "wind, m/s^2/s^0.5"], ladder, "Error one leg ahead and of free runs, %")
    print_by_legs(beside)
    shown = [
        candidate
        for candidate in document["candidates"]
        if everything
        or candidate["verdict"] in ("present", "immaterial", "negligible")
        or candidate["score"] is not None
    ]
    if not everything:
        # what is claimed, and then what scores highest
        claimed = [one for one in shown if one["verdict"] in ("present", "immaterial")]
        others = [one for one in shown if one not in claimed][: max(_SHOWN - len(claimed), 0)]
        shown = [one for one in shown if one in claimed or one in others]
    rows = [
        [
            candidate["effect"],
            candidate["set_id"] or "-",
            number(candidate["score"], 3),
            _change(candidate["expected_change"]),
            number(candidate["absorption"], 3),
            effect_verdict(candidate, document["verdict"]),
        ]
        for candidate in shown
    ]
    head = ["effect", "set", "score", "expected change, ± 1 s.e.", "absorbed", "verdict"]
    print_table(head, rows, f"Screened beside the {first}, by score")
    reasons: dict[str, list[str]] = {}
    for candidate in shown:
        reasons.setdefault(candidate["why"], []).append(candidate["effect"])
    for why, effects in reasons.items():
        click.echo(f"  {', '.join(effects)}: {why}")
    if not everything and len(document["candidates"]) > _SHOWN:
        click.echo(f"  of {len(document['candidates'])} effects; --all shows every one, also what cannot be tested")


def next_commands(document: Mapping[str, Any]) -> list[str]:
    """Return the commands that add what a diagnosis names: of every set the first effect, in the order of its ladder.

    All of them, as of effects that belong together one alone may make predictions worse.
    """
    vessel = document["vessel"]
    adds = [f"kempf effects add {group['effects'][0]} --vessel {vessel}" for group in document["sets"]]
    return [*adds, f"kempf ladder --vessel {vessel}"]


def _change(change: Mapping[str, Mapping[str, Any]]) -> str:
    sizes = [
        f"{n} {number(c['value'], 3)} ± {number(c['std'], 2)} {c['unit'].removesuffix('1')}".rstrip()
        for n, c in change.items()
    ]
    return ", ".join(sizes)
