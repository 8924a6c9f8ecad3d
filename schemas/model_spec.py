"""The model specification: a small YAML file that says which model is fitted and what is free in it."""

from __future__ import annotations

import hashlib
import json
from typing import Literal

from pydantic import Field

from kempf.schemas.frozen import Frozen

#: The six parameters of eq. (16) and their units.
HULL_PARAMETERS: dict[str, str] = {
    "a11": "1/m",
    "a12": "1",
    "a21": "1/m^2",
    "a22": "1/m",
    "b1": "1/m",
    "b2": "1/m^2",
}
#: How many there are: they stand first wherever parameters are one vector.
N_HULL = len(HULL_PARAMETERS)

#: Noise levels of eqs. (16) and (18) that are estimated with them, and their units (continuous time, standard
#: deviations): wind force, yaw acceleration beside it, unaccounted current, lateral speed, yaw rate, heading. Those of
#: the disturbances are their levels in the long run; within a time short beside their memory they only change by
#: `kempf.pipeline.model.disturbances.change_within`.
NOISE_PARAMETERS: dict[str, str] = {
    "sigma_F": "m/s^2",
    "sigma_M": "rad/s^2",
    "sigma_V": "m/s",
    "sigma_v": "m/s",
    "sigma_r": "rad/s",
    "sigma_psi": "rad",
}


class ModelSpec(Frozen):
    """Which model is fitted: base, effects in order, disturbance model.

    The correlation rates of the Gauss-Markov disturbances are stated, not estimated: one zigzag holds too few of their
    correlation times to determine them.
    """

    name: str = "plain"
    base: str = "sway-yaw-16"
    effects: tuple[str, ...] = ()
    #: ``force``: the normalised lateral force F of eq. (16) with its moment l F; ``none``: no wind, as in a tank
    wind: Literal["force", "none"] = "force"
    #: ``gauss-markov``: a slow yaw acceleration M beside l F, for what turns her and is not in the model; ``none``: the
    #: moment is that of the wind force alone, as eq. (16) has it; None: ``none`` where l is known, else the other
    moment: Literal["gauss-markov", "none"] | None = None
    #: ``earth``: two current states towards north and east; ``lateral``: the paper's single V_T, which takes the
    #: current's lateral part for constant while the heading swings; ``none``: still water, as in a tank
    current: Literal["earth", "lateral", "none"] = "earth"
    #: the rudder's force goes with V to this power, in eq. (16) with 2; with a propeller that keeps turning the rudder
    #: stands in a race that slows less than the ship: 1 is V times the speed of the approach, at which b1 and b2 hold
    rudder_speed_exponent: float = Field(default=2.0, ge=0.0, le=2.0)
    #: whether every manoeuvre has a bias of the rate gyro of its own among its states; the effect ``gyro_bias``, one
    #: constant of the ship's gyro, is what a diagnosis finds and names
    rate_bias: bool = False
    #: mu_F, that of M, and mu_V of eq. (16), 1/s. By default force and current hardly forget within a trial: random
    #: walks, which may stand off nothing for as long as they like
    wind_correlation_rate_per_s: float = Field(default=1e-5, gt=0)
    moment_correlation_rate_per_s: float = Field(default=1 / 30.0, gt=0)
    current_correlation_rate_per_s: float = Field(default=1e-6, gt=0)
    #: l of eq. (16), 1/m; None takes the vessel profile's
    wind_arm_per_m: float | None = None
    parent: str | None = None

    def with_arm(self, arm_per_m: float | None) -> ModelSpec:
        """Return the specification with ``moment`` decided by whether l of eq. (16) is known."""
        if self.moment is not None:
            return self
        known = arm_per_m is not None or self.wind == "none"
        return self.model_copy(update={"moment": "none" if known else "gauss-markov"})

    @property
    def sha256(self) -> str:
        """Hash of the specification's sorted JSON."""
        text = json.dumps(self.model_dump(mode="json"), sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()
