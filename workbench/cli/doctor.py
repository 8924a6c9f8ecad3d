"""``kempf doctor``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from kempf.schemas.enumeration import counted
from kempf.workbench.cli.given_once import GivenOnce
from kempf.workbench.cli.options import figure_option, json_option, profile_option, warehouse_option
from kempf.workbench.numbers import number
from kempf.workbench.terminal import one_line, print_json, print_table


@click.command("doctor", cls=GivenOnce)
@click.argument("path", metavar="PATH|LOG", type=click.Path(path_type=Path))
@profile_option
@figure_option("Draw what disagrees")
@click.option("--all", "everything", is_flag=True, help="Show every check, not only those that disagree.")
@warehouse_option
@json_option
def command(
    path: Path, profiles: tuple[Path, ...], figure: Path | None, everything: bool, uri: str, as_json: bool
) -> None:
    """Find the channels of a log that are wrong: sign, unit, frame, swap, clock, delay, mounting, standstill.

    PATH is a raw log, read with the profile; or the id or file name of a log in the warehouse. Instruments that measure
    the same motion are compared: of three, the one that disagrees is named; of two, it is one of them.
    """
    from kempf.flows.jobs.ingest.examine_log import examine_file, examine_held
    from kempf.flows.jobs.ingest.files import read_profiles
    from kempf.schemas.profile import VesselProfile
    from kempf.warehouse.storage.store import Warehouse
    from kempf.workbench.new_file import require_figures, writing

    require_figures(figure)
    if profiles or path.exists():
        examined = examine_file(path, read_profiles(profiles) if profiles else VesselProfile())
    else:
        examined = examine_held(Warehouse(uri), str(path))
    if figure is not None:
        from kempf.workbench.figures.doctor import draw

        with writing(figure):
            draw(examined, figure)
    if as_json:
        print_json({"log": examined.file_name, "format": examined.format, **examined.content})
        return
    print_examination(examined.file_name, examined.content, everything=everything)
    if figure is not None:
        click.echo(f"{figure}: drawn", err=True)


def print_examination(name: str, content: dict[str, Any], *, everything: bool) -> None:
    """Print a verdict with its evidence and the lines that correct it."""
    findings = content["findings"]
    many = f"{counted(len(findings), 'contradiction')} between its channels"
    verdict = content["verdict"]
    head = "partly tested" if verdict == "clean" and content["untested"] else verdict
    click.echo(f"{one_line(name)}: {_HEADS[head].format(many)}")
    for k, finding in enumerate(findings, start=1):
        click.echo(f"{k}. {finding['words']}")
        for outcome in finding["evidence"]:
            click.echo(f"   {outcome['check']}: {outcome['words']}")
        for fault in finding["faults"]:
            for line in fault["profile"]:
                click.echo(f"   profile: {line}")
            if not fault["profile"]:
                click.echo(f"   profile: no entry corrects it ({fault['words']}): correct it at the recorder")
    if any(fault["profile"] for finding in findings for fault in finding["faults"]):
        click.echo(_WHERE)
    if content.get("why"):
        click.echo(one_line(content["why"])[:600])
    if everything:
        _table(content)
    if not content.get("moves", True):
        click.echo("she does not move: motions are not testable")
    if content["untested"]:
        click.echo(f"cannot be tested with these channels: {', '.join(_untested(content))}")
    for words in content.get("left_out", ()):
        click.echo(words)
    for words in content.get("cannot_see", ()):
        click.echo(f"cannot be seen: {words}")


def _untested(content: dict[str, Any]) -> list[str]:
    """Return the channels that no check could test, each with the reason where there was a check."""
    why: dict[str, str] = {}
    for check in content["checks"]:
        for channel in check["channels"] if check["state"] == "untestable" else ():
            why.setdefault(channel, check["words"])
    return [f"{name} ({why[name]})" if name in why else name for name in content["untested"]]


_HEADS = {
    "clean": "the channels agree",
    "partly tested": "the channels that could be tested agree",
    "faults": "{}",
    "untested": "nothing could be tested",
    "failed": "the doctor failed",
}


#: Where a proposed line belongs.
_WHERE = (
    "a profile line belongs under `channels:`, in the entry of `sources:` that reads the log, in place of one of its "
    "name"
)


def _table(content: dict[str, Any]) -> None:
    rows = [
        [check["check"], check["state"], f["name"], number(f["value"]), number(f["std"], 2),
         f"{number(f['expected'][0])} .. {number(f['expected'][1])}", f["unit"]]
        for check in content["checks"] for f in check["figures"]
    ]  # fmt: skip
    rows += [[c["check"], c["state"], c["words"], "", "", "", ""] for c in content["checks"] if not c["figures"]]
    print_table(["check", "result", "figure", "value", "1 s.e.", "expected", "unit"], rows)
