"""How far the parameters of a vessel move from the sets of one code to those of another. No storage here."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from math import inf, isfinite, isnan
from typing import Any

from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse.agreement import content_digest
from kempf.warehouse.instant import iso_utc
from kempf.warehouse.parameter_set import Bounds, ParameterSet, StoredValue


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

    def show(self) -> dict[str, Any]:
        """Return it as JSON content."""
        return asdict(self)


@dataclass(frozen=True)
class NewSet:
    """A set without a counterpart: its id, model, estimator and start."""

    parameter_set_id: str
    model: str
    estimator: str
    start: str

    def show(self) -> dict[str, Any]:
        """Return it as JSON content."""
        return asdict(self)


@dataclass(frozen=True)
class Paired:
    """Sets of two codes held against each other, see `paired`."""

    identical: int
    moves: tuple[Move, ...]
    new: tuple[NewSet, ...]
    gone: tuple[str, ...]


def paired(old: Sequence[ParameterSet], now: Sequence[ParameterSet]) -> Paired:
    """Hold the sets of a vessel against those of the same model and estimator whose segments share most of their time.

    Parameters
    ----------
    old, now : sequence of ParameterSet
        Those that stand, and those of the present code. Each has at most one counterpart; more than half of the time
        of both together must be shared.

    Returns
    -------
    Paired
        Moves sorted by `Move.size`, the largest first.
    """
    closeness = sorted(
        (
            (-_shared(one, other), one.settings != other.settings, one.parameter_set_id, other.parameter_set_id)
            for one in old
            for other in now
            if _kind(one) == _kind(other) and _shared(one, other) > 0.5
        ),
    )
    by_id = {one.parameter_set_id: one for one in (*old, *now)}
    counterpart: dict[str, str] = {}
    taken: set[str] = set()
    for _, _, name, successor in closeness:
        if name not in counterpart and successor not in taken:
            counterpart[name] = successor
            taken.add(successor)
    identical, moves = 0, []
    for one in old:
        if one.parameter_set_id in counterpart:
            becomes = by_id[counterpart[one.parameter_set_id]]
            same = _says(one) == _says(becomes)
            identical += same
            moves += [] if same else list(_moves(one, becomes))
    new = [o for o in now if o.parameter_set_id not in taken]
    return Paired(
        identical,
        tuple(sorted(moves, key=lambda m: (-m.size, m.parameter_set_id, m.parameter))),
        tuple(NewSet(o.parameter_set_id, o.model_name, o.estimator, iso_utc(o.start_utc_ns)) for o in new),
        tuple(one.parameter_set_id for one in old if one.parameter_set_id not in counterpart),
    )


def _kind(one: ParameterSet) -> tuple[str, str]:
    # by the present code's reading of the model: a key that is new in it gives its hash another value
    return ModelSpec.model_validate(dict(one.model_spec)).sha256, one.estimator


def _says(one: ParameterSet) -> str:
    """Return a digest of what a set says, without what it is called by."""
    return content_digest(replace(one, segment_ids=(), model_sha256="", model_spec={}))


def _shared(one: ParameterSet, other: ParameterSet) -> float:
    """Return the time that the segments of two sets share over the time of both together."""
    ours, theirs = _bounds(one), _bounds(other)
    common = sum(
        max(0, min(a.end_utc_ns, b.end_utc_ns) - max(a.start_utc_ns, b.start_utc_ns))
        for a in ours
        for b in theirs
        if a.log_id == b.log_id
    )
    whole = sum(b.end_utc_ns - b.start_utc_ns for b in (*ours, *theirs)) - common
    return common / whole if whole else 0.0


def _bounds(one: ParameterSet) -> list[Bounds]:
    return [Bounds(**bounds) for bounds in one.provenance["inputs"]["segments"]]


def _moves(one: ParameterSet, becomes: ParameterSet) -> Iterator[Move]:
    after = {estimate.name: estimate for estimate in becomes.parameters}
    for before in one.parameters:
        now = after.get(before.name)
        if now is not None:
            yield _move(one, becomes, before, now)


def _move(one: ParameterSet, becomes: ParameterSet, before: StoredValue, now: StoredValue) -> Move:
    std = before.std if before.std is not None and before.std > 0 and isfinite(before.std) else None
    return Move(
        vessel=one.vessel,
        model=one.model_name,
        estimator=one.estimator,
        parameter=before.name,
        unit=before.unit,
        parameter_set_id=one.parameter_set_id,
        becomes=becomes.parameter_set_id,
        start=iso_utc(one.start_utc_ns),
        before=before.value,
        after=now.value,
        std=std,
        in_std=(now.value - before.value) / std if std else None,
        std_ratio=now.std / std if std and now.std is not None else None,
    )
