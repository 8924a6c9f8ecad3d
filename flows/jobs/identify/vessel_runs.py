"""All manoeuvres of a vessel as identification, diagnosis and comparison take them, with ships to start from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from kempf.flows.jobs.identify.chosen_manoeuvres import Chosen
from kempf.flows.jobs.identify.loads_of_logs import in_order, logs_in_order
from kempf.flows.jobs.identify.parameter_set_of import arm_of
from kempf.flows.jobs.ingest.log_channels import channels_of
from kempf.flows.process.progress import Progress, silent
from kempf.pipeline.channels.found_instants import FoundInstants
from kempf.pipeline.channels.instruments import Instruments
from kempf.pipeline.estimate.record.average import step_of
from kempf.pipeline.estimate.record.cut import make_record
from kempf.pipeline.estimate.record.grid_run import GridRun, ShipConstants, make_run, with_common_slip
from kempf.pipeline.estimate.record.loads import loads
from kempf.pipeline.estimate.record.record import Record
from kempf.schemas.errors import KempfError, NotFound
from kempf.schemas.model_spec import ModelSpec
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import vessels
from kempf.warehouse.tables.parameter_set import Bounds

#: where the profile has no length; only the scale of non-dimensional coefficients depends on it
LENGTH_M = 100.0


@dataclass(frozen=True, eq=False)
class VesselRuns:
    """What a vessel's logs hold, ready for a model."""

    #: With the arm and the moment decided.
    spec: ModelSpec
    #: In order of time; named by their segments.
    runs: tuple[GridRun, ...]
    #: What the runs were made of.
    records: tuple[Record, ...]
    #: Why a segment is no run, by its id.
    skipped: dict[str, str]


@dataclass(frozen=True)
class Like:
    """What further runs of a vessel are to share with those that a model was fitted to."""

    #: See `pipeline.estimate.record.average.step_of`.
    grid_step_s: float
    #: See `pipeline.estimate.record.grid_run.common_slip`.
    slip_m: float | None


@dataclass(frozen=True, eq=False)
class RunLayout:
    """What runs are laid out from; its fields are the parameters of `assemble`."""

    instruments: Mapping[str, Instruments]
    profile: VesselProfile
    bounds: Sequence[tuple[str, Bounds]]
    spec: ModelSpec
    like: Like | None
    laden: Mapping[str, float]
    #: Why a segment is none of these, by its id.
    skipped: Mapping[str, str]

    @property
    def logs(self) -> list[str]:
        """The logs in the order of their numbers."""
        return logs_in_order(self.bounds)

    def runs(self) -> VesselRuns:
        """Lay the runs out."""
        made = assemble(self.instruments, self.profile, self.bounds, self.spec, self.like, self.laden)
        return replace(made, skipped={**self.skipped, **made.skipped})

    def moved(self, found: Mapping[int, FoundInstants]) -> RunLayout:
        """Return the same with the logs at instants of measurement that were found, by number of the log."""
        logs, instruments = self.logs, dict(self.instruments)
        for day, instants in found.items():
            instruments[logs[day]] = instruments[logs[day]].moved(instants)
        return replace(self, instruments=instruments)

    def runs_at(self, found: Mapping[int, FoundInstants]) -> tuple[GridRun, ...]:
        """Lay the runs out at instants that were found, as `pipeline.diagnose.screening.found_instants` asks for it."""
        return self.moved(found).runs().runs


def assembled(
    warehouse: Warehouse, chosen: Chosen, spec: ModelSpec, progress: Progress = silent, like: Like | None = None
) -> VesselRuns:
    """Read the chosen segments from the warehouse and make runs of them; see `assemble`."""
    return layout_of(warehouse, chosen, spec, progress, like).runs()


def layout_of(
    warehouse: Warehouse, chosen: Chosen, spec: ModelSpec, progress: Progress = silent, like: Like | None = None
) -> RunLayout:
    """Read the chosen segments from the warehouse."""
    instruments = {}
    for done, (log_id, ingest_id) in enumerate(chosen.ingests.items()):
        progress(done, len(chosen.ingests), f"reading {chosen.file_names[log_id]}")
        instruments[log_id] = channels_of(warehouse, ingest_id)
    progress(len(chosen.ingests), len(chosen.ingests), "laying the manoeuvres out")
    profile = vessels.get(warehouse, chosen.profile_sha256)
    bounds = [(s.segment_id, Bounds(s.log_id, s.start_utc_ns, s.end_utc_ns)) for s in chosen.segments]
    return RunLayout(instruments, profile, bounds, spec, like, chosen.loads, chosen.skipped)


def assemble(
    instruments: Mapping[str, Instruments],
    profile: VesselProfile,
    bounds: Sequence[tuple[str, Bounds]],
    spec: ModelSpec,
    like: Like | None = None,
    laden: Mapping[str, float] | None = None,
) -> VesselRuns:
    """Make runs of segments; a function of its arguments alone, so that a rerun makes the same.

    Parameters
    ----------
    instruments : mapping of str to Instruments
        Series by log.
    bounds : sequence of (str, Bounds)
        Segments with their names.
    like : Like, optional
        What they are to share with other runs of the vessel.
    laden : mapping of str to float, optional
        Load by log, see `pipeline.estimate.record.loads`; by default the number of the log among these.

    Raises
    ------
    NotFound
        ``no_runs``.
    """
    records, skipped = [], {}
    for name, stretch in in_order(bounds):
        try:
            records.append(
                (name, stretch, make_record(instruments[stretch.log_id], stretch.start_utc_ns, stretch.end_utc_ns))
            )
        except KempfError as error:
            skipped[name] = str(error)
    if not records:
        raise NotFound(
            "no_runs",
            f"None of the {len(bounds)} manoeuvres can be used: "
            + "; ".join(f"{name}: {why}" for name, why in sorted(skipped.items())[:5]),
            "See docs/bad_input.md for every reason and what to do about it.",
            {"skipped": skipped},
        )
    arm = arm_of(spec, profile)
    ready = spec.with_arm(arm)
    ship = ShipConstants(profile.length_m or LENGTH_M, profile.draught_m or 1.0, arm or 0.0)
    step = like.grid_step_s if like else step_of([record for _, _, record in records], profile.length_m)
    order = logs_in_order(bounds)
    load = laden or loads(order, {})
    days = {log_id: day for day, log_id in enumerate(order)}
    runs = with_common_slip(
        [
            make_run(
                name, record, instruments[stretch.log_id], ready, ship, step, days[stretch.log_id], load[stretch.log_id]
            )
            for name, stretch, record in records
        ],
        like.slip_m if like else None,
    )
    return VesselRuns(ready, runs, tuple(record for _, _, record in records), skipped)
