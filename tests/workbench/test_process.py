"""The command as a process: what it loads, what it writes where, terminals, pipes and interruption."""

from __future__ import annotations

import os
import pty
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from kempf.schemas.tables import TABLES
from tests.workbench.driving import command, environment, kempf, process, refused, tree

HEAVY = {"polars", "numba", "prefect", "deltalake", "numpy", "pydantic", "scipy", "pyarrow", "yaml", "rich"}


def loaded_by(*arguments: object, **changes: str) -> set[str]:
    """Which libraries a command has loaded when it leaves."""
    tell = (
        "import atexit, sys\n"
        "names = lambda: ' '.join({m.partition('.')[0] for m in sys.modules})\n"
        "atexit.register(lambda: sys.stderr.write('\\nLOADED ' + names()))\n"
        "from kempf.workbench.cli import main\n"
        "main()\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", tell, *map(str, arguments)],
        capture_output=True,
        text=True,
        env=environment(**changes),
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return set(done.stderr.rpartition("LOADED ")[2].split())


@pytest.mark.parametrize("arguments", [("--help",), ("--version",), ("completion", "bash")])
def test_help_is_instant_because_it_loads_nothing_heavy(arguments: tuple[str, ...]):
    assert loaded_by(*arguments) & HEAVY == set()


@pytest.mark.parametrize(
    "arguments",
    [
        ("reprocess", "--vessel", "mariner"),
        ("identify", "--vessel", "mariner"),
        ("segments",),
        ("history", "--vessel", "mariner"),
    ],
)
def test_one_vessel_needs_no_prefect(own: Path, arguments: tuple[str, ...]):
    loaded = loaded_by(*arguments, "--warehouse", own)
    assert "polars" in loaded
    assert "prefect" not in loaded


def test_in_a_process_of_its_own_stdout_holds_the_one_document(filled: Path):
    output = process("segments", "--json", "--warehouse", filled)
    assert (output.code, output.err) == (0, "")
    assert output.json == kempf("segments", "--json", "--warehouse", filled).json
    refused(process("segments", "--vessel", "nobody", "--json", "--warehouse", filled), 4, "no_vessel")
    human = process("segments", "--vessel", "nobody", "--warehouse", filled)
    assert (human.code, human.out) == (4, "")


def test_no_escapes_off_a_terminal(filled: Path, logs: Path, tmp_path: Path):
    for arguments in (
        ("params", "list", "--warehouse", filled),
        (
            "ingest",
            logs / "mariner.mcap",
            logs / "none",
            "--profile",
            logs / "profile.yaml",
            "--warehouse",
            tmp_path / "w",
        ),
    ):
        output = process(*arguments)
        assert "\x1b" not in output.out + output.err
        assert output.out + output.err


def on_a_terminal(*arguments: object, **changes: str) -> str:
    """What a command writes to a terminal."""
    ours, theirs = pty.openpty()
    running = subprocess.Popen(
        command(*arguments), stdin=theirs, stdout=theirs, stderr=theirs, env=environment(TERM="xterm", **changes)
    )
    os.close(theirs)
    written = b""
    while True:
        try:
            piece = os.read(ours, 65536)
        except OSError:  # the other side has closed
            break
        if not piece:
            break
        written += piece
    os.close(ours)
    running.wait(timeout=60)
    return written.decode()


def test_colour_on_a_terminal_unless_it_is_refused(filled: Path):
    wrong = ("segments", "--vessel", "nobody", "--warehouse", filled)
    assert "\x1b[31m" in on_a_terminal(*wrong)
    assert "\x1b" not in on_a_terminal(*wrong, NO_COLOR="1")
    table = ("params", "list", "--warehouse", filled)
    assert "\x1b[4m" in on_a_terminal(*table)
    assert "\x1b" not in on_a_terminal(*table, NO_COLOR="1")


def test_a_reader_that_has_seen_enough_is_no_error(filled: Path):
    running = subprocess.Popen(
        command("history", "--vessel", "mariner", "--json", "--warehouse", filled),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=environment(),
    )
    assert running.stdout is not None and running.stderr is not None
    running.stdout.close()  # before anything is written
    stated = running.stderr.read().decode()
    running.stderr.close()
    assert (running.wait(timeout=60), stated) == (0, "")


def test_letters_that_the_terminal_cannot_write_are_written_out(filled: Path):
    wrong = ("segments", "--vessel", "Ærø", "--warehouse", filled)
    output = process(*wrong, "--json", PYTHONIOENCODING="ascii")
    assert "Ærø" in refused(output, 4, "no_vessel")["message"]
    assert process(*wrong, PYTHONIOENCODING="ascii").code == 4


@pytest.mark.skipif(os.name != "posix", reason="file names of any bytes are a thing of POSIX")
def test_a_file_name_that_is_no_text(logs: Path, tmp_path: Path):
    name = os.fsencode(tmp_path) + b"/\xff\x1b[31m\n.csv.gz"
    Path(os.fsdecode(name)).write_bytes((logs / "mariner.csv.gz").read_bytes())
    asked = ("--profile", logs / "profile.yaml", "--warehouse", tmp_path / "w")
    output = process("ingest", name, *asked, "--json")
    assert output.code == 0, output.err
    assert [one["outcome"] for one in output.json] == ["new"]
    human = process("ingest", name, *asked)
    assert human.code == 0 and "\x1b" not in human.out
    assert process("logs", "list", "--warehouse", tmp_path / "w").out.count("\n") == 2
    (segment,) = process("segments", "--warehouse", tmp_path / "w", "--json").json
    assert segment["log"].endswith(".csv.gz")


def test_interrupted_by_a_person(logs: Path, tmp_path: Path):
    # thirty readings of the log under other names: long enough to be interrupted
    many = []
    for k in range(30):
        many.append(tmp_path / f"{k}.mcap")
        many[-1].write_bytes((logs / "mariner.mcap").read_bytes() + bytes([k]))
    store = tmp_path / "w"
    running = subprocess.Popen(
        command("ingest", *many, "--profile", logs / "profile.yaml", "--warehouse", store),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=environment(),
    )
    until = time.monotonic() + 60
    while not (store / "logs").is_dir() and running.poll() is None and time.monotonic() < until:
        time.sleep(0.02)
    running.send_signal(signal.SIGINT)
    out, err = running.communicate(timeout=60)
    assert running.returncode == 130, (out, err)
    assert b"Interrupted. What was finished is kept" in err
    assert b"Traceback" not in err
    kept = kempf("logs", "list", "--warehouse", store, "--json").json
    assert len(kept) < 30
    assert len(kempf("segments", "--warehouse", store, "--json").json) == len(kept)
    assert all(
        name.split("/")[0] in {"kempf-warehouse.json", "written", *TABLES, "raw"} - {"parameter_sets", "aliases"}
        for name in tree(store)
    )
