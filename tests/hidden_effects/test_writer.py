"""What lies in a case's folder: logs that the flows take in, the zigzags that were sailed, no word of the effect."""

from __future__ import annotations

import gzip
import json
from collections import Counter
from datetime import datetime
from io import BytesIO
from pathlib import Path

import pytest
from mcap.reader import make_reader

from benchmarks.diagnose.hidden_effects import write
from benchmarks.diagnose.hidden_effects.cases import NOISES, design
from benchmarks.diagnose.hidden_effects.effects import CATALOGUE
from benchmarks.diagnose.hidden_effects.outsiders import OUTSIDERS
from benchmarks.diagnose.hidden_effects.programme import DISTURBANCES
from benchmarks.diagnose.hidden_effects.seal import open_sealed, seal
from kempf.pipeline.simulate.hulls import HULLS
from kempf.schemas.errors import DataRejected
from kempf.warehouse.storage.store import Warehouse


def test_the_sample_is_balanced_and_large_enough(sample):
    kinds = Counter(case.kind for case in sample)
    effects = Counter(case.effect for case in sample)
    assert len(sample) == len({case.case_id for case in sample}) == len({case.seed for case in sample}) == 336
    assert kinds["none"] == 42
    assert len(CATALOGUE) >= 20
    assert len(OUTSIDERS) >= 6
    assert set(effects) == {*CATALOGUE, *OUTSIDERS, "none"}
    for names in (CATALOGUE, OUTSIDERS):
        assert max(effects[n] for n in names) - min(effects[n] for n in names) <= 1
        assert min(effects[n] for n in names) >= 5
    for levels, of in ((HULLS, "hull"), (NOISES, "noise"), (DISTURBANCES, "disturbance"), (range(3), "strength")):
        count = Counter(getattr(case, of) for case in sample)
        assert set(count) == set(levels)
        assert max(count.values()) <= 1.25 * min(count.values())
        for name in (*CATALOGUE, *OUTSIDERS, "none"):
            own = Counter(getattr(case, of) for case in sample if case.effect == name)
            assert max(own.values()) - min([own[level] for level in levels]) <= 1
    assert design(336, 1) == sample
    assert design(336, 2) != sample


def test_the_flows_take_a_case_in_and_find_its_zigzags(written, tmp_path: Path):
    from kempf.flows.jobs.ingest.files import read_profiles
    from kempf.flows.jobs.ingest.ingest_logs import ingest

    for case, folder, answer in written:
        warehouse = Warehouse(str(tmp_path / case.case_id))
        logs = sorted(p for p in folder.iterdir() if p.name != "profile.yaml")
        outcomes = ingest(warehouse, logs, None, read_profiles([folder / "profile.yaml"]))
        assert [o.error for o in outcomes] == [None, None]
        assert 6 <= sum(len(o.segments) for o in outcomes) <= 8
        for outcome, stated in zip(outcomes, answer["executes_utc_ns"], strict=True):
            assert len(outcome.segments) == len(stated)
            for segment, instants in zip(outcome.segments, stated, strict=True):
                assert abs(segment.executes_utc_ns[0] - instants[0]) < 2e9
                assert len(segment.executes_utc_ns) in (len(instants) - 1, len(instants))


def plain(path: Path) -> str:
    """Everything that a file says, unpacked."""
    data = path.read_bytes()
    if path.suffix == ".mcap":
        reader = make_reader(BytesIO(data))
        stated = [f"{s.name} {s.data!r} {c.topic} {c.metadata} {m.data!r}" for s, c, m in reader.iter_messages()]
        return " ".join([*stated, str(reader.get_header())])
    return (gzip.decompress(data) if path.suffix == ".gz" else data).decode("latin-1")


def test_nothing_in_a_folder_reveals_the_effect(written, sample):
    words = [*CATALOGUE, *OUTSIDERS, *HULLS, "moderate", "calm", "effect", "theta", "outsider", "catalogue"]
    for case, folder, _ in written:
        names = sorted(p.name for p in folder.iterdir())
        assert names[-1] == "profile.yaml"
        for path in folder.iterdir():
            text = (path.name + plain(path)).lower()
            assert [word for word in words if word in text] == []
        assert case.case_id in (folder / "profile.yaml").read_text(encoding="utf-8")
    # nor does the place in the sample, which the id and the formats follow
    half = Counter(case.kind for case in sample[:160])
    assert 10 <= half["none"] <= 30


def test_a_case_is_the_same_bytes_again(written):
    case, folder, answer = written[0]
    files, again = write.logs_of(case)
    assert {name: (folder / name).read_bytes() for name in files} == files
    assert json.loads(json.dumps(again)) == {key: value for key, value in answer.items() if key != "files"}


def test_the_answers_are_sealed_and_an_interrupted_run_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    made = []

    def quick(case):
        made.append(case.case_id)
        if len(made) == 3:
            raise KeyboardInterrupt
        return {"profile.yaml": b"x"}, {"effect": case.effect}

    monkeypatch.setattr(write, "logs_of", quick)
    out, key = tmp_path / "out", tmp_path / "elsewhere.key"
    with pytest.raises(KeyboardInterrupt):
        write.write_all(out, key, 6, 1, show=lambda line: None)
    write.write_all(out, key, 6, 1, show=lambda line: None)
    assert len(made) == 7
    data = (out / "sealed.bin").read_bytes()
    stated = open_sealed(data, key.read_bytes())["cases"]
    assert {name: one["effect"] for name, one in stated.items()} == {c.case_id: c.effect for c in design(6, 1)}
    assert sorted(p.name for p in out.iterdir()) == ["cases", "sealed.bin"]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["elsewhere.key", "out"]
    assert b"effect" not in data


def test_a_changed_seal_is_refused():
    data = seal({"a": 1}, b"key")
    for wrong, key in ((data[:-1] + b"\0", b"key"), (data, b"other")):
        with pytest.raises(DataRejected, match="do not fit"):
            open_sealed(wrong, key)


def test_all_logs_may_be_tables_of_slow_rows():
    case = design(6, 1, rows_hz=2.0)[0]
    assert [c.hull for c in design(6, 1, rows_hz=2.0)] == [c.hull for c in design(6, 1)]
    tables = {name: content for name, content in write.logs_of(case)[0].items() if name != "profile.yaml"}
    assert len(tables) == 2 and all(name.endswith(".csv.gz") for name in tables)
    for content in tables.values():
        stamps = [line.split(b",")[0] for line in gzip.decompress(content).splitlines()[1:4]]
        first, second, third = (datetime.fromisoformat(stamp.decode()) for stamp in stamps)
        assert (second - first).total_seconds() == (third - second).total_seconds() == 0.5
