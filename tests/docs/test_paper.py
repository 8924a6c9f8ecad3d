"""docs/paper.md is true: its command prints what the page shows and draws the figures that lie beside it."""

from pathlib import Path

from tests.docs.console import Command, Names, Shell, difference, steps

PAGE = Path(__file__).parents[2] / "docs" / "paper.md"
FIGURES = PAGE.parent / "figures" / "paper"


def test_the_page_shows_what_its_command_prints(tmp_path: Path) -> None:
    names, shell = Names(), Shell(tmp_path)
    commands = 0
    try:
        for step in steps(PAGE.read_text(encoding="utf-8")):
            assert isinstance(step, Command)
            commands += 1
            found, code = shell.run(names.resolved(step.line))
            assert code == 0, found
            wrong = difference(step.shown, found, names)
            assert wrong is None, f"$ {step.line}\n{wrong}\nrenew it with python -m benchmarks.documents.draw_paper"
    finally:
        shell.close()
    assert commands == 1
    drawn = sorted(path.name for path in (tmp_path / "kempf-paper").iterdir())
    assert drawn == sorted(path.name for path in FIGURES.iterdir())
    for path in FIGURES.iterdir():
        assert path.read_bytes().startswith(b"\x89PNG\r\n")
        assert path.stat().st_size < 150_000
