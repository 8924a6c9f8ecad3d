from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from hashlib import sha256
from importlib.metadata import PathDistribution, distributions
from pathlib import Path

import pytest
import yaml

from kempf.schemas.effect import Effect
from kempf.warehouse.code import code_version
from kempf.warehouse.code.code_version import Stage
from kempf.warehouse.code.source_tree import read_module

ROOT = Path(__file__).parents[2]


#: Jobs whose calls into the pipeline make the results of a stage.
JOBS: dict[Stage, tuple[str, ...]] = {
    "ingest": ("ingest/spool",),
    "segment": ("ingest/search_log", "ingest/find_segments", "ingest/examine_log"),
    "estimate": (
        *("identify/identify_vessel", "identify/pool_vessel", "identify/no_speed_log", "identify/parameter_set_of"),
        *("identify/vessel_runs", "identify/vessel_model", "identify/update_model"),
    ),
    "diagnose": ("diagnose/diagnose_vessel",),
}


@pytest.mark.parametrize("stage", code_version.STAGES)
def test_what_the_jobs_of_a_stage_call_counts_in_its_fingerprint(stage: Stage) -> None:
    assert re.fullmatch(r"[0-9a-f]{16}", code_version.fingerprint(stage))
    counted = code_version.modules_in(ROOT, stage)
    for job in JOBS[stage]:
        called = read_module((ROOT / "flows" / "jobs" / f"{job}.py").read_bytes()).imports
        there = {name for name in called if name.startswith("kempf.pipeline.") and _is_module(name)}
        assert there <= set(counted), (job, there - set(counted))
    assert not any(name.startswith(("kempf.pipeline.simulate", "kempf.pipeline.steering")) for name in counted)


def _is_module(name: str) -> bool:
    path = ROOT.joinpath(*name.split(".")[1:])
    return path.with_suffix(".py").is_file() or (path / "__init__.py").is_file()


def test_stages_count_what_is_theirs() -> None:
    of = {stage: set(code_version.modules_in(ROOT, stage)) for stage in code_version.STAGES}
    assert "kempf.pipeline.segment.zigzags.find_zigzags" in of["segment"] - of["estimate"] - of["ingest"]
    assert "kempf.pipeline.estimate.likelihood" in of["estimate"] - of["segment"]
    assert of["ingest"] <= of["segment"] and of["ingest"] <= of["estimate"] <= of["diagnose"] >= of["segment"]
    assert "kempf.pipeline.model.effects.rudder_lag" in of["estimate"], "code of an effect of the catalogue"


@pytest.mark.parametrize("key", Effect.model_fields)
def test_words_about_an_effect_make_diagnoses_anew_at_most(tmp_path: Path, key: str) -> None:
    for room in ("pipeline", "schemas"):
        shutil.copytree(ROOT / room, tmp_path / room, ignore=shutil.ignore_patterns("__pycache__"))
    before = {stage: code_version.fingerprint_in(tmp_path, stage) for stage in ("estimate", "diagnose")}
    path = tmp_path / "schemas" / "effects" / "cross_flow_drag.yaml"
    path.write_text(yaml.safe_dump({**yaml.safe_load(path.read_text()), key: "otherwise"}, sort_keys=False))
    moved = {stage for stage, digest in before.items() if code_version.fingerprint_in(tmp_path, stage) != digest}
    words = {"title", "plain", "separated_by"}
    shown = {"equation", "reference", "confounded_with"}
    assert moved == (set() if key in shown else {"diagnose"} if key in words else {"estimate", "diagnose"})


def test_packages_are_named_with_their_versions() -> None:
    import numpy as np

    found = code_version.packages()
    assert found["numpy"] == np.__version__
    assert found["python"].startswith("3.")


def test_the_commit_is_that_of_the_source_and_of_no_other_checkout(tmp_path: Path) -> None:
    git = shutil.which("git")
    if git is None:
        pytest.skip("git is not installed")
    package = tmp_path / "pipeline"
    package.mkdir()
    (package / "__init__.py").write_text("")
    assert code_version.commit_of(package) is None  # no checkout

    names = {f"GIT_{who}_{what}": "x" for who in ("AUTHOR", "COMMITTER") for what in ("NAME", "EMAIL")}
    environment = {**os.environ, **names}

    def run(*arguments: str) -> str:
        done = subprocess.run(
            [git, *arguments], cwd=tmp_path, env=environment, check=True, capture_output=True, text=True
        )
        return done.stdout.strip()

    run("init", "-q")
    run("commit", "-q", "--allow-empty", "-m", "empty")
    assert code_version.commit_of(package) is None  # in a checkout, but not its file
    run("add", ".")
    run("commit", "-q", "-m", "package")
    commit = run("rev-parse", "HEAD")
    assert code_version.commit_of(package) == commit
    (package / "__init__.py").write_text("x = 1\n")
    assert code_version.commit_of(package) == f"{commit}-dirty"


def test_without_git_there_is_no_commit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    assert code_version.commit_of(ROOT / "pipeline") is None


def test_a_package_may_say_which_commit_it_was_built_from(tmp_path: Path) -> None:
    assert code_version.built_from(tmp_path) is None
    (tmp_path / "commit.txt").write_text("0123abc\n")
    assert code_version.built_from(tmp_path) == "0123abc"
    (tmp_path / "commit.txt").write_text("\n")
    assert code_version.built_from(tmp_path) is None


def test_importing_the_store_loads_no_heavy_library() -> None:
    code = (
        "import sys, kempf.warehouse.storage.store, kempf.warehouse.tables.raw;"
        "import kempf.warehouse.storage.delta, kempf.warehouse.code.code_version, kempf.warehouse.queries.history;"
        "print(sorted({'deltalake', 'pyarrow', 'polars', 'numpy'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_what_is_installed_is_named_as_the_standard_library_does(tmp_path: Path) -> None:
    for name, text in {
        "plain-1.dist-info": "Metadata-Version: 2.1\nName: Plain\nVersion: 1\n\nName: other\n",
        "bare-1.dist-info": "Name: bare\n\n",
        "tight-1.dist-info": "Name:tight\nVersion:1\n\n",
        "lower-1.dist-info": "name: lower\nversion: 1\r\n\r\n",
        "nameless-1.dist-info": "Version: 1\n\n",
    }.items():
        (tmp_path / name).mkdir()
        (tmp_path / name / "METADATA").write_bytes(text.encode())
    (tmp_path / "old-2.egg-info").write_text("Name: old\nVersion: 2\n")
    # the standard library's own class: where importlib_metadata is imported, `distributions` gives that one's, which
    # raises KeyError where a name is missing
    installed = [PathDistribution(folder) for folder in sorted(tmp_path.iterdir())]
    found = [code_version._name_and_version(one) for one in installed]
    assert found == [f"{one.name.lower()}=={one.version}" if one.name else "" for one in installed]
    assert len(found) == 6 and found.count("") == 1


def test_the_machine_is_named() -> None:
    found = code_version.machine()
    assert set(found) == {"system", "machine", "processor", "environment"}
    assert found["system"] and found["machine"]
    assert re.fullmatch(r"[0-9a-f]{64}", found["environment"])
    # of what is installed, as the standard library names it
    installed = sorted({f"{one.name.lower()}=={one.version}" for one in distributions() if one.name})
    assert found["environment"] == sha256("\n".join(installed).encode()).hexdigest()
