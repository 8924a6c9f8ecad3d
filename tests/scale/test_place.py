"""A place to run, docs/deploy.md: the image's steps, then every service of the compose file, as processes.

Where a container engine answers, the image is built and run, too.
"""

from __future__ import annotations

import gzip
import json
import os
import re
import shutil
import subprocess
import time
import tomllib
from collections.abc import Iterator
from contextlib import ExitStack
from graphlib import TopologicalSorter
from pathlib import Path
from typing import Any
from urllib.request import Request, urlopen

import duckdb
import pytest
import yaml

from kempf.warehouse.code import code_version
from tests.conftest import Ship
from tests.scale import compose, image
from tests.scale.compose import Place
from tests.scale.image import Image
from tests.scale.servers import ROOT, environment, running, s3_server, wait_for

DEPLOY = ROOT / "deploy"
#: Services that are not Kempf's own: the tests have an S3 server of their own, and DuckDB in place of Grafana.
OTHERS = ("s3", "grafana")
COMMIT = "0123456789abcdef0123456789abcdef01234567"
VESSELS = ("ferry", "sloop")


def secrets(folder: Path) -> dict[str, str]:
    """What .env says, as the example does."""
    lines = (DEPLOY / ".env.example").read_text(encoding="utf-8").splitlines()
    names = [line.partition("=")[0] for line in lines if line and not line.startswith("#")]
    return {**dict.fromkeys(names, "testing"), "KEMPF_INBOX_FOLDER": str(folder)}


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Image:
    return image.build(tmp_path_factory.mktemp("image"), {"KEMPF_COMMIT": COMMIT})


@pytest.fixture(scope="module")
def installed(built: Image) -> dict[Path, int]:
    return files(built)


def files(built: Image) -> dict[Path, int]:
    """When each file of the packages was written, ns; left out is what goes elsewhere where it may not be written."""
    found = Path(built.here("/opt/kempf")).rglob("*")
    return {path: path.lstat().st_mtime_ns for path in found if path.is_file() and "__pycache__" not in path.parts}


@pytest.fixture(scope="module")
def place(built: Image, installed: dict[Path, int], ferry: Ship) -> Iterator[Place]:
    """Every service but the tables, which come once there is something to show; two ships in the inbox."""
    inbox = Path(built.here("/data/inbox"))
    rows = gzip.decompress(ferry.csv)
    for k, name in enumerate(VESSELS):
        (inbox / name).mkdir(parents=True)
        log, profile = inbox / name / "day.csv.gz", inbox / name / "profile.yaml"
        log.write_bytes(gzip.compress(rows, compresslevel=k + 1, mtime=0))  # other bytes, so another log
        profile.write_text(yaml.safe_dump({**ferry.profile, "vessel": name}), encoding="utf-8")
        for path in (log, profile):  # nobody is writing to it any more
            os.utime(path, (time.time() - 3600.0, time.time() - 3600.0))
    known = compose.services(secrets(inbox))
    order = TopologicalSorter({name: service.get("depends_on", {}) for name, service in known.items()})
    with ExitStack() as stack:
        quick = {"PREFECT_WORKER_QUERY_SECONDS": "1", "PREFECT_RUNNER_POLL_FREQUENCY": "1"}  # the tests wait less
        made = Place(built, known, stack, quick)
        port, log = made.ports["9000"], built.root / "s3.log"
        stack.enter_context(running(s3_server(port), environment(), log, port=port))
        made.logs["s3"] = [log]
        for name in order.static_order():
            if name not in (*OTHERS, "tables"):
                made.start(name)
        yield made


