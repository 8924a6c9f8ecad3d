"""Where the command line begins, and where every error becomes one message and an exit code."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Sequence

import click

from schemas.errors import KempfError, UsageError
from workbench.cli.lazy import LazyGroup

#: Exit code of a command that a person interrupted, as shells have it.
INTERRUPTED = 130

COMMANDS = {
    "ingest": "Take raw logs in: read, check, keep, find the zigzags.",
    "segments": "List the zigzags found.",
    "identify": "Identify a model from every zigzag of a vessel.",
    "params": "List, show, compare and export parameter sets.",
    "history": "Show a vessel's parameters over time, as known now or at an earlier time.",
    "rerun": "Build a parameter set again from the raw bytes and compare every bit.",
    "reprocess": "Bring the whole fleet up to date with its profiles and the code.",
    "vessels": "List vessels, show and set their profiles.",
    "logs": "List the logs, show what was rejected in one and why.",
    "demo": "Simulate a trial, ingest it, identify the ship and compare with the truth.",
    "completion": "Print the shell completion script.",
}


@click.group(
    cls=LazyGroup,
    summaries=COMMANDS,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
)
@click.version_option(package_name="kempf", prog_name="kempf")
def cli() -> None:
    """Turn raw ship sea-trial logs into manoeuvring models one can trust.

    Every command takes --warehouse URI (else KEMPF_WAREHOUSE, else ./kempf-data) and --json. Exit codes: 0 ok,
    1 internal error, 2 usage, 3 data rejected, 4 not found, 5 threshold exceeded.
    """


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and leave with its exit code.

    Parameters
    ----------
    arguments : sequence of str, optional
        Instead of those of the process.
    """
    given = list(sys.argv[1:] if arguments is None else arguments)
    as_json = "--json" in given
    try:
        code = cli.main(args=given, prog_name="kempf", standalone_mode=False)
    except KempfError as error:
        code = _tell(error, as_json)
    except click.Abort:
        code = INTERRUPTED
    except click.ClickException as error:
        step = "See `kempf --help`."
        if isinstance(error, click.UsageError) and error.ctx is not None:
            step = f"See `{error.ctx.command_path} --help`."
        code = _tell(UsageError("usage", error.format_message(), step), as_json)
    except KeyboardInterrupt:
        click.echo("Interrupted. What was finished is kept, nothing is half in; the same command goes on.", err=True)
        code = INTERRUPTED
    except BrokenPipeError:  # the reader of our output has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 0
    sys.exit(code if isinstance(code, int) else 0)


def _tell(error: KempfError, as_json: bool) -> int:
    if as_json:
        click.echo(json.dumps(error.to_json(), indent=2, default=str))
    else:
        click.echo(f"{click.style('error', fg='red', bold=True)} [{error.code}] {error.message}", err=True)
        click.echo(f"  {error.next_step}", err=True)
    return error.exit_code
