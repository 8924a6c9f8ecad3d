"""``kempf vessels list|show|set|rename|remove``."""

from __future__ import annotations

from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

import click

from kempf.schemas.enumeration import counted
from kempf.workbench.cli.confirm import confirm, reason_option, what_goes, yes_option
from kempf.workbench.cli.given_once import GivenOnceGroup
from kempf.workbench.cli.options import json_option, profile_option, warehouse_option
from kempf.workbench.numbers import number
from kempf.workbench.terminal import print_json, print_table

if TYPE_CHECKING:
    from kempf.warehouse.storage.store import Warehouse


@click.group("vessels", cls=GivenOnceGroup)
def command() -> None:
    """List vessels, show and set their profiles, rename and remove them."""


@command.command("list")
@warehouse_option
@json_option
def list_vessels(uri: str, as_json: bool) -> None:
    """List the vessels with their logs, manoeuvres and parameter sets."""
    from kempf.warehouse.queries.vessel_counts import vessel_counts
    from kempf.warehouse.storage.store import Warehouse

    listed = vessel_counts(Warehouse(uri))
    if as_json:
        print_json(listed)
        return
    print_table(
        ["vessel", "logs", "manoeuvres to fit", "parameter sets"], [[str(v) for v in row.values()] for row in listed]
    )


@command.command("show")
@click.argument("name")
@warehouse_option
@json_option
def show(name: str, uri: str, as_json: bool) -> None:
    """Show a vessel's current profile, how often it changed, and which folders of the tables are hers."""
    import yaml

    from kempf.warehouse.storage.store import Warehouse
    from kempf.workbench.documents.vessel import vessel_document

    shown = vessel_document(Warehouse(uri), name)
    if as_json:
        print_json(shown)
        return
    click.echo(yaml.safe_dump(shown["profile"], sort_keys=False, allow_unicode=True), nl=False)
    versions = shown["versions"]
    click.echo(f"# version {number(len(versions))} of the profile, {versions[-1]}")
    click.echo(f"# her rows are in the folders {shown['partition']} of the tables")


@command.command("set")
@click.argument("name")
@profile_option
@warehouse_option
@json_option
def set_profile(name: str, profiles: tuple[Path, ...], uri: str, as_json: bool) -> None:
    """Replace the vessel's current profile by another; `kempf reprocess` then applies it to her logs."""
    from kempf.flows.jobs.ingest.register_vessel import set_vessel
    from kempf.warehouse.storage.store import Warehouse

    changed = set_vessel(Warehouse(uri), name, profiles)
    if as_json:
        print_json({"vessel": name, "changed": changed})
    else:
        click.echo(f"{name}: " + ("profile set; next: kempf reprocess" if changed else "the profile is the same"))


@command.command("remove")
@click.argument("name")
@reason_option
@yes_option
@warehouse_option
@json_option
def remove(name: str, reason: str, yes: bool, uri: str, as_json: bool) -> None:
    """Let a vessel and all her logs count no longer. Nothing is deleted; `kempf history --as-of` still knows them."""
    from kempf.flows.jobs.corrections.affected_sets import of_logs
    from kempf.flows.jobs.corrections.remove_logs import remove_vessel
    from kempf.warehouse.storage.store import Warehouse
    from kempf.warehouse.tables import logs, vessels

    warehouse = Warehouse(uri)
    vessels.require(warehouse, name)
    held = logs.current(warehouse, name)
    confirm(what_goes(of_logs(warehouse, held) if held else None, f"The vessel {name!r} is removed"), yes=yes)
    affected = remove_vessel(warehouse, name, reason)
    if as_json:
        print_json({"vessel": name, "removed": True, "following": affected.as_json() if affected else None})
        return
    back = f"`kempf vessels set {quote(name)} --profile FILE` brings her back"
    if held:
        back = (
            f"`kempf logs restore LOG` brings a log of hers back, and her with it; `kempf logs list --removed --vessel "
            f"{quote(name)}` lists them"
        )
    click.echo(f"{name}: removed, with {counted(len(held), 'log')}; {back}")


def _stays(warehouse: Warehouse, name: str) -> str:
    """Return what of a vessel's sets does not go along, a phrase."""
    from kempf.warehouse.tables import aliases, notes

    stays = sorted(aliases.of_vessel(warehouse, name).keys() - {aliases.CURRENT, aliases.WITHDRAWN})
    noted = sum(note.subject == "set" for note in notes.of_vessel(warehouse, name))
    stays += [counted(noted, "note")] * bool(noted)
    return f"; {', '.join(stays)} stay with the sets of the old name" if stays else ""


@command.command("rename")
@click.argument("name")
@click.argument("new_name")
@reason_option
@yes_option
@warehouse_option
@json_option
def rename(name: str, new_name: str, reason: str, yes: bool, uri: str, as_json: bool) -> None:
    """Give a vessel another name: her logs are read for it again, her models are identified again by `reprocess`."""
    from kempf.flows.jobs.corrections.affected_sets import of_logs
    from kempf.flows.jobs.corrections.remove_logs import rename_vessel
    from kempf.flows.jobs.state.out_of_date import command_for
    from kempf.warehouse.storage.store import Warehouse
    from kempf.warehouse.tables import logs, vessels

    warehouse = Warehouse(uri)
    vessels.require(warehouse, name)
    held = logs.current(warehouse, name)
    confirm(
        what_goes(
            of_logs(warehouse, held) if held else None,
            f"{name!r} is renamed to {new_name!r} and her logs are read again{_stays(warehouse, name)}",
        ),
        yes=yes,
    )
    rows = rename_vessel(warehouse, name, new_name, reason)
    if as_json:
        print_json({"vessel": new_name, "was": name, "logs": [row.log_id for row in rows]})
    else:
        click.echo(f"{name}: now {new_name}, {counted(len(rows), 'log')}; next: {command_for([new_name])}")
