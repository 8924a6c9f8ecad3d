"""Ships that the data allow: draws from the joint covariance of hull and effects, surge and rudder rate.

The draws are a scrambled Sobol sequence, whose quantiles settle with fewer ships than those of independent numbers
(Owen 1998, "Scrambling Sobol' and Niederreiter-Xing points", Journal of Complexity 14). Their seed
is always the same, so that a prediction is the same to the bit whenever it is made.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from hashlib import sha256

import numpy as np

from kempf.pipeline.channels.series import Float
from kempf.pipeline.distributions import normal_quantile
from kempf.pipeline.manoeuvre.own_zigzags import REFERENCE
from kempf.pipeline.manoeuvre.rudder_rate import RudderRate
from kempf.pipeline.manoeuvre.ship import Ship, Start, Waters
from kempf.pipeline.manoeuvre.surge.surge_fit import SurgeFit
from kempf.pipeline.model.ship import mariner_like

#: a power of two, as the sequence wants it
DRAWS = 256
#: a parameter of the hull that happens to be nothing scatters as if it were this part of an ordinary hull's
_ORDINARY = 0.3


@dataclass(frozen=True, eq=False)
class Identified:
    """A model with what is known of its parameters."""

    #: Of the parameter set.
    name: str
    waters: Waters
    #: hull, effects: Shape (6,) and (p,). Estimates.
    hull: Float
    effects: Float
    #: Shape (6 + p, 6 + p). Of both.
    covariance: Float
    surge: SurgeFit
    rudder_rate: RudderRate
    #: Factor that is in the covariance for what the model lacks, see `kempf.pipeline.manoeuvre.widening`.
    widened: float = 1.0
    #: Whether the parameters are those fitted to predict legs, see `kempf.pipeline.shooting`, not the likelihood's.
    fitted_to_legs: bool = False
    #: Whether they were brought to her own overshoots, see `kempf.pipeline.manoeuvre.conditioned`.
    conditioned: bool = False
    #: Standard error of `Waters.wind_force_m_s2`, its wandering included.
    wind_force_std_m_s2: float = 0.0
    #: Standard errors of `Waters.start`; None is none.
    start_std: Start = field(default_factory=Start)
    #: Relative standard error of `Waters.settled_m_s`, where it is not the approach's.
    settled_std: float = 0.0

    @property
    def title(self) -> str:
        """Names of its effects, or that it has none."""
        return " + ".join(effect.name for effect in self.waters.model.effects) or "plain"

    @property
    def ship(self) -> Ship:
        """The ship of the estimates."""
        return Ship(self.waters, self.hull, self.effects, self.surge_here.best, self.rudder_rate.rad_s)

    @property
    def surge_here(self) -> SurgeFit:
        """The equation of her speed with the shaft speed of `waters`."""
        settled = self.waters.settled_m_s
        return self.surge.at(self.waters.approach_m_s if settled is None else settled)

    def scattered(self, share: float) -> Identified:
        """Return the model with parameters that scatter beside their errors, each by a share of its size."""
        return replace(self, covariance=self.covariance + np.diag((share * self._sizes) ** 2))

    def scattered_alone(self) -> Identified:
        """Return the model with parameters that scatter by `REFERENCE` and nothing else that is unsure."""
        return replace(
            self,
            covariance=np.diag((REFERENCE * self._sizes) ** 2),
            surge=self.surge.sure,
            rudder_rate=replace(self.rudder_rate, std_rad_s=0.0),
            wind_force_std_m_s2=0.0,
            start_std=Start(),
            settled_std=0.0,
        )

    @property
    def _sizes(self) -> Float:
        """Sizes of the parameters, shape (6 + p,); of the hull's no less than a part of an ordinary hull's."""
        ordinary = np.abs(mariner_like(self.waters.scale_m).array())
        return np.concatenate([np.maximum(np.abs(self.hull), _ORDINARY * ordinary), np.abs(self.effects)])

    def ships(self, count: int = DRAWS) -> Iterator[Ship]:
        """Draw ships; parameters of effects stay within what is physical."""
        # imported by what draws only: it takes longer than most commands take to start
        from scipy.stats import qmc

        p = self.effects.size
        # the same draws for every model: what differs between two is their parameters
        seed = int.from_bytes(sha256(b"manoeuvre").digest()[:8], "big")
        sequence = qmc.Sobol(6 + p + 4, rng=np.random.Generator(np.random.PCG64(seed)))
        # of the closed unit interval the ends have no normal number
        normal = normal_quantile(np.clip(sequence.random(count), 1e-12, 1.0 - 1e-12))
        theta = np.concatenate([self.hull, self.effects]) + normal[:, : 6 + p] @ _root(self.covariance).T
        low, high = self.waters.model.low, self.waters.model.high
        # numbers of their own, so that hull and effects are drawn alike whatever costs her speed
        beside = np.random.Generator(np.random.PCG64([seed, 1])).standard_normal((7, count))
        of_the_day, more, beginning = beside[:2], beside[2:4].T, beside[4:].T
        surge = self.surge_here.drawn(np.hstack([normal[:, 6 + p : 9 + p], more]))
        # a rate is positive whatever its error
        share = self.rudder_rate.std_rad_s / self.rudder_rate.rad_s
        rate = self.rudder_rate.rad_s * np.exp(share * normal[:, -1])
        wind, settled = self.wind_force_std_m_s2 * of_the_day[0], 1.0 + self.settled_std * of_the_day[1]
        for k in range(count):
            values = np.clip(theta[k, 6:], low, high)
            waters = replace(self.waters, start=self.waters.start.off_by(self.start_std, beginning[k]))
            if wind[k] != 0.0:
                waters = replace(waters, wind_force_m_s2=waters.wind_force_m_s2 + float(wind[k]))
            if waters.settled_m_s is not None:
                waters = replace(waters, settled_m_s=waters.settled_m_s * float(settled[k]))
            yield Ship(waters, theta[k, :6], values, surge[k], float(rate[k]))


def _root(covariance: Float) -> Float:
    """Return a lower triangle whose square is the covariance, also of a parameter that has no error."""
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    scale = np.where(std > 0.0, std, 1.0)
    correlation = covariance / np.outer(scale, scale)
    jitter = 1e-12
    while True:
        try:
            root: Float = np.linalg.cholesky(correlation + jitter * np.eye(std.size))
        except np.linalg.LinAlgError:
            jitter *= 10.0
            continue
        return root * scale[:, None]
