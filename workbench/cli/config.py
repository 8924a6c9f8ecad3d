"""``kempf config``: the settings in force, and what sets each."""

from __future__ import annotations

import click

from kempf.workbench.cli.given_once import GivenOnce
from kempf.workbench.cli.options import json_option
from kempf.workbench.terminal import print_json, print_table


@click.command("config", cls=GivenOnce)
@json_option
def command(as_json: bool) -> None:
    """Show every setting, its value and what sets it.

    An option of a command goes before an environment variable, a variable before the file kempf.toml: the one that
    KEMPF_CONFIG names, else ./kempf.toml, else kempf/kempf.toml in XDG_CONFIG_HOME (~/.config).
    """
    from kempf.flows.process.configuration import every
    from kempf.schemas.settings import VARIABLES

    settings = every()
    if as_json:
        print_json([setting.as_json() for setting in settings])
        return
    rows = [
        [setting.name, setting.value or "-", setting.source or "-", VARIABLES[setting.name]] for setting in settings
    ]
    print_table(["setting", "value", "set by", "variable"], rows)
