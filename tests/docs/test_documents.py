"""What the documents name is there: links, commands, figures, results they quote."""

import re
from pathlib import Path

import pytest

from kempf.workbench.cli.entry import COMMANDS

ROOT = Path(__file__).parents[2]
DOCUMENTS = [
    *(ROOT / f"{name}.md" for name in ("README", "CHANGELOG", "CONTRIBUTING")),
    *sorted((ROOT / "docs").rglob("*.md")),
]
DECISIONS = sorted((ROOT / "docs" / "decisions").glob("*.md"))
LINK = re.compile(r"\]\(([^)\s]+)\)")


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda p: str(p.relative_to(ROOT)))
def test_links_commands_and_modules_exist(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    for link in LINK.findall(text):
        if "://" not in link:
            assert (path.parent / link.partition("#")[0]).exists(), link
    for command in re.findall(r"(?:^\$ |`)kempf ([a-z][a-z-]+)", text, flags=re.MULTILINE):
        assert command in COMMANDS, command
    for module in re.findall(r"python -m (benchmarks(?:\.\w+)+)", text):
        assert (ROOT / (module.replace(".", "/") + ".py")).is_file(), module
    assert not re.search(r"(?<![\w.])/(?:tmp|home|work|Users)/", text)


@pytest.mark.parametrize("path", DECISIONS, ids=lambda p: p.name)
def test_decisions_have_one_form(path: Path) -> None:
    lines = path.read_text(encoding="utf-8").splitlines()
    assert lines[0].startswith(f"# {path.name[:4]} ")
    assert [line for line in lines if line.startswith("## ")] == ["## Context", "## Decision", "## Consequences"]
    assert not [line for line in lines if re.fullmatch(r"[A-Z]{3,}", line)], "a place that was to be filled in"


def test_decisions_are_numbered_through() -> None:
    assert [path.name[:4] for path in DECISIONS] == [f"{k + 1:04d}" for k in range(len(DECISIONS))]


def test_decision_on_the_current_quotes_its_benchmark() -> None:
    quoted = [line for line in DECISIONS[1].read_text(encoding="utf-8").splitlines() if line.startswith("|")]
    measured = (ROOT / "benchmarks" / "results" / "current_frame.md").read_text(encoding="utf-8").splitlines()
    assert len(quoted) == 8
    assert set(quoted) <= set(measured)


def test_honesty_quotes_the_benchmarks() -> None:
    text = " ".join((ROOT / "docs" / "honesty.md").read_text(encoding="utf-8").split())
    results = ROOT / "benchmarks" / "results"
    trials = (results / "monte_carlo.md").read_text("utf-8")
    assert (coverage := re.search(r"within 3 standard errors: (\d+ of \d+)", trials))
    assert f"standard errors of the truth in {coverage[1]} [trials]" in text
    logs = {log: (int(runs), int(within)) for log, runs, within in re.findall(r"\| (\S+) \| (\d+) \| (\d+) \|", trials)}
    messages = [logs["nmea.gz"][i] + logs["mcap"][i] for i in (1, 0)]
    assert f"in {messages[0]} of {messages[1]} logged as NMEA or MCAP" in text
    assert f"in {logs['csv.gz'][1]} of {logs['csv.gz'][0]} logged as a table" in text
    assert (boat := re.search(r"All six within 3 standard errors: (\d+ of \d+) runs", trials))
    assert f"there they lay so in {boat[1]}," in text
    tank = (results / "hsva.md").read_text("utf-8")
    assert (runs := re.search(r"\| of (\d+) runs \| no estimate \| converged \| signs a hull can have", tank))
    assert (default := re.search(r"\| Maximum likelihood, the default model.*?\| \d+ \| (\d+) \|", tank))
    assert (still := re.search(r"\| Maximum likelihood, `docs/models/tank.yaml`.*?\| \d+ \| (\d+) \| (\d+) \|", tank))
    assert f"On {runs[1]} zigzags measured in a [towing tank]" in text
    assert f"the default model converges on {default[1]}." in text
    assert f"it converges on {still[1]}, of which {still[2]} have the signs" in text


def test_readme_leads_to_every_page() -> None:
    linked = set(LINK.findall((ROOT / "README.md").read_text(encoding="utf-8")))
    assert {f"docs/{path.name}" for path in (ROOT / "docs").glob("*.md")} <= linked


def test_changelog_names_every_command() -> None:
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    for command in COMMANDS:
        assert f"kempf {command}" in text, command


def test_figure_is_a_small_png() -> None:
    data = (ROOT / "docs" / "figures" / "zigzag.png").read_bytes()
    assert data.startswith(b"\x89PNG\r\n")
    assert len(data) < 150_000
