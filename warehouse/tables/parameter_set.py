"""One identified model as it is kept: immutable, and named by what produced it. No storage here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import hypot, nan
from typing import Any

from orjson import OPT_SORT_KEYS, dumps

from kempf.schemas.instants import iso_utc
from kempf.warehouse.storage.canonical import canonical_json, plain, sha256

_CONTENTS = ("model_spec", "settings", "fit", "iterations", "convergence", "provenance")
_SEQUENCES = ("segment_ids", "log_ids", "parameters", "discrete", "noise", "covariance_names", "warnings")


@dataclass(frozen=True)
class StoredValue:
    """One parameter or noise level: value and standard error (None where there is none) in ``unit``."""

    name: str
    value: float
    std: float | None
    unit: str


@dataclass(frozen=True)
class Bounds:
    """Which part of which log, UTC nanoseconds."""

    log_id: str
    start_utc_ns: int
    end_utc_ns: int


@dataclass(frozen=True)
class Inputs:
    """All that a parameter set is a function of."""

    #: SHA-256 of the logs; kept sorted.
    log_ids: tuple[str, ...]
    #: Hash of the vessel profile.
    profile_sha256: str
    #: The segments; kept sorted by log, then start.
    bounds: tuple[Bounds, ...]
    #: The model specification as JSON content.
    model_spec: Mapping[str, Any]
    #: Its name.
    estimator: str
    #: Of the estimator, JSON content.
    settings: Mapping[str, Any]
    #: Fingerprint of the code that reads logs and estimates: stage ``estimate`` of `kempf.warehouse.code.code_version`.
    code_version: str
    #: Segments that say something of these without being identified themselves; kept sorted likewise.
    companions: tuple[Bounds, ...] = ()
    #: Draught by log, m, of a model that goes by it.
    draughts_m: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "log_ids", tuple(sorted(set(self.log_ids))))
        for name in ("bounds", "companions"):
            ordered = sorted(getattr(self, name), key=lambda b: (b.log_id, b.start_utc_ns, b.end_utc_ns))
            object.__setattr__(self, name, tuple(ordered))

    def as_json(self) -> dict[str, Any]:
        """Return the inputs as JSON content; what is not finite is named, as a bound may be infinite."""
        content: dict[str, Any] = plain(self._content, name_non_finite=True)
        return content

    def canonical_json(self) -> str:
        """Return the one JSON text of the inputs."""
        return canonical_json(self._content, name_non_finite=True)

    @property
    def _content(self) -> dict[str, Any]:
        companions = {"companions": [vars(bounds) for bounds in self.companions]} if self.companions else {}
        return {
            "log_ids": self.log_ids,
            "profile_sha256": self.profile_sha256,
            "segments": [vars(bounds) for bounds in self.bounds],
            **companions,
            **({"draughts_m": dict(sorted(self.draughts_m.items()))} if self.draughts_m else {}),
            "model": self.model_spec,
            "estimator": self.estimator,
            "settings": self.settings,
            "code_version": self.code_version,
        }


def parameter_set_id(inputs: Inputs) -> str:
    """Return the id of what these inputs produce: ``ps-`` and 16 hex digits of the SHA-256 of their canonical JSON."""
    return _id_of(inputs.canonical_json())


def ids_of_each(common: Inputs, bounds: Sequence[Bounds]) -> list[str]:
    """Return the ids of the sets that these inputs produce of one segment each, in the order given.

    What they have in common is written once, so that it costs little to know which of thousands are stored.

    Parameters
    ----------
    common : Inputs
        Without segments and logs.
    bounds : sequence of Bounds
        Of the segments.
    """
    log, segment = "\0log", "\0segment"
    content = {**common.as_json(), "log_ids": [log], "segments": [segment]}
    head, rest = canonical_json(content).split(canonical_json(log))
    between, tail = rest.split(canonical_json(segment))
    # of text and whole numbers orjson writes what json does
    own = [(dumps(one.log_id).decode(), dumps(vars(one), option=OPT_SORT_KEYS).decode()) for one in bounds]
    return [_id_of(f"{head}{log_id}{between}{part}{tail}") for log_id, part in own]


def _id_of(text: str) -> str:
    return "ps-" + sha256(text)[:16]


#: key of the settings of a set that brings another one forward
UPDATES = "updates"


@dataclass(frozen=True)
class Update:
    """What a set brings forward that rests on another one; it is stored with what it adds to that."""

    #: Id of the other set.
    set: str
    #: Manoeuvres of that set and of all that it rests on in turn.
    manoeuvres: int
    #: Manoeuvres of the first of these, which were fitted all at once.
    fitted_at_once: int

    def as_json(self) -> dict[str, Any]:
        """Return it as it stands in the settings."""
        return dict(vars(self))


def update_in(settings: Mapping[str, Any]) -> Update | None:
    """Return what a set of these settings brings forward; None where it stands by itself."""
    update = settings.get(UPDATES)
    return None if update is None else Update(**update)


@dataclass(frozen=True)
class ParameterSet:
    """One identified model.

    Raises
    ------
    ValueError
        Two estimates of one group share a name, or the covariance is not square in its names.
    """

    #: See `parameter_set_id`.
    parameter_set_id: str
    vessel: str
    model_name: str
    #: model_spec, model_sha256: Str. Specification as JSON content, and its hash.
    model_spec: Mapping[str, Any]
    model_sha256: str
    estimator: str
    #: fit, iterations, convergence, settings, provenance: What is not finite becomes null. ``provenance["inputs"]``
    #: holds what the id is made of.
    settings: Mapping[str, Any]
    #: segment_ids, log_ids: What it was identified from.
    segment_ids: tuple[str, ...]
    log_ids: tuple[str, ...]
    #: Start of the first segment, UTC nanoseconds.
    start_utc_ns: int
    #: parameters, discrete, noise: In continuous time; of the discrete model, eq. (17); noise levels.
    parameters: tuple[StoredValue, ...]
    discrete: tuple[StoredValue, ...] = ()
    noise: tuple[StoredValue, ...] = ()
    #: What the rows and columns of the covariance are.
    covariance_names: tuple[str, ...] = ()
    #: Shape (n, n). In products of the units of the estimates.
    covariance: tuple[tuple[float, ...], ...] = ()
    fit: Mapping[str, Any] = field(default_factory=dict)
    iterations: Sequence[Any] = ()
    convergence: Mapping[str, Any] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    #: Parameter set it grew from.
    parent: str | None = None
    provenance: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in _CONTENTS:
            object.__setattr__(self, name, plain(getattr(self, name)))
        for name in _SEQUENCES:
            object.__setattr__(self, name, tuple(getattr(self, name)))
        rows = tuple(tuple(float(x) for x in row) for row in self.covariance)
        object.__setattr__(self, "covariance", rows)
        n = len(self.covariance_names)
        if len(rows) != n or any(len(row) != n for row in rows):
            raise ValueError(f"the covariance of {n} estimates has shape {[len(row) for row in rows]}")
        for group in ("parameters", "discrete", "noise"):
            names = [estimate.name for estimate in getattr(self, group)]
            if len(set(names)) != len(names):
                raise ValueError(f"{group} share a name: {names}")

    @classmethod
    def restored(cls, **columns: Any) -> ParameterSet:
        """Make a set of what was stored of one: that was checked and made plain then, as costs too much for hundreds.

        Parameters
        ----------
        columns
            Every field; sequences may be lists.
        """
        parameter_set = cls.__new__(cls)
        rows = {name: tuple(columns[name]) for name in _SEQUENCES}
        vars(parameter_set).update(columns, **rows, covariance=tuple(map(tuple, columns["covariance"])))
        return parameter_set

    @property
    def unseen(self) -> frozenset[str]:
        """Segments that it names and was not fitted to: held out, or left out as nothing could be made of them."""
        return frozenset((*(self.convergence.get("held_out") or ()), *(self.convergence.get("left_out") or ())))

    @property
    def updates(self) -> Update | None:
        """The set that this one brings forward; None where it stands by itself."""
        return update_in(self.settings)

    def as_json(self) -> dict[str, Any]:
        """Return the parameter set as the command line's JSON object."""
        shown: dict[str, Any] = plain(
            {
                "parameter_set_id": self.parameter_set_id,
                "vessel": self.vessel,
                "model": {"name": self.model_name, "sha256": self.model_sha256, "spec": self.model_spec},
                "estimator": self.estimator,
                "settings": self.settings,
                "segments": self.segment_ids,
                "start": iso_utc(self.start_utc_ns),
                "parameters": by_name(self.parameters),
                "discrete": by_name(self.discrete),
                "noise": by_name(self.noise),
                "covariance": {"names": self.covariance_names, "values": self.covariance},
                "fit": self.fit,
                "iterations": self.iterations,
                "convergence": self.convergence,
                "warnings": self.warnings,
                "parent": self.parent,
                "provenance": self.provenance,
            }
        )
        return shown


