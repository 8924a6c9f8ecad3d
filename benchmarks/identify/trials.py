"""Sixteen trial logs of eight ships through the main job: ledgers, zigzags, identification, rerun; a picture a ship.

Executes are compared with an estimate that shares no code with the job: the logs are read by the small readers of
`tests.segment.loading`, and the start of a rudder movement is taken from when it is half way.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks import measured_ships, result_page
from benchmarks.identify import plausibility
from benchmarks.identify.draw_ship import Day, draw_ship
from benchmarks.measured_ships import Ship
from kempf.flows.jobs.identify.identify_vessel import IdentifyOutcome, identify_vessel
from kempf.flows.jobs.ingest.files import read_profiles
from kempf.flows.jobs.ingest.ingest_logs import IngestOutcome
from kempf.flows.jobs.ingest.log_channels import channels_of
from kempf.flows.jobs.reprocess.rerun_set import Rerun, rerun
from kempf.schemas.model_spec import HULL_PARAMETERS
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables.parameter_set import ParameterSet
from tests.segment import loading
from tests.segment.test_measured import independent_start


@dataclass(frozen=True)
class Voyage:
    """What became of one ship's logs."""

    ship: Ship
    taken: list[IngestOutcome]
    identified: list[IdentifyOutcome]
    reruns: list[Rerun]
    execute_errors_s: dict[str, float]


def sail(warehouse: Warehouse, ship: Ship, data: Path, pictures: Path | None = None) -> Voyage:
    """Run the main job on one ship's logs, rebuild every set, draw her."""
    taken = measured_ships.take_in(warehouse, ship)
    identified = identify_vessel(warehouse, ship.name)
    reruns = [rerun(warehouse, o.parameter_set.parameter_set_id) for o in identified if o.parameter_set]
    loading.SHARED = data
    errors: dict[str, float] = {}
    for path, outcome in zip(ship.logs, taken, strict=True):
        log = loading.load(str(path.relative_to(data)))
        for segment in outcome.segments:
            late = [independent_start(log, ns) for ns in segment.executes_utc_ns]
            errors[segment.segment_id] = float(np.max(np.abs(late)))
    if pictures is not None:
        days = [
            Day(path.name, channels_of(warehouse, str(outcome.ingest_id)), outcome.segments)
            for path, outcome in zip(ship.logs, taken, strict=True)
        ]
        draw_ship(ship.name, days, pictures / f"{ship.name}.png")
    return Voyage(ship, taken, identified, reruns, errors)


def ledgers(voyages: list[Voyage]) -> list[str]:
    """Table of what was read, kept and rejected."""
    rows = []
    for voyage in voyages:
        for path, outcome in zip(voyage.ship.logs, voyage.taken, strict=True):
            tally = outcome.tally
            if tally is None:
                rows.append([voyage.ship.name, path.name, f"**failed**: {outcome.error}", *[""] * 4])
                continue
            why = ", ".join(f"{reason} {n}" for reason, n in sorted(tally.by_reason.items()))
            rows.append(
                [
                    voyage.ship.name,
                    path.name,
                    f"{tally.records_read} = {tally.records_kept} + {tally.records_rejected}",
                    f"{tally.values_read} = {tally.values_kept} + {tally.values_rejected}",
                    "yes" if closes(outcome) else "**no**",
                    why,
                    str(len(outcome.segments)),
                ]
            )
    head = ["ship", "log", "records read = kept + rejected", "values read = kept + rejected", "closes", "rejected, why"]
    return result_page.table([*head, "zigzags"], rows)


def closes(outcome: IngestOutcome) -> bool:
    """Whether both ledgers of a log close."""
    tally = outcome.tally
    return (
        tally is not None
        and tally.records_read == tally.records_kept + tally.records_rejected
        and tally.values_read == tally.values_kept + tally.values_rejected
    )


