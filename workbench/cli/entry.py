"""Where the command line begins, and where every error becomes one message and an exit code."""

from __future__ import annotations

import _thread
import contextlib
import json
import os
import signal
import sys
import threading
import traceback
from collections.abc import Sequence
from io import TextIOWrapper
from typing import get_args

import click

from kempf.flows.process import configuration
from kempf.flows.process.wrap_error import wrapped
from kempf.schemas.errors import KempfError, UsageError
from kempf.schemas.settings import LogLevel
from kempf.workbench import log_lines
from kempf.workbench.cli.lazy import LazyGroup
from kempf.workbench.terminal import one_line

#: Exit codes of a command that a person interrupted, and of one that was asked to end, as shells have them.
INTERRUPTED, TERMINATED = 130, 143

COMMANDS = {
    "ingest": "Take raw logs in: read, check, keep, find the manoeuvres.",
    "inbox": "Ingest what is new in a folder or bucket, one folder a vessel.",
    "doctor": "Find channels that contradict each other, and the profile line that corrects them.",
    "segments": "List the manoeuvres found; correct, exclude, accept and add them.",
    "note": "Write a note on a vessel, log, manoeuvre or parameter set; list the notes.",
    "identify": "Identify a model from every manoeuvre of a vessel.",
    "params": "List, show, compare and export parameter sets; what they say of her steering.",
    "history": "Show a vessel's parameters over time, as known now or at an earlier time.",
    "workbench": "Serve the warehouse as web pages.",
    "report": "Write one HTML file to send that says what a vessel's model lacks.",
    "export": "Write a parameter set, or manoeuvres with their predictions, as a file for other programs.",
    "predict": "Predict turning circle, zigzag, pull-out or spiral, every figure with its interval.",
    "steer": "Make a course-keeping law from a parameter set and try it on the simulated ship.",
    "compare": "Put what was measured beside what a parameter set predicts; say where it fails.",
    "explain": "Rank the effects by what they would explain of one stretch of a manoeuvre.",
    "what-if": "Move one parameter of a set: what a free run does, and what it costs in likelihood.",
    "next-trial": "Say which zigzag to sail next, to part models that fit alike or to narrow intervals.",
    "effects": "List and show the physical effects that a model can be given.",
    "diagnose": "Find which physical effect a vessel's model lacks.",
    "ladder": "Show how the error fell from model to model.",
    "rerun": "Build parameter sets again from the raw bytes: are they the same, what would this code change?",
    "reprocess": "Bring the whole fleet up to date with its profiles and the code.",
    "compact": "Put the many small files of the tables into few; delete what nothing refers to.",
    "purge": "Delete a log for good that must not be kept, with a receipt.",
    "verify": "Check raw logs and tables: is everything there and as it was written?",
    "repair": "Make again what is damaged, from sealed copies and from the raw logs.",
    "migrate": "Bring a warehouse of an earlier version of kempf forward.",
    "vessels": "List vessels, show and set their profiles, rename and remove them.",
    "profile": "Draft the profile of a log that does not describe itself.",
    "logs": "List the logs, what was rejected in one and why; remove, move, release from quarantine.",
    "demo": "Simulate a trial, ingest it, identify the ship and compare with the truth.",
    "reproduce-paper": "Repeat the paper's experiment: its figures, its accuracy beside ours.",
    "config": "Show the settings in force, and what sets each.",
    "completion": "Print the shell completion script.",
}


@click.group(
    cls=LazyGroup,
    summaries=COMMANDS,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
)
@click.version_option(package_name="kempf", prog_name="kempf")
@click.option(
    "--log-level",
    type=click.Choice(get_args(LogLevel)),
    help="Say on stderr what a command does, from this level on. [default: KEMPF_LOG_LEVEL, else of kempf.toml]",
)
def cli(log_level: str | None) -> None:
    """Turn raw ship sea-trial logs into manoeuvring models one can trust.

    Every command that works on a warehouse takes --warehouse URI (else KEMPF_WAREHOUSE, else that of kempf.toml, else
    ./kempf-data) and --json.
    Exit codes: 0 ok, 1 internal, 2 usage, 3 data rejected, 4 not found, 5 threshold exceeded.
    """
    level = log_level or configuration.log_level()
    if level is not None:
        log_lines.show(level)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and leave with its exit code.

    Parameters
    ----------
    arguments : sequence of str, optional
        Instead of those of the process.
    """
    sys.unraisablehook = _unraisable
    given = list(sys.argv[1:] if arguments is None else arguments)
    as_json = "--json" in given
    stdout = sys.stdout
    for stream in (stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):  # a file name may hold bytes that are no letters
            stream.reconfigure(errors="backslashreplace")
    asked_to_end: list[int] = []
    _end_when_asked(asked_to_end)
    try:
        code = cli.main(args=given, prog_name="kempf", standalone_mode=False, color=_color())
    except click.ClickException as error:
        code = _print_usage_error(error, as_json)
    except (click.Abort, KeyboardInterrupt):
        click.echo("Interrupted. What was finished is kept, nothing is half in; the same command goes on.", err=True)
        code = TERMINATED if asked_to_end else INTERRUPTED
    except SystemExit:
        if sys.stdout is stdout:
            raise
        # click has put something else in its place: the reader of our output has seen enough
        code = 0
    except Exception as error:  # noqa: BLE001 - the last place where it can be reported
        code = _print_error(wrapped(error), as_json)
    sys.exit(code if isinstance(code, int) else 0)


def _end_when_asked(received: list[int]) -> None:
    """Let SIGTERM, which a shutdown or a scheduler sends, end a command as Ctrl-C does; note that it came."""

    def end(number: int, frame: object) -> None:
        received.append(number)
        raise KeyboardInterrupt

    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGTERM, end)


def _unraisable(unraisable: sys.UnraisableHookArgs) -> None:
    """Deliver an interruption again that came where Python can only drop it, as in the callback of a weak reference.

    From a thread and a moment later: sent from here, it would come inside this very function, and be dropped again.
    """
    if isinstance(unraisable.exc_value, KeyboardInterrupt):
        again = threading.Timer(0.02, _thread.interrupt_main)
        again.daemon = True
        with contextlib.suppress(RuntimeError):  # at the interpreter's end no thread starts: it is leaving anyway
            again.start()
    else:
        sys.__unraisablehook__(unraisable)


def _color() -> bool | None:
    """Return False where https://no-color.org asks for none, else None: colour on a terminal alone."""
    return False if os.environ.get("NO_COLOR") else None


def _print_usage_error(error: click.ClickException, as_json: bool) -> int:
    context = error.ctx if isinstance(error, click.UsageError) else None
    step = f"See `{context.command_path if context else 'kempf'} --help`."
    if type(error).__name__ == "NoArgsIsHelpError" and not as_json:  # the message is the whole help page
        click.echo(error.format_message(), err=True)
        return UsageError.exit_code
    return _print_error(UsageError("usage", error.format_message(), step), as_json)


def _print_error(error: KempfError, as_json: bool) -> int:
    if error.code == "internal":
        traceback.print_exception(error)
    if as_json:
        click.echo(json.dumps(error.as_json(), indent=2, default=str))
    else:
        named = f"{click.style('error', fg='red', bold=True)} [{error.code}]"
        click.echo(
            f"{named} {one_line(error.message)[:2000]}\n  {one_line(error.next_step)[:2000]}", err=True, color=_color()
        )
    return error.exit_code
