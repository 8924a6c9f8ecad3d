"""What the commands cost that only show something, and every ``--help``: processor time of the process, on the demo.

Wanted: 1 s beyond the imports of what reads a table (polars, pyarrow, deltalake, pydantic), which are on the page too.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from benchmarks.result_page import table, write
from kempf.workbench.cli.entry import COMMANDS

WANTED_S = 1.0
TABLES = "import polars, pyarrow, deltalake, pydantic"
VESSEL, EFFECT = "mariner", "rudder_lag"
_START = "from kempf.workbench.cli import main; main()"


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=3, help="runs of each command, after one that is not counted")
    parser.add_argument("--warehouse", type=Path, help="that of a demo with a model, instead of one made for this")
    options = parser.parse_args(arguments)
    with TemporaryDirectory() as name:
        warehouse = options.warehouse or _demo(Path(name))
        lines = measure(warehouse, options.times)
    path = write("fleet.command_speed", "What it costs to show something", lines)
    print(path.read_text(encoding="utf-8"))


def _demo(folder: Path) -> Path:
    """Return the warehouse of a demo whose ship has a model with an effect."""
    warehouse = folder / "demo" / "warehouse"
    _run(warehouse, "demo", "--folder", str(folder / "demo"))
    _run(warehouse, "effects", "add", EFFECT, "--vessel", VESSEL)
    return warehouse


def measure(warehouse: Path, times: int) -> list[str]:
    """Return the lines of the page."""
    first = str(json.loads(_run(warehouse, "params", "list", "--json"))[0]["parameter_set_id"])
    of = ("--vessel", VESSEL)
    shown = (
        ("params", "list"),
        ("params", "show", first),
        ("history", *of),
        ("segments",),
        ("logs", "list"),
        ("ladder", *of),
        ("effects", "list"),
        ("effects", "show", EFFECT),
        ("effects", "undo", *of),
        ("effects", "add", EFFECT, *of),  # what was undone, stored already
    )
    taken: dict[str, list[float]] = {}
    for _ in range(times + 1):  # in turn, because undo and add belong together
        for words in shown:
            named = " ".join("ID" if word == first else word for word in words)
            taken.setdefault(named, []).append(_seconds(warehouse, _command(*words)))
        for name in COMMANDS:
            taken.setdefault(f"{name} --help", []).append(_seconds(warehouse, _command(name, "--help")))
        taken.setdefault(TABLES, []).append(_seconds(warehouse, [sys.executable, "-c", TABLES]))
    seconds = {name: median(values[1:]) for name, values in taken.items()}
    imports = seconds.pop(TABLES)
    most = max(seconds, key=lambda name: seconds[name])
    rows = [[f"`kempf {name}`", f"{value:.2f}"] for name, value in seconds.items()]
    return [
        f"User and system time of the process, s, median of {times}, after one run that fills the caches of bytecode. "
        f"The imports of what reads a table take {imports:.2f} s of it (`{TABLES}`).",
        "",
        f"Most: `kempf {most}`, {seconds[most]:.2f} s, {max(0.0, seconds[most] - imports):.2f} s beyond these imports "
        f"(wanted: at most {WANTED_S:g} s).",
        "",
        *table(["command", "processor, s"], rows),
    ]


def _command(*words: str) -> list[str]:
    return [sys.executable, "-c", _START, *words]


def _run(warehouse: Path, *words: str) -> str:
    done = subprocess.run(_command(*words), env=_environment(warehouse), check=True, capture_output=True, text=True)
    return done.stdout


def _seconds(warehouse: Path, command: Sequence[str]) -> float:
    """Return the processor time of one process, s."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, env=_environment(warehouse), check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def _environment(warehouse: Path) -> dict[str, str]:
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    return {**kept, "KEMPF_WAREHOUSE": str(warehouse)}


if __name__ == "__main__":
    main()
