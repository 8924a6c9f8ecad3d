"""``kempf completion``."""

from __future__ import annotations

import click
from click.shell_completion import get_completion_class

from kempf.workbench.cli.given_once import GivenOnce


@click.command("completion", cls=GivenOnce)
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
def command(shell: str) -> None:
    """Print the completion script; for bash add `eval "$(kempf completion bash)"` to ~/.bashrc."""
    from kempf.workbench.cli.entry import cli

    kind = get_completion_class(shell)
    assert kind is not None
    click.echo(kind(cli, {}, "kempf", "_KEMPF_COMPLETE").source())
