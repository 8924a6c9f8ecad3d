"""The job that says of a parameter set how she answers her rudder, and whether she holds a straight course."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from kempf.flows.jobs.identify.chosen_set import named_set
from kempf.flows.jobs.identify.ship_model import ShipOfSet, ship_of_set
from kempf.pipeline.estimate.result import Value
from kempf.pipeline.steering.motion import linear_hull
from kempf.pipeline.steering.nomoto import Constant, Nomoto, nomoto
from kempf.pipeline.steering.stability import Stability, stability
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables.parameter_set import by_name


@dataclass(frozen=True, eq=False)
class SteeringOfSet:
    """Nomoto's constants and the straight-line stability of a ship, as a parameter set has them."""

    ship: ShipOfSet
    nomoto: Nomoto
    stability: Stability
    #: What speaks against these numbers, the gravest first.
    warnings: tuple[str, ...]

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON content."""
        parameter_set = self.ship.parameter_set
        return {
            "parameter_set_id": parameter_set.parameter_set_id,
            "vessel": parameter_set.vessel,
            "speed_m_s": self.ship.speed_m_s,
            "length_m": self.ship.length_m,
            "nomoto": {
                "poles": self.nomoto.poles,
                "constants": {
                    name: {**_value(constant), "interval_95": constant.interval_95}
                    for name, constant in self.nomoto.constants.items()
                },
            },
            "stability": {
                "verdict": self.stability.verdict,
                "reason": self.stability.reason,
                "probability_stable": self.stability.probability,
                "determinant": _value(self.stability.determinant),
                "eigenvalues_real_part": [_value(part) for part in self.stability.real_parts],
            },
            "effects": by_name(self.ship.effect_parameters),
            "warnings": list(self.warnings),
        }


def steering_of_set(
    warehouse: Warehouse, set_id: str | None, vessel: str | None = None, speed_m_s: float | None = None
) -> SteeringOfSet:
    """Return how a ship steers, as a parameter set has it.

    Parameters
    ----------
    set_id : str or None
        Id, or an alias, of the vessel's where one is given; None for ``current``.
    speed_m_s : float, optional
        Speed through the water; by default that of the trial.

    Raises
    ------
    NotFound, UsageError, DataRejected
        As `kempf.flows.jobs.identify.chosen_set.named_set` and `kempf.flows.jobs.identify.ship_model.ship_of_set`.
    """
    ship = ship_of_set(warehouse, named_set(warehouse, set_id, vessel), speed_m_s)
    linear = linear_hull(ship.hull, ship.effects, ship.covariance, ship.speed_m_s)
    constants = nomoto(linear.hull, linear.covariance, ship.speed_m_s, ship.length_m)
    judged = stability(linear.hull, linear.covariance, ship.speed_m_s)
    warnings = [*ship.of_parameters, *constants.warnings, *ship.remarks]
    if linear.settled:
        warnings.append("the states of effects are settled in K, T1, T2, T3 and T: they hold for slow motion")
    if not ship.parameter_set.convergence.get("converged"):
        warnings.insert(0, "the search for these parameters did not converge")
    return SteeringOfSet(ship, constants, judged, tuple(warnings))


def _value(value: Constant | Value) -> dict[str, Any]:
    return {"value": value.value, "std": value.std, "unit": value.unit}
