"""What a fingerprint of source counts, and what it does not."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from kempf.warehouse.code import source_tree
from kempf.warehouse.code.source_tree import SourceTree, read_module, read_yaml

CALLER = """
from kempf.pipeline.rooms import b

def f(x):
    return 2 * x + b.g(x)
"""
TYPED = """
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from kempf.pipeline import typed

h = abs
"""
BASE = {
    "pipeline/__init__.py": '"""Words."""\n',
    "pipeline/a.py": CALLER,
    "pipeline/rooms/__init__.py": "",
    "pipeline/rooms/b.py": "def g(x):\n    from ..tail import h\n\n    return h(x)\n",
    "pipeline/tail.py": TYPED,
    "pipeline/typed.py": "x = 1\n",
    "pipeline/other.py": "import kempf.pipeline.simulate.plant\n",
    "pipeline/catalogue/__init__.py": "from importlib.resources import files\n",
    "pipeline/catalogue/drag.py": "c = 1.0\n",
    "pipeline/catalogue/data/lag.yaml": "tau: 3\n",
    "pipeline/simulate/__init__.py": "",
    "pipeline/simulate/plant.py": "",
}
REACHED = {
    "kempf.pipeline": "pipeline/__init__.py",
    "kempf.pipeline.a": "pipeline/a.py",
    "kempf.pipeline.rooms": "pipeline/rooms/__init__.py",
    "kempf.pipeline.rooms.b": "pipeline/rooms/b.py",
    "kempf.pipeline.tail": "pipeline/tail.py",
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, text in BASE.items():
        path = tmp_path / "source" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return tmp_path / "source"


@pytest.fixture(autouse=True)
def places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    found = [tmp_path / "first" / "kept.json", tmp_path / "second" / "kept.json"]
    monkeypatch.setattr(source_tree, "_places", lambda: found)
    return found


def reached(folder: Path, entry: str = "a") -> dict[str, str]:
    return SourceTree(folder, ["pipeline"]).reached([f"kempf.pipeline.{entry}"])


def test_all_that_is_imported_counts_and_nothing_else(folder: Path) -> None:
    assert reached(folder).keys() == REACHED.keys(), "a relative import counts, one for the type checker does not"
    assert sorted(reached(folder, "other")) == ["kempf.pipeline", "kempf.pipeline.other"], "the simulator never counts"
    with pytest.raises(ModuleNotFoundError, match=r"kempf\.pipeline\.gone"):
        reached(folder, "gone")


def test_what_is_opened_by_name_counts(folder: Path) -> None:
    before = reached(folder, "catalogue")
    assert {"kempf.pipeline.catalogue.drag", "pipeline/catalogue/data/lag.yaml"} <= set(before)
    (folder / "pipeline/catalogue/data/lag.yaml").write_text("tau: 4\n")
    (folder / "pipeline/catalogue/stall.py").write_text("c = 2.0\n")
    after = reached(folder, "catalogue")
    assert after.keys() - before.keys() == {"kempf.pipeline.catalogue.stall"}
    assert [name for name in before if before[name] != after[name]] == ["pipeline/catalogue/data/lag.yaml"]


@pytest.mark.parametrize(
    "text", ["# why\ntau: 3\n", "tau:   3\n\n", "{tau: 3}", "tau: 3\nplain: other words\n", "plain: a\ntau: 3\n"]
)
def test_comments_and_keys_left_out_of_a_data_file_do_not_count(text: str) -> None:
    assert read_yaml(text.encode(), ["plain"]) == read_yaml(b"tau: 3\n", ["plain"])


@pytest.mark.parametrize(
    "text", ["tau: 3.0", "tau: '3'", "tau: 4", "t: 3", "tau: [3]", "tau: {unit: s}", "tau: [3", ""]
)
def test_whatever_a_data_file_says_otherwise_counts(text: str) -> None:
    assert read_yaml(text.encode()) != read_yaml(b"tau: 3\n")


def test_the_order_of_parameters_counts_as_it_is_that_of_their_covariance() -> None:
    assert read_yaml(b"parameters: {c: {low: 0}, k: {low: 0}}") != read_yaml(b"parameters: {k: {low: 0}, c: {low: 0}}")


def test_keys_are_left_out_however_deep_they_stand() -> None:
    before = b"parameters: {c: {meaning: a, low: 0}}\nstates: [{plain: b}]"
    after = b"parameters: {c: {meaning: x, low: 0}}\nstates: [{plain: y}]"
    assert read_yaml(before, ["meaning", "plain"]) == read_yaml(after, ["meaning", "plain"])
    assert read_yaml(before, ["meaning"]) != read_yaml(after, ["meaning"])


def test_a_data_file_is_kept_by_what_was_left_out(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def lag(*left_out: str) -> str:
        entry = SourceTree(folder, ["pipeline"]).reached(["kempf.pipeline.catalogue"], left_out)
        return entry["pipeline/catalogue/data/lag.yaml"]

    whole, without = lag(), lag("tau")
    assert whole != without
    monkeypatch.setattr(source_tree, "read_yaml", lambda *_: pytest.fail("read again"))
    assert (lag(), lag("tau")) == (whole, without)


@pytest.mark.parametrize(
    "text",
    [
        "def f(x):\n    return 2*x\n",
        "# a remark\n\n\ndef f( x ):\n    # another\n    return (2 * x)  # a third\n",
        '"""Words."""\n\n\ndef f(x):\n    """Other words."""\n    return 2 * x\n',
    ],
)
def test_comments_docstrings_and_blanks_do_not_count(text: str) -> None:
    assert read_module(text.encode()).digest == read_module(b"def f(x):\n    return 2 * x\n").digest


@pytest.mark.parametrize(
    "text",
    [
        "def f(x):\n    return 3 * x\n",
        "def f(x):\n    return 2.0 * x\n",
        "def f(x):\n    return -2 * x\n",
        "def f(y):\n    return 2 * y\n",
        "def f(x=None):\n    return 2 * x\n",
        "def f(x):\n    return '2' * x\n",
        "def f(x: int):\n    return 2 * x\n",
        "@g\ndef f(x):\n    return 2 * x\n",
        "def f(x):\n    'said'.encode()\n    return 2 * x\n",
        "def f(x):\n    return 2 * x\nf(1)\n",
        "",
    ],
)
def test_whatever_is_done_otherwise_counts(text: str) -> None:
    assert read_module(text.encode()).digest != read_module(b"def f(x):\n    return 2 * x\n").digest


def test_what_was_found_is_kept_and_believed_only_for_the_same_bytes(
    folder: Path, places: list[Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    before = reached(folder)
    kept = json.loads(places[0].read_text())["files"]
    assert len(kept) == len({BASE[path] for path in REACHED.values()})
    with monkeypatch.context() as patched:
        patched.setattr(source_tree, "read_module", lambda _: pytest.fail("parsed again"))
        assert reached(folder) == before
    (folder / "pipeline/tail.py").write_text("h = round\n")
    after = reached(folder)
    assert {name for name in before if before[name] != after[name]} == {"kempf.pipeline.tail"}


@pytest.mark.parametrize(
    "content", ["", "[]", '{"form": 0}', '{"form": 2, "files": {"a": 1}}', '{"form": 2, "files": 1}', "\x00"]
)
def test_what_was_kept_and_is_damaged_is_made_anew(folder: Path, places: list[Path], content: str) -> None:
    before = reached(folder)
    places[0].write_text(content)
    assert reached(folder) == before


def test_where_nothing_can_be_written_the_next_place_or_none_is_taken(folder: Path, places: list[Path]) -> None:
    before = reached(folder)
    places[0].unlink()
    places[0].parent.rmdir()
    places[0].parent.write_text("in the way")
    assert reached(folder) == before and places[1].exists()
    places[1].unlink()
    places[1].parent.rmdir()
    places[1].parent.write_text("in the way")
    assert reached(folder) == before
