"""How far the parameters of a vessel move from the sets of one code to those of another. No storage here."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from math import inf, isfinite, isnan
from typing import Any

from kempf.schemas.instants import iso_utc
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse.tables.agreement import content_digest
from kempf.warehouse.tables.parameter_set import Bounds, ParameterSet, StoredValue


@dataclass(frozen=True)
class Move:
    """What becomes of one parameter of one set."""

    vessel: str
    model: str
    estimator: str
    parameter: str
    unit: str
    #: parameter_set_id, becomes: The set that stands, and the one that would take its place.
    parameter_set_id: str
    becomes: str
    #: Of its first segment, ISO 8601.
    start: str
    #: before, after: In ``unit``.
    before: float
    after: float
    #: Standard error of the value that stands, in ``unit``.
    std: float | None
    #: The move in that standard error. Both values are of the same data: much less than 1 is what a change that should
    #: not matter leaves.
    in_std: float | None
    #: New standard error over the old one.
    std_ratio: float | None

    @property
    def size(self) -> float:
        """Magnitude of the move in standard errors; infinite where it moved and has none, or became no number."""
        if self.in_std is not None and isfinite(self.in_std):
            return abs(self.in_std)
        return 0.0 if self.before == self.after or (isnan(self.before) and isnan(self.after)) else inf

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON content."""
        return asdict(self)


@dataclass(frozen=True)
class NewSet:
    """A set without a counterpart: its id, model, estimator and start."""

    parameter_set_id: str
    model: str
    estimator: str
    start: str

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON content."""
        return asdict(self)


@dataclass(frozen=True)
class PairedSets:
    """Sets of two codes held against each other, see `paired`."""

    identical: int
    moves: tuple[Move, ...]
    new: tuple[NewSet, ...]
    gone: tuple[str, ...]


def paired(old: Sequence[ParameterSet], now: Sequence[ParameterSet]) -> PairedSets:
    """Hold the sets of a vessel against those of the same model and estimator whose segments share most of their time.

    Parameters
    ----------
    old, now : sequence of ParameterSet
        Those that stand, and those of the present code. Each has at most one counterpart; more than half of the time
        of both together must be shared.

    Returns
    -------
    PairedSets
        Moves sorted by `Move.size`, the largest first.
    """
    closeness = sorted(
        (
            (
                -_shared(stored, other),
                stored.settings != other.settings,
                stored.parameter_set_id,
                other.parameter_set_id,
            )
            for stored in old
            for other in now
            if _kind(stored) == _kind(other) and _shared(stored, other) > 0.5
        ),
    )
    by_id = {stored.parameter_set_id: stored for stored in (*old, *now)}
    counterpart: dict[str, str] = {}
    taken: set[str] = set()
    for _, _, name, successor in closeness:
        if name not in counterpart and successor not in taken:
            counterpart[name] = successor
            taken.add(successor)
    identical, moves = 0, []
    for stored in old:
        if stored.parameter_set_id in counterpart:
            becomes = by_id[counterpart[stored.parameter_set_id]]
            same = _says(stored) == _says(becomes)
            identical += same
            moves += [] if same else list(_moves(stored, becomes))
    new = [o for o in now if o.parameter_set_id not in taken]
    return PairedSets(
        identical,
        tuple(sorted(moves, key=lambda m: (-m.size, m.parameter_set_id, m.parameter))),
        tuple(NewSet(o.parameter_set_id, o.model_name, o.estimator, iso_utc(o.start_utc_ns)) for o in new),
        tuple(stored.parameter_set_id for stored in old if stored.parameter_set_id not in counterpart),
    )


def _kind(parameter_set: ParameterSet) -> tuple[str, str]:
    # by the present code's reading of the model: a key that is new in it gives its hash another value
    return ModelSpec.model_validate(dict(parameter_set.model_spec)).sha256, parameter_set.estimator


def _says(stored: ParameterSet) -> str:
    """Return a digest of what a set says, without what it is called by."""
    return content_digest(replace(stored, segment_ids=(), model_sha256="", model_spec={}))


def _shared(parameter_set: ParameterSet, other: ParameterSet) -> float:
    """Return the time that the segments of two sets share over the time of both together."""
    ours, theirs = _bounds(parameter_set), _bounds(other)
    common = sum(
        max(0, min(a.end_utc_ns, b.end_utc_ns) - max(a.start_utc_ns, b.start_utc_ns))
        for a in ours
        for b in theirs
        if a.log_id == b.log_id
    )
    whole = sum(b.end_utc_ns - b.start_utc_ns for b in (*ours, *theirs)) - common
    return common / whole if whole else 0.0


def _bounds(parameter_set: ParameterSet) -> list[Bounds]:
    return [Bounds(**bounds) for bounds in parameter_set.provenance["inputs"]["segments"]]


def _moves(parameter_set: ParameterSet, becomes: ParameterSet) -> Iterator[Move]:
    after = {estimate.name: estimate for estimate in becomes.parameters}
    for before in parameter_set.parameters:
        now = after.get(before.name)
        if now is not None:
            yield _move(parameter_set, becomes, before, now)


def _move(parameter_set: ParameterSet, becomes: ParameterSet, before: StoredValue, now: StoredValue) -> Move:
    std = before.std if before.std is not None and before.std > 0 and isfinite(before.std) else None
    return Move(
        vessel=parameter_set.vessel,
        model=parameter_set.model_name,
        estimator=parameter_set.estimator,
        parameter=before.name,
        unit=before.unit,
        parameter_set_id=parameter_set.parameter_set_id,
        becomes=becomes.parameter_set_id,
        start=iso_utc(parameter_set.start_utc_ns),
        before=before.value,
        after=now.value,
        std=std,
        in_std=(now.value - before.value) / std if std else None,
        std_ratio=now.std / std if std and now.std is not None else None,
    )