def by_name(estimates: Sequence[StoredValue]) -> dict[str, dict[str, Any]]:
    """Return value, standard error and unit of estimates by name, as JSON content."""
    return {e.name: {"value": e.value, "std": e.std, "unit": e.unit} for e in estimates}


#: what a set says of each manoeuvre, by which a set that brings it forward adds that of its own
_OF_EACH = ("levels", "gross_error_instants_s", "left_out")
_OF_EACH_ON_RUNG = ("held_out", "in_sample", "foreseen", "free_run_fitted_to_legs")


def brought_forward(before: ParameterSet, added: ParameterSet) -> ParameterSet:
    """Return a set that rests on another one with what that says of its manoeuvres.

    Parameters
    ----------
    before : ParameterSet
        The other one, which stands by itself, or was put together likewise.
    added : ParameterSet
        As it is stored: `ParameterSet.updates` is the other one.
    """
    then, now = before.convergence, added.convergence
    convergence = {**now, **{name: {**(then.get(name) or {}), **(now.get(name) or {})} for name in _OF_EACH}}
    convergence["held_out"] = [*(then.get("held_out") or ()), *(now.get("held_out") or ())]
    if "pooling" in now and "pooling" in then:
        members = [*then["pooling"]["members"], *now["pooling"]["members"]]
        convergence["pooling"] = {**now["pooling"], "members": members}
    first, last = before.fit["rung"], added.fit["rung"]
    rung = {**last, **{name: {**first.get(name, {}), **last.get(name, {})} for name in _OF_EACH_ON_RUNG}}
    # legs are fitted where all manoeuvres are
    rung["one_leg_ahead"] = first["one_leg_ahead"]
    changed = {
        "settings": {**added.settings, "segments": _both(before.settings, added.settings, "segments")},
        "provenance": _both_origins(before.provenance, added.provenance),
        "segment_ids": (*before.segment_ids, *added.segment_ids),
        "log_ids": sorted({*before.log_ids, *added.log_ids}),
        "convergence": convergence,
        "fit": {**added.fit, "rung": rung},
        "warnings": dict.fromkeys((*before.warnings, *added.warnings)),
    }
    return ParameterSet.restored(**{**vars(added), **changed})


