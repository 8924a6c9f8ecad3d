"""docs/steering.md is true: its commands run, its program runs on their output, its options and names are there."""

from __future__ import annotations

import re
import runpy
import shlex
from collections.abc import Iterator
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import click
import pytest

from kempf.pipeline.steering.state_space import OUTPUTS
from kempf.workbench.cli.entry import cli
from tests.conftest import Ship
from tests.docs.console import Command, File, steps
from tests.workbench.driving import kempf, one_of

PAGE = Path(__file__).parents[2] / "docs" / "steering.md"
TEXT = PAGE.read_text(encoding="utf-8")


@pytest.fixture
def warehouse(mariner: Ship, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    logs, place = mariner.write(tmp_path / "logs"), tmp_path / "warehouse"
    assert kempf("ingest", logs / "mariner.csv.gz", "--profile", logs / "profile.yaml", "--warehouse", place).code == 0
    assert kempf("identify", "--vessel", "mariner", "--warehouse", place).code == 0
    monkeypatch.setenv("KEMPF_WAREHOUSE", str(place))
    monkeypatch.chdir(tmp_path)
    yield place


def test_commands_run_and_the_program_on_what_they_wrote(
    warehouse: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("matplotlib")
    name = one_of(warehouse, "ml")
    commands = 0
    for step in steps(TEXT):
        if isinstance(step, File):
            (tmp_path / step.name).write_text(step.content, encoding="utf-8")
            continue
        commands += 1
        program, *arguments = shlex.split(step.line)
        assert program == "kempf"
        output = kempf(*(name if argument == "ID" else argument for argument in arguments))
        assert output.code == 0, (step.line, output)
    assert commands == sum(isinstance(step, Command) for step in steps(TEXT)) >= 6
    assert {p.name for p in tmp_path.iterdir()} >= {
        "ship.py",
        "ship.mat",
        "ship.yaml",
        "ship.csv",
        "track.png",
        "use.py",
    }
    pytest.importorskip("control", reason="python-control is not installed")
    monkeypatch.syspath_prepend(str(tmp_path))
    said = StringIO()
    with redirect_stdout(said):
        runpy.run_path(str(tmp_path / "use.py"))
    assert said.getvalue().startswith("mariner: poles at -")


def test_options_and_outputs_it_names_are_there(warehouse: Path) -> None:
    known = {
        option for command in ("export", "steer", "params") for option in _options(cli.get_command(_context(), command))
    }
    for option in re.findall(r"`(--[a-z]+)", TEXT):
        assert option in known, option
    for output in OUTPUTS:
        assert f"`{output}`" in TEXT


def _context() -> click.Context:
    return click.Context(cli)


def _options(command: click.Command | None) -> set[str]:
    assert command is not None
    own = {option for parameter in command.params for option in parameter.opts}
    inner = command.commands.values() if isinstance(command, click.Group) else ()
    return own.union(*(_options(one) for one in inner))