def zigzags(voyages: list[Voyage]) -> list[str]:
    """Table of the zigzags."""
    rows = []
    for voyage in voyages:
        named = {o.log_id: path.name for path, o in zip(voyage.ship.logs, voyage.taken, strict=True)}
        for outcome in voyage.identified:
            s = outcome.segment
            rows.append(
                [
                    voyage.ship.name,
                    named[s.log_id],
                    f"{s.psi0_deg:g}/{s.delta0_deg:g}",
                    s.first_side,
                    f"{s.base_heading_deg:.1f}",
                    str(len(s.executes_utc_ns)),
                    f"{voyage.execute_errors_s[s.segment_id]:.2f}",
                    ", ".join(f"{a:.1f}" for a in s.overshoots_deg),
                    " ".join(s.quality["reasons"]),
                ]
            )
    head = ["ship", "log", "psi0/delta0", "first side", "K0, deg", "executes", "largest difference, s"]
    return result_page.table([*head, "overshoots beyond psi0, deg", "said of it"], rows)


def sets(voyages: list[Voyage]) -> list[str]:
    """Table of the parameter sets."""
    rows = []
    for voyage in voyages:
        length = _length(voyage.ship)
        for outcome in voyage.identified:
            s, made = outcome.segment, outcome.parameter_set
            title = [voyage.ship.name, f"{s.psi0_deg:g}/{s.delta0_deg:g}"]
            if made is None:
                rows.append([*title, f"none: {outcome.error}", *[""] * 8])
                continue
            state = "converged" if made.convergence.get("converged") else f"not converged: {made.convergence['reason']}"
            said = [w for w in made.warnings if not w.startswith("not converged")]
            rows.append([*title, state, *_cells(made, length), "; ".join(said), "; ".join(plausibility.odd(made))])
    head = ["ship", "zigzag", "search", *(f"{p}'" for p in HULL_PARAMETERS)]
    return result_page.table([*head, "warnings of the set", "odd"], rows)


def _length(ship: Ship) -> float:
    return read_profiles(ship.profiles).length_m or float("nan")


def _cells(made: ParameterSet, length_m: float) -> list[str]:
    value, std = plausibility.values(made)
    factor = plausibility.scale(length_m)
    return [f"{v:.2f} ± {s:.2f}" for v, s in zip(value * factor, std * factor, strict=True)]


def page(voyages: list[Voyage]) -> list[str]:
    """Lines of the page."""
    taken = [o for v in voyages for o in v.taken]
    identified = [o for v in voyages for o in v.identified]
    reruns = [r for v in voyages for r in v.reruns]
    converged = sum(bool(o.parameter_set and o.parameter_set.convergence.get("converged")) for o in identified)
    same = sum(r.verdict == "bit-identical" for r in reruns)
    worst = max(e for v in voyages for e in v.execute_errors_s.values())
    n_executes = sum(len(o.segment.executes_utc_ns) for o in identified)
    return [
        f"**{sum(o.outcome == 'new' for o in taken)} of {len(taken)} logs in, ledgers of {sum(map(closes, taken))} "
        f"close. {len(identified)} zigzags, {n_executes} executes, none farther than {worst:.2f} s from an independent "
        f"estimate (wanted: 1 s). Converged: {converged} of {len(identified)}. Rebuilt from the raw bytes: {same} of "
        f"{len(reruns)} parameter sets bit-identical.**",
        "",
        "## Logs",
        "",
        *ledgers(voyages),
        "",
        "## Zigzags",
        "",
        *zigzags(voyages),
        "",
        "## Parameter sets",
        "",
        "Nondimensional with the length and the ship's own speed; ± is one standard error.",
        "",
        *sets(voyages),
        "",
        "## Pictures",
        "",
        *(f"![{v.ship.name}](trials/{v.ship.name}.png)\n" for v in voyages),
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=result_page.DATA)
    options = parser.parse_args()
    pictures = result_page.RESULTS / "trials"
    pictures.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory() as folder:
        voyages = [sail(Warehouse(folder), ship, options.data, pictures) for ship in measured_ships.fleet(options.data)]
    path = result_page.write("identify.trials", "Sixteen trial logs of eight ships", page(voyages))
    print(path.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