def test_the_image_holds_what_the_tests_ran_on(built: Image) -> None:
    run = [built.here("/opt/kempf/bin/python"), "-c"]
    asks = "print(c.git_commit(), c.fingerprint('estimate'), c.__file__)"
    asks = f"from kempf.warehouse.code import code_version as c; {asks}"
    done = subprocess.run(
        [*run, asks], env=built.environment(), cwd=built.folder, capture_output=True, text=True, check=True
    )
    commit, fingerprint, path = done.stdout.split()
    assert (commit, fingerprint) == (COMMIT, code_version.fingerprint("estimate"))
    assert Path(path).is_relative_to(built.root)
    lists = "import importlib.metadata as m; print(*sorted(f'{d.name}=={d.version}' for d in m.distributions()))"
    done = subprocess.run(
        [*run, lists], env=built.environment(), cwd=built.folder, capture_output=True, text=True, check=True
    )
    there = {re.sub(r"[-_.]+(?=.*==)", "-", one.lower()) for one in done.stdout.split()}
    locked, tested = (pins(ROOT / "requirements" / f"{name}.txt") for name in ("deploy", "develop"))
    assert locked.items() <= tested.items()
    assert pins(ROOT / "requirements" / "runtime.txt").items() <= locked.items()
    pinned = {one.partition(" ")[0] for one in locked}
    assert there - pinned == {f"kempf=={version()}"}
    assert "prefect-dask" in {one.partition("==")[0] for one in there}


def pins(path: Path) -> dict[str, frozenset[str]]:
    """Hashes by package and version."""
    found: dict[str, set[str]] = {}
    name = ""
    for line in path.read_text(encoding="utf-8").splitlines():
        if re.match(r"[\w.-]+==", line):
            name = line.partition(" ")[0]
            found[name] = set()
        found.setdefault(name, set()).update(re.findall(r"--hash=(\S+)", line))
    return {name: frozenset(hashes) for name, hashes in found.items() if name}


