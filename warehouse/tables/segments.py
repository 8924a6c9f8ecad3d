"""Manoeuvres found in the logs. Finding them again in an ingest replaces what was found in it before."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from typing import Any

from orjson import loads

from kempf.schemas.errors import NotFound, UsageError
from kempf.schemas.instants import iso_utc
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.canonical import canonical_json, plain, sha256
from kempf.warehouse.storage.keys import one_of, vessel_key
from kempf.warehouse.storage.query_cache import cached
from kempf.warehouse.storage.retry import with_retry
from kempf.warehouse.storage.scan import Where
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import logs, vessels

_JSON = ("imo", "quality", "detail")

_ZIGZAGS = ("zigzag", "zigzag_broken_off")

#: Kinds a model is fitted to; every other one is kept to be looked at and to validate on.
_FITTED = (*_ZIGZAGS, "random_manoeuvre")


def segment_id(log_id: str, kind: str, start_utc_ns: int, end_utc_ns: int) -> str:
    """Return the id of a segment, ``seg-`` and 16 hex digits: the log, what it is, and its bounds."""
    return "seg-" + sha256(canonical_json([log_id, kind, start_utc_ns, end_utc_ns]))[:16]


@dataclass(frozen=True)
class Segment:
    """One manoeuvre, as stored."""

    segment_id: str
    vessel: str
    log_id: str
    ingest_id: str
    kind: str
    #: psi0_deg, delta0_deg: Nominal heading deviation and rudder angle, deg. Only a zigzag has the first, NaN else.
    psi0_deg: float
    delta0_deg: float
    first_side: str
    #: Heading before the first execute, deg.
    base_heading_deg: float
    start_utc_ns: int
    end_utc_ns: int
    #: Instants of the executes, UTC nanoseconds.
    executes_utc_ns: tuple[int, ...]
    #: Overshoot angles beyond the nominal heading deviation, deg.
    overshoots_deg: tuple[float, ...]
    code_version: str
    #: Why a person excluded it; None where it counts.
    excluded: str | None = None
    #: imo, quality, detail: JSON content; what is not finite becomes null.
    imo: Mapping[str, Any] = field(default_factory=dict)
    quality: Mapping[str, Any] = field(default_factory=dict)
    detail: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in _JSON:
            object.__setattr__(self, name, plain(getattr(self, name)))
        object.__setattr__(self, "executes_utc_ns", tuple(int(t) for t in self.executes_utc_ns))
        object.__setattr__(self, "overshoots_deg", tuple(float(a) for a in self.overshoots_deg))

    @classmethod
    def restored(cls, **columns: Any) -> Segment:
        """Make a segment of what was stored of one: that was made plain then, which costs too much for thousands."""
        segment = cls.__new__(cls)
        vars(segment).update(columns)
        return segment

    @property
    def own_time(self) -> bool:
        """Whether her log has the time itself, rather than counting from a stated start or from being switched on."""
        return self.detail.get("own_time") is not False

    @property
    def is_zigzag(self) -> bool:
        """Whether it is a zigzag, complete or not."""
        return self.kind in _ZIGZAGS

    @property
    def is_fitted(self) -> bool:
        """Whether models are fitted to it."""
        return self.kind in _FITTED

    @property
    def words(self) -> str:
        """What it is, in words: ``20/20 zigzag``, ``turning circle``."""
        angles = f"{self.psi0_deg:g}/{self.delta0_deg:g} " if self.is_zigzag else ""
        return angles + self.kind.replace("_", " ")

    def as_json(self, file_name: str) -> dict[str, Any]:
        """Return the segment as the command line's JSON object.

        Parameters
        ----------
        file_name : str
            Name of the log it was found in.
        """
        shown = {
            "segment_id": self.segment_id,
            "vessel": self.vessel,
            "log": file_name,
            "kind": self.kind,
            "psi0_deg": self.psi0_deg,
            "delta0_deg": self.delta0_deg,
            "first_side": self.first_side,
            "base_heading_deg": self.base_heading_deg,
            "start": iso_utc(self.start_utc_ns),
            "end": iso_utc(self.end_utc_ns),
            "executes": [iso_utc(t) for t in self.executes_utc_ns],
            "overshoots_deg": self.overshoots_deg,
            "imo": self.imo,
            "quality": self.quality,
            "detail": self.detail,
            "excluded": self.excluded,
            "log_id": self.log_id,
            "ingest_id": self.ingest_id,
        }
        result: dict[str, Any] = plain(shown)
        return result


def replace(warehouse: Warehouse, manoeuvres: Mapping[tuple[str, str], Sequence[Segment]]) -> tuple[str, ...]:
    """Put what was found in some ingests, of any vessels, in place of what is stored of them, in at most one commit.

    Parameters
    ----------
    warehouse : Warehouse
        Made where there is none.
    manoeuvres : mapping of (str, str) to sequence of Segment
        By vessel and ingest id; an empty sequence says that nothing was found.

    Returns
    -------
    tuple of str
        Ingests whose segments changed, sorted; none, and no commit, where the same is stored already.

    Raises
    ------
    ValueError
        A segment names another vessel or ingest than it is given for.
    """
    keys = {vessel: vessel_key(vessel) for vessel, _ in manoeuvres}
    for (vessel, ingest), segments in manoeuvres.items():
        for segment in segments:
            if (segment.vessel, segment.ingest_id) != (vessel, ingest):
                raise ValueError(f"{segment.segment_id} is of {segment.vessel!r}, {segment.ingest_id}: not {ingest}")
    of_ingest = {ingest: (keys[vessel], segments) for (vessel, ingest), segments in manoeuvres.items()}

    def attempt() -> tuple[str, ...]:
        with delta.ensured(warehouse, "segments") as table:
            of_vessel: Where = {"vessel_key": sorted(keys.values()), "ingest_id": sorted(of_ingest)}
            known: dict[str, list[Segment]] = {}
            for row in delta.rows(table, "segments", of_vessel).rows(named=True):
                known.setdefault(row["ingest_id"], []).append(_segment(row))
            changed = tuple(
                ingest
                for ingest, (_, segments) in sorted(of_ingest.items())
                if _text(segments) != _text(known.get(ingest, ()))
            )
            if changed:
                rows = [_as_columns(segment) for ingest in changed for segment in _sorted(of_ingest[ingest][1])]
                whose = {of_ingest[ingest][0] for ingest in changed}
                predicate = f"{one_of('vessel_key', whose)} AND {one_of('ingest_id', changed)}"
                delta.replace(table, "segments", rows, predicate)
            return changed

    return with_retry(attempt) if manoeuvres else ()


def current(warehouse: Warehouse, vessel: str | None = None) -> list[Segment]:
    """Return what models are fitted to: of the current ingest of each log, what nobody excluded, by start, then id.

    Whatever is fitted, pooled, diagnosed or compared asks here, so that no turning circle is ever fitted by accident.

    Parameters
    ----------
    warehouse : Warehouse
        Where they are.
    vessel : str, optional
        Of this vessel only; of all by default.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_vessel``.
    """
    return [segment for segment in every(warehouse, vessel) if segment.is_fitted]


def every(warehouse: Warehouse, vessel: str | None = None) -> list[Segment]:
    """Return the manoeuvres of every kind found in the current ingest of each log that nobody excluded.

    They are sorted by start, then id.

    Parameters
    ----------
    warehouse : Warehouse
        Where they are.
    vessel : str, optional
        Of this vessel only; of all by default.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_vessel``.
    """
    return [segment for segment in found_in(warehouse, vessel) if segment.excluded is None]


def found_in(warehouse: Warehouse, vessel: str | None = None) -> list[Segment]:
    """Return the manoeuvres of every kind found in the current ingest of each log, also those that were excluded.

    They are sorted by start, then id.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_vessel``.
    """
    if vessel is None:
        return _found_in(warehouse, None)
    vessels.require(warehouse, vessel)
    tables = ("logs", "segments")
    return list(cached(warehouse, tables, ("manoeuvres", vessel), partial(_found_in, warehouse, vessel)))


def _found_in(warehouse: Warehouse, vessel: str | None) -> list[Segment]:
    return of_ingests(warehouse, [row.ingest_id for row in logs.current(warehouse, vessel)], vessel)


def of_ingests(warehouse: Warehouse, ingests: Sequence[str], vessel: str | None = None) -> list[Segment]:
    """Return the manoeuvres of every kind found in some ingests, of one vessel or of any, sorted by start, then id."""
    of_vessel = {} if vessel is None else {"vessel_key": vessel_key(vessel)}
    frame = delta.read(warehouse, "segments", {**of_vessel, "ingest_id": list(ingests)})
    return _sorted([_segment(row) for row in frame.rows(named=True)])


def by_ids(warehouse: Warehouse, vessel: str, names: Collection[str]) -> dict[str, Segment]:
    """Return some segments of a vessel by id, whatever ingest they were found in; one that is not stored is left out.

    Raises
    ------
    NotFound
        ``no_warehouse``.
    """
    frame = delta.read(warehouse, "segments", {"vessel_key": vessel_key(vessel), "segment_id": sorted(set(names))})
    return {
        segment.segment_id: segment for segment in map(_segment, frame.sort("segment_id", "ingest_id").rows(named=True))
    }


def get(warehouse: Warehouse, name: str) -> Segment:
    """Return a segment of a current ingest by its id, of whatever kind, excluded or not.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_segment``.
    """
    segments = [segment for segment in found_in(warehouse) if segment.segment_id == name]
    if not segments:
        raise _no_segment(warehouse, name)
    return segments[0]


def by_prefix(warehouse: Warehouse, name: str) -> Segment:
    """Return a segment of a current ingest by a beginning of its id, excluded or not.

    Raises
    ------
    NotFound
        ``no_warehouse``, ``no_segment``.
    UsageError
        ``ambiguous_segment``: several fit.
    """
    ids = delta.read(warehouse, "segments", columns=("segment_id", "vessel"))
    whose = ids.filter(ids["segment_id"].str.starts_with(name))["vessel"].unique().sort().to_list() if name else []
    known = {row.vessel for row in logs.current(warehouse)} if whose else set()
    every = [segment for vessel in whose if vessel in known for segment in found_in(warehouse, vessel)]
    segments = [segment for segment in every if segment.segment_id == name] or [
        segment for segment in every if segment.segment_id.startswith(name)
    ]
    if not segments:
        raise _no_segment(warehouse, name)
    if len(segments) > 1:
        raise UsageError(
            "ambiguous_segment",
            f"{len(segments)} segments fit {name!r}: {', '.join(segment.segment_id for segment in segments[:5])}.",
            "Give more of the id.",
            {"segment_id": name, "found": [segment.segment_id for segment in segments]},
        )
    return segments[0]


def _no_segment(warehouse: Warehouse, name: str) -> NotFound:
    return NotFound(
        "no_segment",
        f"There is no segment {name!r} in {warehouse.uri}.",
        "List the segments with `kempf segments`.",
        {"segment_id": name},
    )


def _sorted(segments: Sequence[Segment]) -> list[Segment]:
    return sorted(segments, key=lambda s: (s.start_utc_ns, s.segment_id))


def _text(segments: Sequence[Segment]) -> str:
    return canonical_json([asdict(segment) for segment in _sorted(segments)], name_non_finite=True)


def _as_columns(segment: Segment) -> dict[str, Any]:
    columns = {**asdict(segment), "vessel_key": vessel_key(segment.vessel)}
    texts = {f"{name}_json": canonical_json(columns.pop(name)) for name in _JSON}
    return {**columns, **texts}


def _segment(row: dict[str, Any]) -> Segment:
    contents = {name: loads(row.pop(f"{name}_json")) for name in _JSON}
    del row["vessel_key"]
    rows = {name: tuple(row.pop(name)) for name in ("executes_utc_ns", "overshoots_deg")}
    return Segment.restored(**row, **rows, **contents)
