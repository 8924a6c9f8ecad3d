"""A warehouse that an earlier version wrote, brought forward: every command that reads opens it and leaves it alone.

Then it is renewed.

``earlier_warehouse.tar.xz`` was written before the stages had fingerprints of their own: two logs of a simulated ferry,
identified by five estimators, of which three are gone since, pooled, diagnosed, with the effect ``rudder_lag`` added.
"""

from __future__ import annotations

import tarfile
from pathlib import Path

import pytest

from tests.workbench.driving import Ran, kempf, refused, tree

PACKED = Path(__file__).with_name("earlier_warehouse.tar.xz")
LOG, SEGMENT = "1982f1b6fd6b", "seg-a3a6f95d6bd46598"
LATERAL, LAGGED, GONE = "ps-4e0d79f6a759f605", "ps-a356c63f51187920", "ps-a7b413f7417a892f"
NEXT = "next: kempf reprocess --vessel ferry"


@pytest.fixture(scope="module")
def earlier(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("earlier")
    with tarfile.open(PACKED) as packed:
        packed.extractall(folder, filter="data")
    assert kempf("migrate", "--yes", "--warehouse", folder / "warehouse").code == 0
    return folder / "warehouse"


def ran(place: Path, *arguments: object) -> Ran:
    done = kempf(*arguments, "--warehouse", place)
    # a set that other code made is built again, and differs
    assert done.code == (5 if arguments[0] == "rerun" and LATERAL in arguments else 0), (arguments, done)
    return done


#: Commands that read, each with whether it says that something is out of date.
READING = {
    "compare --vessel ferry": True,
    "doctor " + LOG: False,
    "segments": True,
    "segments --vessel ferry": True,
    "ladder --vessel ferry": True,
    "history --vessel ferry": True,
    "history --vessel ferry --all": True,
    "history --vessel ferry --changes": True,
    "params list": False,
    "params list --vessel ferry": True,
    f"params show {LATERAL}": True,
    f"params show {GONE}": True,
    f"params show {LAGGED}": True,
    f"params diff {LATERAL} {GONE}": True,
    f"params steering {LATERAL}": True,
    f"params export {LATERAL}": True,
    f"export yaml {LAGGED}": True,
    f"export csv {LATERAL}": True,
    f"export control {LATERAL}": True,
    "logs list": True,
    f"logs show {LOG}": False,
    f"logs rejected {LOG}": False,
    "vessels list": False,
    "vessels show ferry": False,
    "rerun --all --preview": False,
    f"rerun {LATERAL}": False,
}


@pytest.mark.parametrize("command", READING)
def test_what_reads_opens_it_and_leaves_it_as_it_is(earlier: Path, command: str) -> None:
    before = tree(earlier)
    done = ran(earlier, *command.split())
    assert done.out.strip()
    assert (NEXT in done.err) == READING[command]
    assert tree(earlier) == before


def test_channels_of_an_earlier_version_are_exported(earlier: Path, tmp_path: Path) -> None:
    before = tree(earlier)
    done = ran(earlier, "export", "mcap", "--vessel", "ferry", "--output", tmp_path / "ferry.mcap")
    assert NEXT in done.err and (tmp_path / "ferry.mcap").stat().st_size > 0
    assert tree(earlier) == before


def test_a_set_of_an_estimator_that_is_gone_says_why_it_is_not_built_again(earlier: Path) -> None:
    output = refused(kempf("rerun", GONE, "--warehouse", earlier, "--json"), 4, "no_estimator")
    assert "prediction-error" in output["message"] and "commit f477316" in output["next_step"]


def test_reprocessing_renews_it(earlier: Path) -> None:
    (first,) = ran(earlier, "reprocess", "--vessel", "ferry", "--json").json
    assert (first["status"], first["reread"], first["failures"]) == ("changed", 2, [])
    (again,) = ran(earlier, "reprocess", "--vessel", "ferry", "--json").json
    assert (again["status"], again["reread"], again["new_sets"]) == ("unchanged", 0, 0)
    output = ran(earlier, "history", "--vessel", "ferry", "--json")
    assert NEXT not in output.err, "nothing is out of date any more"
    estimators = {row["estimator"] for row in output.json}
    assert {"ml", "ml-pooled", "least-squares"} == estimators, "those that are gone are superseded"
    old = ran(earlier, "history", "--vessel", "ferry", "--all", "--json").json
    assert {"prediction-error", "multiple-models", "ekf-ols", "ml-effects"} <= {row["estimator"] for row in old}
    rungs = ran(earlier, "ladder", "--vessel", "ferry", "--json").json
    assert [rung["added"] for rung in rungs] == [None, "rudder_lag"]