def version() -> str:
    return str(tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"])


def kernels(place: Place) -> set[Path]:
    """What is compiled for the services."""
    found = set(Path(place.here("/opt/kernels")).rglob("*.nbc"))
    # what simulates, fits alone and together, and predicts legs: minutes each where it is not there
    assert {"plant", "linear_kernel", "ekf", "kernel"} <= {path.name.partition(".")[0] for path in found}
    return found


def test_a_night_from_the_inbox_to_the_dashboard(place: Place) -> None:
    compiled = kernels(place)
    page = place.here("http://prefect:4200")
    assert json.loads(answer(f"{page}/ui-settings"))["api_url"] == f"{page}/api"
    assert b"<html" in answer(page).lower()
    taken = place.run("worker", "kempf", "inbox", "/data/inbox", "--json")
    assert taken.returncode == 0 and len(json.loads(taken.stdout)["ingested"]) == len(VESSELS), taken
    done = place.run("worker", "prefect", "--no-prompt", "deployment", "run", "reprocess/nightly", "--watch")
    assert done.returncode == 0, (done, *(log.read_text() for log in place.logs["worker"]))
    did = [log.read_text() for log in place.logs["dask-worker"]]
    assert len(did) == 2
    assert all(any(f"{name}: changed" in text for name in VESSELS) for text in did), "each of the two had a share"
    listed = place.run("worker", "kempf", "params", "list", "--json")
    assert {one["vessel"] for one in json.loads(listed.stdout)} == set(VESSELS), listed
    assert kernels(place) == compiled, "the image has them"
    place.start("tables")
    folder = Path(place.here("/data/kempf-tables"))
    wait_for((folder / "run_history.parquet").exists, 120.0)
    dashboard = json.loads((ROOT / "docs" / "grafana" / "kempf.json").read_text(encoding="utf-8"))
    (asked,) = (one["query"] for one in dashboard["templating"]["list"] if one["name"] == "tables")
    for panel in dashboard["panels"]:
        for target in panel["targets"]:
            query = target["rawSql"].replace("${tables}", place.here(asked)).replace("${vessel}", VESSELS[0])
            assert duckdb.sql(query).fetchall(), query


def test_no_service_writes_where_the_image_lets_only_root(place: Place, installed: dict[Path, int]) -> None:
    assert len(place.logs) == len(place.services) - 1, "all but Grafana have run"
    assert len(installed) > 1000 and files(place.image) == installed


def answer(address: str, asked: dict[str, Any] | None = None) -> bytes:
    data = None if asked is None else json.dumps(asked).encode()
    request = Request(address, data, {"Content-Type": "application/json"})  # noqa: S310 - an address of the test
    with urlopen(request, timeout=30) as given:  # noqa: S310
        return bytes(given.read())


def test_deploying_again_changes_nothing(place: Place) -> None:
    before = deployed(place)
    assert [name for name, *_ in before] == ["inbox", "nightly", "weekly"]
    assert str([place.here("/data/inbox")]) in before[0][-1] and "'s3://kempf/warehouse'" in before[1][-1]
    for name in ("bucket", "pool", "deploy"):
        done = place.run(name)
        assert done.returncode == 0, done
    assert deployed(place) == before


def deployed(place: Place) -> list[tuple[str, ...]]:
    """What the server knows of deployments: name, id, pool, times of the night, parameters."""
    found = json.loads(answer(place.here("http://prefect:4200/api/deployments/filter"), {}))
    stated = [
        (
            one["name"],
            one["id"],
            one["work_pool_name"],
            str([s["schedule"] for s in one["schedules"]]),
            str(one["parameters"]),
        )
        for one in found
    ]
    return sorted(stated)


def test_what_the_files_name_is_there() -> None:
    lets = [line[1:] for line in (ROOT / ".dockerignore").read_text(encoding="utf-8").splitlines() if line[0] == "!"]
    assert sorted(lets) == sorted(set(image.copied()))
    assert all((ROOT / name).exists() for name in lets)
    known = compose.services(secrets(Path("/srv/inbox")))
    for name, service in known.items():
        if name not in OTHERS:
            assert service["image"] == f"kempf:{version()}"
        assert re.search(r":[\w.-]*\d[\w.-]*$", service["image"]), "a version, not the newest"
        for port in service.get("ports", []):
            assert port.startswith("127.0.0.1:"), port
        for volume in service.get("volumes", []):
            source = volume["source"] if isinstance(volume, dict) else volume.partition(":")[0]
            assert source[0] not in "./" or source == "/srv/inbox" or (DEPLOY / source).is_dir(), source
    built = known["prefect"]["build"]
    assert (DEPLOY / built["context"] / built["dockerfile"]).samefile(image.DOCKERFILE)
    assert set(built["args"]) == {rest.partition("=")[0] for word, rest in image.instructions() if word == "ARG"}
    froms = {rest.split()[0] for word, rest in image.instructions() if word == "FROM"}
    assert len(froms) == 1 and re.fullmatch(r"python:3\.12\.\d+-slim-\w+", froms.pop())


def test_every_setting_that_a_service_needs_is_given() -> None:
    asked = {name for name, how, _ in compose.SECRET.findall(compose.FILE.read_text(encoding="utf-8")) if how == ":?"}
    assert asked == set(secrets(Path()))
    known = compose.services(secrets(Path("/srv/inbox")))
    stated = {name: set(service.get("environment", {})) for name, service in known.items()}
    page = set(re.findall(r"^export (\w+)=", (ROOT / "docs" / "fleet.md").read_text(encoding="utf-8"), re.MULTILINE))
    page |= {"AWS_SECRET_ACCESS_KEY"}  # behind another on its line
    everywhere = {"DO_NOT_TRACK", "PREFECT_SERVER_ANALYTICS_ENABLED"}
    assert everywhere <= {rest.partition("=")[0] for word, rest in image.instructions() if word == "ENV"}
    assert page - everywhere <= stated["worker"] | stated["deploy"]
    written = set(re.findall(r"\{\{ \$(\w+) \}\}", (ROOT / "prefect.yaml").read_text(encoding="utf-8")))
    assert written and written <= stated["deploy"]
    store = {"KEMPF_WAREHOUSE", "AWS_ENDPOINT_URL", "AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"}
    for name in ("bucket", "dask-worker", "tables", "worker"):
        assert store <= stated[name], name
    for name in ("dask-worker", "deploy", "pool", "worker"):
        assert "PREFECT_API_URL" in stated[name], name
    (mounted,) = known["worker"]["volumes"]
    assert mounted["target"] == known["deploy"]["environment"]["KEMPF_INBOX"]
    units = (DEPLOY / "systemd" / "kempf.env.example").read_text(encoding="utf-8")
    assert page <= set(re.findall(r"^#?(\w+)=", units, re.MULTILINE))


def test_grafana_is_given_the_dashboard_and_its_source() -> None:
    dashboard = json.loads((ROOT / "docs" / "grafana" / "kempf.json").read_text(encoding="utf-8"))
    (source,) = provided("datasources")["datasources"]
    asked = {(one["datasource"]["uid"], one["datasource"]["type"]) for one in dashboard["panels"]}
    assert asked == {("kempf", "motherduck-duckdb-datasource")} == {(source["uid"], source["type"])}
    service = compose.services(secrets(Path("/srv/inbox")))["grafana"]
    mounted = {one.split(":")[1]: one.split(":")[0] for one in service["volumes"]}
    (provider,) = provided("dashboards")["providers"]
    assert (DEPLOY / mounted[provider["options"]["path"]] / "kempf.json").is_file()
    home = Path(service["environment"]["GF_DASHBOARDS_DEFAULT_HOME_DASHBOARD_PATH"])
    assert (DEPLOY / mounted[str(home.parent)] / home.name).is_file()
    (folder,) = (one["query"] for one in dashboard["templating"]["list"] if one["name"] == "tables")
    assert mounted[folder] == "tables"
    for kind in ("datasources", "dashboards"):
        assert (DEPLOY / mounted[f"/etc/grafana/provisioning/{kind}"]).samefile(DEPLOY / "grafana" / kind)


def provided(kind: str) -> dict[str, Any]:
    found: dict[str, Any] = yaml.safe_load((DEPLOY / "grafana" / kind / "kempf.yaml").read_text(encoding="utf-8"))
    return found


def test_systemd_takes_the_units(built: Image, tmp_path: Path) -> None:
    systemd = shutil.which("systemd-analyze")
    if systemd is None:
        pytest.skip("systemd-analyze is not installed: nobody to read the units")
    units = Path(shutil.copytree(DEPLOY / "systemd", tmp_path / "units"))
    files = [path for path in units.rglob("*") if path.suffix in (".service", ".timer", ".conf")]
    commands = set()
    for path in files:
        text = built.here(path.read_text(encoding="utf-8"))
        commands |= set(re.findall(r"^ExecStart=(\S+)", text, re.MULTILINE))
        path.write_text(text, encoding="utf-8")
    assert commands == {built.here(f"/opt/kempf/bin/{name}") for name in ("dask", "kempf", "prefect")}
    names = [str(path) for path in sorted(files) if path.suffix != ".conf"]
    assert len(names) == 7
    done = subprocess.run([systemd, "verify", *names], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout + done.stderr) == (0, "")


def test_the_image_is_built_and_run_by_an_engine() -> None:
    docker = image.engine()
    if docker is None:
        pytest.skip("no container engine answers: its steps are run as processes instead")
    base = next(rest.split()[0] for word, rest in image.instructions() if word == "FROM")
    pulled = subprocess.run([docker, "pull", "--quiet", base], capture_output=True, text=True, check=False)
    if pulled.returncode != 0:
        pytest.skip(f"the engine does not get {base}: {pulled.stderr}")
    name = "kempf:tested"
    build = [docker, "build", "--quiet", "--file", image.DOCKERFILE, "--build-arg", f"KEMPF_COMMIT={COMMIT}", "--tag"]
    subprocess.run([*build, name, ROOT], check=True, capture_output=True)
    asks = "import os; from kempf.warehouse.code import code_version as c; print(os.getuid(), c.git_commit())"
    for command, said in (
        (["python", "-c", asks], f"1000 {COMMIT}"),
        (["kempf", "--version"], f"kempf, version {version()}"),
        (["python", "-c", "import shutil; print(shutil.which('gcc'))"], "None"),
    ):
        done = subprocess.run([docker, "run", "--rm", name, *command], check=True, capture_output=True, text=True)
        assert done.stdout.strip() == said
    if subprocess.run([docker, "compose", "version"], capture_output=True, check=False).returncode == 0:
        stated = {**os.environ, **secrets(Path("/srv/inbox"))}
        subprocess.run([docker, "compose", "--file", compose.FILE, "config", "--quiet"], env=stated, check=True)