def _both(before: Mapping[str, Any], added: Mapping[str, Any], key: str) -> list[Any]:
    return [*(before.get(key) or ()), *(added.get(key) or ())]


def _both_origins(before: Mapping[str, Any], added: Mapping[str, Any]) -> dict[str, Any]:
    """Return the provenance of a set that rests on another one: logs, segments and channels of both."""
    first, last = before.get("inputs") or {}, added.get("inputs") or {}
    inputs = {
        **last,
        "log_ids": sorted({*_both(first, last, "log_ids")}),
        "segments": _both(first, last, "segments"),
    }
    return {
        **added,
        "inputs": inputs,
        "ingest_ids": sorted({*_both(before, added, "ingest_ids")}),
        "channels": {**(before.get("channels") or {}), **(added.get("channels") or {})},
    }


def compare(first: ParameterSet, second: ParameterSet) -> dict[str, dict[str, Any]]:
    """Return how the parameters of two sets differ, by name.

    Returns
    -------
    dict
        For each parameter that either has: ``first``, ``second``, ``difference`` (second less first), ``in_std``: the
        difference over its standard error, the two sets taken as independent; None where it is unknown, or where only
        one of the sets has the parameter.
    """
    return differences(first.parameters, second.parameters)


def differences(first: Sequence[StoredValue], second: Sequence[StoredValue]) -> dict[str, dict[str, Any]]:
    """Return how two lists of values differ, by name, see `compare`."""
    here, there = ({p.name: p for p in values} for values in (first, second))
    comparison: dict[str, dict[str, Any]] = {}
    for name in dict.fromkeys([*here, *there]):
        p, q = here.get(name), there.get(name)
        difference = q.value - p.value if p is not None and q is not None else None
        spread = hypot(p.std or nan, q.std or nan) if p is not None and q is not None else nan
        comparison[name] = {
            "first": p.value if p is not None else None,
            "second": q.value if q is not None else None,
            "difference": difference,
            "in_std": difference / spread if difference is not None and spread > 0 else None,
            "unit": (p or q).unit,  # type: ignore[union-attr]
        }
    return comparison
