"""A random manoeuvre from the log to the pages: listed apart from the zigzags, fitted and shown as they are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from kempf.pipeline.simulate.csv_log import to_csv
from kempf.pipeline.simulate.hulls import HULLS
from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.manoeuvre import RudderHold, SteadyCourse, ZigzagTest
from kempf.pipeline.simulate.trial import TrialSettings, simulate_trial
from kempf.workbench.web.jobs.queue import DONE
from tests.workbench.driving import HULL, Ran, kempf
from tests.workbench.web.conftest import OURS, at_work, until

ORDERS = (35.0, 0.0, -20.0, 20.0, -35.0, 35.0, 0.0, 35.0, -20.0, 0.0, -35.0, 20.0)


@pytest.fixture(scope="module")
def taken(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Ran]:
    """A ferry's day: a zigzag, and rudder orders at irregular times behind it."""
    folder = tmp_path_factory.mktemp("day")
    held_s = np.random.default_rng(3).uniform(12.0, 40.0, len(ORDERS))
    irregular = [RudderHold(angle, float(time)) for angle, time in zip(ORDERS, held_s, strict=True)]
    programme = (SteadyCourse(120.0), ZigzagTest(20.0, 20.0, legs=5), SteadyCourse(250.0), *irregular)
    settings = TrialSettings(HULLS["ferry"], (*programme, SteadyCourse(250.0)), seed=5)
    (folder / "day.csv").write_bytes(to_csv(simulate_trial(settings)))
    profile = logger_profile(settings).model_dump(mode="json", exclude_defaults=True)
    (folder / "profile.yaml").write_text(yaml.safe_dump(profile, sort_keys=False), encoding="utf-8")
    warehouse = folder / "warehouse"
    return warehouse, kempf(
        "ingest", folder / "day.csv", "--profile", folder / "profile.yaml", "--warehouse", warehouse
    )


@pytest.fixture(scope="module")
def identified(taken: tuple[Path, Ran]) -> tuple[Path, Ran]:
    warehouse, _ = taken
    return warehouse, kempf("identify", "--vessel", "ferry", "--warehouse", warehouse, "--json")


def test_it_is_listed_apart_from_the_zigzags(taken: tuple[Path, Ran]) -> None:
    warehouse, ran = taken
    assert ran.code == 0, ran
    assert "1 zigzag: 20/20 to starboard; 1 random manoeuvre\n" in ran.out
    listed = kempf("segments", "--warehouse", warehouse)
    assert ", fitted: random manoeuvre, " in listed.out and "orders of up to 35 deg to starboard" in listed.out
    found = {one["kind"]: one for one in kempf("segments", "--warehouse", warehouse, "--json").json}
    assert sorted(found) == ["random_manoeuvre", "zigzag"]
    one = found["random_manoeuvre"]
    assert one["psi0_deg"] is None and one["overshoots_deg"] == [] and len(one["executes"]) >= 10
    assert one["detail"]["heading_range_deg"] > 30.0 and one["detail"]["lateral_speed"]["computed"]


def test_it_is_fitted_with_them(identified: tuple[Path, Ran]) -> None:
    _, ran = identified
    assert ran.code == 0, ran
    *alone, pooled = ran.json
    assert [len(one["segments"]) for one in (*alone, pooled)] == [1, 1, 2]
    truth = HULLS["ferry"].parameters
    # two say more than one, before what they disagree about widens the errors
    widened = pooled["convergence"]["pooling"]["widened"]
    assert 1.0 <= widened < 1.5
    for name in HULL:
        one = pooled["parameters"][name]
        assert abs(one["value"] - getattr(truth, name)) < 4.0 * one["std"], name
        assert one["std"] < widened * min(each["parameters"][name]["std"] for each in alone), name


def test_it_is_compared_and_shown_as_they_are(identified: tuple[Path, Ran], tmp_path: Path) -> None:
    warehouse, _ = identified
    document = kempf("compare", "--vessel", "ferry", "--warehouse", warehouse, "--json").json
    kinds = {run["kind"]: run for run in document["runs"]}
    assert kinds["random_manoeuvre"]["psi0_deg"] is None and kinds["zigzag"]["psi0_deg"] == 20.0
    assert " random " in kempf("compare", "--vessel", "ferry", "--warehouse", warehouse).out
    name = kinds["random_manoeuvre"]["segment_id"]
    with at_work(warehouse, tmp_path / "state") as (client, _, queue):
        asked = {"kind": "predict", "vessel": "ferry", "set": document["parameter_set_id"], "horizon": "free"}
        place = client.post("/jobs", data=asked, headers=OURS).headers["location"]
        until(lambda: queue.get(place.rsplit("/", 1)[-1]).state == DONE)
        for page in ("/v/ferry", f"/segments/{name}", f"/v/ferry/model?run={name}"):
            shown = client.get(page)
            assert shown.status_code == 200 and "random manoeuvre" in shown.text, (page, shown.text[:400])
        assert "Explain this stretch" in client.get(f"/segments/{name}").text


def test_it_is_excluded_as_they_are(taken: tuple[Path, Ran], tmp_path: Path) -> None:
    from shutil import copytree

    own = copytree(taken[0], tmp_path / "own")
    found = {one["kind"]: one for one in kempf("segments", "--warehouse", own, "--json").json}
    name = found["random_manoeuvre"]["segment_id"]
    done = kempf("segments", "exclude", name, "--reason", "tugs fast", "--yes", "--warehouse", own)
    assert done.code == 0 and "random manoeuvre" in done.out, done
    assert f"{name[:12]} is excluded: tugs fast" in kempf("segments", "--warehouse", own).out
    refused = kempf(
        *("segments", "correct", name, "--start", found["random_manoeuvre"]["start"]),
        *("--end", found["random_manoeuvre"]["end"], "--reason", "x", "--yes", "--warehouse", own),
    )
    assert refused.code != 0 and "zigzag" in refused.err, refused
