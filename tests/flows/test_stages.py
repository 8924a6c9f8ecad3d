"""What a change of the code makes anew: copies of the source, each changed in one place, reprocess one warehouse."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from shutil import copytree, ignore_patterns
from typing import Any

import pytest

from kempf.flows.jobs.identify.identify_vessel import Request, identify_vessel
from kempf.flows.jobs.ingest.files import read_profiles
from kempf.flows.jobs.ingest.ingest_logs import ingest
from kempf.flows.jobs.reprocess.reprocess_vessel import reprocess_vessel
from kempf.warehouse.queries.standing import standing_ids
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import logs, parameter_sets, segments
from tests.flows.content import RUNS, fresh
from tests.workbench.driving import ROOT, START

ROOMS = ("schemas", "pipeline", "warehouse", "flows", "workbench")


@dataclass(frozen=True)
class Changed:
    """A warehouse after a copy of the source with one change has reprocessed it."""

    warehouse: Warehouse
    report: dict[str, Any]

    @property
    def done(self) -> tuple[int, int, int, int]:
        """Logs read anew, logs searched anew, sets made and sets kept."""
        assert self.report["failures"] == []
        return tuple(self.report[key] for key in ("reread", "searched", "new_sets", "kept_sets"))  # type: ignore[return-value]


class Source:
    """A copy of the source in which one file at a time is changed."""

    def __init__(self, folder: Path, identified: Path) -> None:
        self.folder, self.identified = folder, identified
        for room in ROOMS:
            copytree(ROOT / room, folder / room, ignore=ignore_patterns("*.nbi", "*.nbc"))
        copytree(ROOT / "kempf", folder / "kempf", symlinks=True)

    def reprocess(self, place: Path, **changes: tuple[str, str]) -> Changed:
        """Change files, by path with ``__`` for ``/``, let the copy reprocess the warehouse, and change them back."""
        files = {self.folder / f"{name.replace('__', '/')}.py": change for name, change in changes.items()}
        before = {path: path.read_text(encoding="utf-8") for path in files}
        copytree(self.identified, place)
        try:
            for path, (old, new) in files.items():
                assert before[path].count(old) >= 1, path
                path.write_text(before[path].replace(old, new, 1), encoding="utf-8")
            arguments = ["reprocess", "--vessel", "mariner", "--warehouse", str(place), "--json"]
            setting = {**os.environ, "PYTHONPATH": str(self.folder)}
            command = [sys.executable, "-c", START, *arguments]
            ran = subprocess.run(command, cwd=self.folder, env=setting, capture_output=True, text=True, check=False)
        finally:
            for path, text in before.items():
                path.write_text(text, encoding="utf-8")
        assert ran.returncode == 0, ran
        (report,) = json.loads(ran.stdout)
        return Changed(Warehouse(str(place)), report)


@pytest.fixture(scope="module")
def source(harbour: Path, tmp_path_factory: pytest.TempPathFactory) -> Source:
    folder = tmp_path_factory.mktemp("stages")
    warehouse = fresh(folder / "identified")
    ingest(warehouse, [harbour / "mariner.nmea.gz"], given=read_profiles([harbour / "profile.yaml"]))
    (outcome,) = identify_vessel(warehouse, "mariner", Request(estimator="least-squares"))
    assert outcome.parameter_set is not None
    return Source(folder / "source", folder / "identified")


def versions(place: Path) -> dict[str, int]:
    return {name: n for name, n in delta.versions(Warehouse(str(place))).items() if name not in (*RUNS, "aliases")}


def test_remarks_docstrings_and_rooms_of_no_stage_move_nothing(source: Source, tmp_path: Path) -> None:
    remark = ("from __future__ import annotations\n", "# A remark.\nfrom __future__ import annotations\n")
    docstring = ('"""', '"""Said otherwise: ')
    found = source.reprocess(
        tmp_path / "w",
        pipeline__ingest__read=remark,
        pipeline__segment__zigzags__find_zigzags=docstring,
        pipeline__estimate__estimators=remark,
        schemas__model_spec=docstring,
        pipeline__steering__nomoto=("import annotations\n", "import annotations\n\nFORMULA = 1.0\n"),
    )
    assert (found.report["status"], found.done) == ("unchanged", (0, 0, 0, 1))
    assert versions(tmp_path / "w") == versions(source.identified)


def test_a_formula_of_segment_leaves_the_readings_and_finds_segments_anew(source: Source, tmp_path: Path) -> None:
    before = Warehouse(str(source.identified))
    band = {"pipeline__segment__settings": ("held_band: float = 0.1\n", "held_band: float = 0.11\n")}
    found = source.reprocess(tmp_path / "w", **band)
    assert found.done == (0, 1, 0, 1), "the same zigzag: its set stays"
    now, then = versions(tmp_path / "w"), versions(source.identified)
    assert {name for name in now if now[name] != then[name]} == {"segments", "examinations"}
    assert logs.current(found.warehouse) == logs.current(before)
    (new,), (old,) = segments.current(found.warehouse), segments.current(before)
    assert new.segment_id == old.segment_id and new.code_version != old.code_version
    assert standing_ids(found.warehouse, "mariner") == standing_ids(before, "mariner") != []


def test_a_set_goes_with_its_segment_and_comes_back_with_it(source: Source, tmp_path: Path) -> None:
    limit = ("largest_heading_deg: float = 45.0\n", "largest_heading_deg: float = 9.0\n")
    found = source.reprocess(tmp_path / "w", pipeline__segment__settings=limit)
    assert found.done == (0, 1, 0, 0) and segments.current(found.warehouse) == []
    assert standing_ids(found.warehouse, "mariner") == []
    report = reprocess_vessel(found.warehouse, "mariner")
    assert (report.reread, report.searched, report.new_sets, report.kept_sets) == (0, 1, 0, 1)
    assert standing_ids(found.warehouse, "mariner") == standing_ids(Warehouse(str(source.identified)), "mariner")


def test_a_formula_of_estimate_leaves_readings_and_segments(source: Source, tmp_path: Path) -> None:
    degrees = ("max(1, targets.shape[0] - regressors.shape[1])", "max(1, targets.shape[0])")
    found = source.reprocess(tmp_path / "w", pipeline__estimate__paper__least_squares=degrees)
    assert found.done == (0, 0, 1, 0)
    now, then = versions(tmp_path / "w"), versions(source.identified)
    assert {name for name in now if now[name] != then[name]} == {"parameter_sets"}
    assert len(parameter_sets.codes(found.warehouse, "mariner")) == 2
    assert len(standing_ids(found.warehouse, "mariner")) == 1, "each version stands by its own set"


def test_a_formula_of_ingest_reads_anew(source: Source, tmp_path: Path) -> None:
    found = source.reprocess(
        tmp_path / "w", pipeline__ingest__read=("import annotations\n", "import annotations\n\nX = 1\n")
    )
    assert found.done == (1, 0, 1, 0)
