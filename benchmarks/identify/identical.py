"""Whether parameter sets and segments are still those of the reference, bit for bit.

``python -m benchmarks.identify.identical``.

For changes of the code that must not move a result: moves, renames, tidying. ``--write`` makes a new reference, which
belongs in the commit that is meant to move results and in no other. On another processor or with other libraries the
last digits may differ; then the comparison is by tolerance, and says so.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import platform
import sys
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from benchmarks import measured_ships, result_page
from kempf.flows.jobs.demo.demonstrate import demonstrate
from kempf.flows.jobs.identify.chosen_manoeuvres import choose
from kempf.flows.jobs.identify.identify_vessel import Request, identify_vessel
from kempf.flows.jobs.identify.pool_vessel import pool_vessel
from kempf.flows.jobs.identify.standing_model import Own
from kempf.flows.jobs.identify.vessel_model import store_model
from kempf.flows.jobs.ingest.files import read_model
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import segments
from kempf.warehouse.tables.parameter_set import ParameterSet

REFERENCE = result_page.RESULTS / "identical"
SOURCES = ("demo", "trials", "tank")
#: in standard errors, where bits cannot be compared
_TOLERANCE = 1e-3
_TANK = Path(__file__).parents[2] / "docs" / "models" / "tank.yaml"

Content = dict[str, Any]


def collect(source: str, data: Path) -> Content:
    """Identify the ships of one source; return their segments and parameter sets as JSON content."""
    with TemporaryDirectory() as folder:
        if source == "demo":
            vessels = [demonstrate(Path(folder)).vessel]
            warehouse = Warehouse(str(Path(folder) / "warehouse"))
            requests = (Request(),)
        else:
            warehouse = Warehouse(folder)
            ships = [measured_ships.tank(data)] if source == "tank" else measured_ships.fleet(data)
            for ship in ships:
                measured_ships.take_in(warehouse, ship)
            vessels = [ship.name for ship in ships]
            requests = (Request(), Request(read_model(_TANK))) if source == "tank" else (Request(),)
        found: Content = {}
        for vessel in vessels:
            for segment in segments.current(warehouse, vessel):
                key = f"{vessel}/{segment.log_id[:12]}/{segment.start_utc_ns}"
                found[f"segment {key}"] = _segment(segment.as_json(""))
            for request in requests:
                outcomes = identify_vessel(warehouse, vessel, request)
                pooled = pool_vessel(warehouse, vessel, request, outcomes)
                sets = [o.parameter_set for o in outcomes if o.parameter_set] + ([pooled[0]] if pooled else [])
                found |= dict(_sets(vessel, sets))
            if source == "demo":
                spec = ModelSpec().model_copy(update={"effects": ("rudder_lag",)})
                found |= dict(_sets(vessel, [store_model(warehouse, choose(warehouse, vessel), spec, Own())[0]]))
    return found


def _segment(shown: Content) -> Content:
    """Bounds and executes as they are, everything else by its hash."""
    content = {name: value for name, value in shown.items() if name not in ("segment_id", "log_id", "ingest_id")}
    digest = hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
    return {"start": shown["start"], "end": shown["end"], "executes": shown["executes"], "sha256": digest}


def _sets(vessel: str, sets: list[ParameterSet]) -> Iterator[tuple[str, Content]]:
    for one in sets:
        kind = f"{one.model_name} {one.estimator}".replace("linear ", "plain ")
        yield (
            f"set {vessel}/{kind}/{' '.join(log[:6] for log in one.log_ids)}/{one.start_utc_ns}",
            {
                "parameters": {p.name: [p.value, p.std] for p in one.parameters},
                "noise": {p.name: [p.value, p.std] for p in one.noise},
                "covariance": hashlib.sha256(np.array(one.covariance, dtype=np.float64).tobytes()).hexdigest(),
                "converged": one.convergence.get("converged"),
            },
        )


def machine() -> Content:
    """Return what bits depend on beside the code."""
    libraries = {name: version(name) for name in (*result_page.LIBRARIES, "llvmlite")}
    libc = " ".join(platform.libc_ver())
    return {"processor": _processor(), "libc": libc, "python": platform.python_version(), **libraries}


def _processor() -> str:
    """Return the name of the processor with family, model and stepping, and a digest of what it can do.

    One name may stand for several of them, and a virtual machine may hide vector instructions that another has:
    kernels are then compiled otherwise, and sums end in other last digits.
    """
    known: dict[str, str] = {}
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        name, _, value = line.partition(":")
        known.setdefault(name.strip(), value.strip())
    found = [known[name] for name in ("model name", "cpu family", "model", "stepping") if name in known]
    able = hashlib.sha256(" ".join(sorted(known.get("flags", "").split())).encode()).hexdigest()[:8]
    return " ".join((*found, able)) if found else platform.machine()


def differences(reference: Content, found: Content, *, bits: bool) -> list[str]:
    """Return what differs, a line each; with ``bits`` False only what differs by more than the tolerance."""
    lines = [f"missing: {name}" for name in sorted(reference.keys() - found.keys())]
    lines += [f"new: {name}" for name in sorted(found.keys() - reference.keys())]
    for name in sorted(reference.keys() & found.keys()):
        before, after = reference[name], json.loads(json.dumps(found[name]))
        if name.startswith("segment"):
            lines += [f"{name}: {k}" for k in before.keys() | after.keys() if before.get(k) != after.get(k) and bits]
            continue
        for group in ("parameters", "noise"):
            for key in sorted(before[group].keys() | after[group].keys()):
                a, b = before[group].get(key), after[group].get(key)
                if a != b and (bits or a is None or b is None or _far(a, b)):
                    lines.append(f"{name}: {key} was {a}, is {b}")
        if bits and before["covariance"] != after["covariance"]:
            lines.append(f"{name}: covariance")
        if before["converged"] != after["converged"]:
            lines.append(f"{name}: converged was {before['converged']}, is {after['converged']}")
    return lines


def _far(before: list[float | None], after: list[float | None]) -> bool:
    (a, s), (b, _) = before, after
    if a is None or b is None:
        return a is not b
    return abs(a - b) > _TOLERANCE * (s or abs(a))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sources", nargs="*", default=SOURCES, help=f"of {', '.join(SOURCES)}")
    parser.add_argument("--data", type=Path, default=result_page.DATA)
    parser.add_argument("--write", action="store_true", help="make a new reference")
    options = parser.parse_args()
    failed = False
    for source in options.sources:
        path = REFERENCE / f"{source}.json"
        found = collect(source, options.data)
        if options.write:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(json.dumps({"machine": machine(), "found": found}, indent=1, sort_keys=True) + "\n")
            print(f"{source}: {len(found)} segments and parameter sets written to {path}")
            continue
        stored = json.loads(path.read_text())
        bits = stored["machine"] == machine()
        lines = differences(stored["found"], found, bits=bits)
        how = "bit for bit" if bits else f"within {_TOLERANCE:g} standard errors (another processor or library)"
        print(f"{source}: {len(found)} segments and parameter sets, {len(lines)} differences {how}")
        print("\n".join(lines[:40]))
        failed |= bool(lines)
    sys.exit(failed)


if __name__ == "__main__":
    main()
