"""Files that are there whole or not at all."""

from __future__ import annotations

from pathlib import Path
from threading import Barrier, Thread

import pytest

from kempf.warehouse.storage.whole_file import whole_file


def test_a_file_takes_the_place_of_another_once_it_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "new" / ("n" * 255)  # as long as a name may be
    with whole_file(path) as passing:
        passing.write_text("first")
        assert not path.exists()
    with whole_file(path) as passing:
        passing.write_text("second")
        assert path.read_text() == "first"
    assert path.read_text() == "second" and list(path.parent.iterdir()) == [path]


def test_where_writing_fails_what_was_there_stays_and_nothing_is_left(tmp_path: Path) -> None:
    path = tmp_path / "note"
    path.write_text("before")

    def torn() -> None:
        with whole_file(path) as passing:
            passing.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        torn()
    assert path.read_text() == "before" and list(tmp_path.iterdir()) == [path]


def test_writers_at_once_do_not_meet(tmp_path: Path) -> None:
    path, together = tmp_path / "note", Barrier(2)

    def write(text: str) -> None:
        with whole_file(path) as passing:
            passing.write_text(text)
            together.wait(30)

    writers = [Thread(target=write, args=(text,)) for text in ("port", "starboard")]
    for writer in writers:
        writer.start()
    for writer in writers:
        writer.join()
    assert path.read_text() in ("port", "starboard") and list(tmp_path.iterdir()) == [path]
