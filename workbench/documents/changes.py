"""Whether a vessel changed: the tests of her parameter sets, by model and estimator."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from kempf.warehouse.queries.comparable import Comparable
from kempf.warehouse.queries.history import History

if TYPE_CHECKING:
    from kempf.pipeline.history.changes import Changes
    from kempf.pipeline.history.sets import ParameterHistory


@dataclass(frozen=True, eq=False)
class Examined:
    """The sets of one model and estimator, put to the tests."""

    kind: Comparable
    #: Of the sets whose covariance is one.
    history: ParameterHistory
    changes: Changes
    parameter_set_ids: tuple[str, ...]
    #: How many are left out, by the reason.
    left_out: dict[str, int]

    def as_json(self, figure: str | None = None) -> dict[str, Any]:
        """Return it as JSON content.

        Parameters
        ----------
        figure : str, optional
            The file in which it is drawn.
        """
        from kempf.pipeline.history.pooled import pool
        from kempf.pipeline.history.report import report

        pooled = pool(self.history.value, self.history.covariance) if len(self.history) else None
        return {
            "model": self.kind.model,
            "model_sha256": self.kind.model_sha256,
            "estimator": self.kind.estimator,
            "parameter_set_ids": list(self.parameter_set_ids),
            "left_out": self.left_out,
            **report(self.history, pooled, self.changes),
            "figure": figure,
        }


def examined(kind: Comparable, occasion_h: float | None = None) -> Examined:
    """Put the sets of one model and estimator to the tests.

    Parameters
    ----------
    kind : Comparable
        See `kempf.warehouse.queries.comparable.comparable_sets`.
    occasion_h : float, optional
        Trials begun within so many hours count as one, by default as `ChangeSettings` says.
    """
    from kempf.pipeline.history.changes import find_changes
    from kempf.pipeline.history.sets import ParameterHistory, usable
    from kempf.pipeline.history.settings import ChangeSettings

    n, p = len(kind.parameter_set_ids), len(kind.names)
    time = np.array(kind.starts_utc_ns, dtype=np.int64)
    value = np.array(kind.values, dtype=np.float64).reshape(n, p)
    covariance = np.array(kind.covariances, dtype=np.float64).reshape(n, p, p)
    good = usable(value, covariance)
    left_out = dict(kind.left_out)
    if not bool(np.all(good)):
        left_out["covariance not positive definite"] = int(np.sum(~good))
    series = ParameterHistory(kind.names, kind.units, time[good], value[good], covariance[good])
    settings = ChangeSettings()
    if occasion_h is not None:
        settings = replace(settings, occasion_s=3600.0 * occasion_h)
    changes = find_changes(series, settings)
    ids = tuple(name for name, ok in zip(kind.parameter_set_ids, good, strict=True) if ok)
    return Examined(kind, series, changes, ids, left_out)


def changes_document(vessel: str, of: History, changes: list[dict[str, Any]]) -> dict[str, Any]:
    """Return what `kempf history --vessel NAME --changes --json` prints.

    Parameters
    ----------
    changes : list of dict
        Of each model and estimator, see `Examined.as_json`.
    """
    return {"vessel": vessel, "history": history_rows(vessel, of), "changes": changes}


def history_rows(vessel: str, of: History) -> list[dict[str, Any]]:
    """Return a vessel's parameters over time as `kempf history --json` prints them."""
    return [{"vessel": vessel, **row} for row in of.rows()]
