"""``kempf profile draft``."""

from __future__ import annotations

from pathlib import Path

import click

from kempf.workbench.cli.given_once import GivenOnceGroup
from kempf.workbench.cli.options import json_option, output_option
from kempf.workbench.terminal import print_json


@click.group("profile", cls=GivenOnceGroup)
def command() -> None:
    """Write the profile of a vessel."""


@command.command("draft")
@click.argument("log", type=click.Path(path_type=Path))
@output_option()
@json_option
def draft(log: Path, output: Path | None, as_json: bool) -> None:
    """Draft a profile from the columns or topics of a log: guessed channels and units are marked with a ?.

    Look at every line that has a ?, correct it and delete the ?; a profile with one left is refused.
    """
    from kempf.flows.jobs.ingest.draft_profile import draft as drafted
    from kempf.workbench.new_file import write_new

    text = drafted(log)
    if output is not None:
        write_new(output, text)
    if as_json:
        print_json({"log": str(log), "output": str(output) if output else None, "profile": text})
    elif output is None:
        click.echo(text, nl=False)
    else:
        click.echo(f"{output}: complete the lines with a ?, then kempf ingest {log} --profile {output}", err=True)
