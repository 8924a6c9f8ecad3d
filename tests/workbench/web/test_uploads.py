"""Files that arrive: under their own name, below the hash of their bytes, however many bring the same one."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from io import BytesIO
from pathlib import Path

import pytest
from starlette.datastructures import UploadFile

from kempf.workbench.web import uploads
from kempf.workbench.web.uploads import Uploads

BYTES = bytes(range(256)) * 4096


def test_a_long_name_beyond_ascii_is_kept(tmp_path: Path) -> None:
    name = "ж" * 116 + ".csv"
    place = Uploads(tmp_path)._stored(UploadFile(BytesIO(b"t,v\n"), filename=name))
    assert place.endswith(f"/{name}") and (tmp_path / place).read_bytes() == b"t,v\n"


def test_one_file_that_arrives_twice_at_once_is_there_once(tmp_path: Path) -> None:
    arrived = Uploads(tmp_path)
    with ThreadPoolExecutor(8) as pool:
        stored = [pool.submit(arrived._stored, UploadFile(BytesIO(BYTES), filename="trial.csv")) for _ in range(40)]
        places = {one.result() for one in stored}
    assert len(places) == 1 and [p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()] == [BYTES]


def test_a_copy_that_fails_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(uploads.shutil, "copyfileobj", full)
    with pytest.raises(OSError, match="No space"):
        Uploads(tmp_path)._stored(UploadFile(BytesIO(BYTES), filename="trial.csv"))
    assert not [p for p in tmp_path.rglob("*") if p.is_file()]
