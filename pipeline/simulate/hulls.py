"""Ships to simulate: the parameters of eq. (16) and what else a trial needs to know of a hull.

Ships of one shape share the dimensionless ("prime") derivatives, made so with length L and speed V; the parameters of
eq. (16) follow from them: a11 = A11'/L, a12 = A12', a21 = A21'/L^2, a22 = A22'/L, b1 = B1'/L, b2 = B2'/L^2.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import radians


@dataclass(frozen=True)
class HullParameters:
    """The six parameters of eq. (16).

    Parameters
    ----------
    a11 : float
        Sway damping, 1/m; negative.
    a12 : float
        Sway acceleration by V r, dimensionless.
    a21 : float
        Yaw acceleration by V v, 1/m^2.
    a22 : float
        Yaw damping, 1/m; negative.
    b1 : float
        Sway acceleration by V^2 delta, 1/m; negative for a stern rudder.
    b2 : float
        Yaw acceleration by V^2 delta, 1/m^2; positive for a stern rudder.
    """

    a11: float
    a12: float
    a21: float
    a22: float
    b1: float
    b2: float


@dataclass(frozen=True)
class SimulatedHull:
    """A ship as the simulator knows her.

    Parameters
    ----------
    name, source : str
        Key in `HULLS`; where the numbers come from.
    parameters : HullParameters
        Of eq. (16).
    length_m, beam_m, draught_m, block_coefficient : float
        Particulars.
    trial_speed_m_s : float
        V0, speed through the water on a straight course at the trial's shaft speed.
    wind_arm_per_m : float
        l of eq. (16), 1/m.
    rudder_rate_rad_s, rudder_limit_rad : float
        Rate and largest angle of the rudder.
    speed_loss : float
        c of dV/dt = (V0 (1 - c (L r / V0)^2) - V) / T, dimensionless; 0 keeps V constant.
    surge_time_lengths : float
        T V0 / L, the time constant of the speed in ship lengths.
    shaft_speed_per_s : float
        Propeller revolutions, 1/s.
    heel_per_g : float
        Roll angle for a lateral acceleration V r of one g, rad; the heel is outward and follows at once.
    """

    name: str
    source: str
    parameters: HullParameters
    length_m: float
    beam_m: float
    draught_m: float
    block_coefficient: float
    trial_speed_m_s: float
    wind_arm_per_m: float
    rudder_rate_rad_s: float = radians(2.5)
    rudder_limit_rad: float = radians(35.0)
    speed_loss: float = 0.3
    surge_time_lengths: float = 6.0
    shaft_speed_per_s: float = 2.0
    heel_per_g: float = 1.5

    @property
    def surge_time_s(self) -> float:
        """T, the time constant of the speed, s."""
        return self.surge_time_lengths * self.length_m / self.trial_speed_m_s


def _from_prime(
    length_m: float, A: tuple[tuple[float, float], tuple[float, float]], B: tuple[float, float]
) -> HullParameters:
    """Return the parameters of eq. (16) from d(v', r')/dt' = A (v', r') + B delta; v' = v/V, r' = r L/V, t' = t V/L."""
    L = length_m
    return HullParameters(A[0][0] / L, A[0][1], A[1][0] / L**2, A[1][1] / L, B[0] / L, B[1] / L**2)


def _mariner() -> HullParameters:
    # M (v', r')' = D (v', r') + R delta; Yr holds -m' already; the published rudder is positive to port, hence -R.
    m, Iz, xG = 798e-5, 39.2e-5, -0.023
    Yvdot, Nvdot, Yrdot, Nrdot = -748e-5, 4.646e-5, -9.354e-5, -43.8e-5
    Yv, Nv, Yr, Nr, Yd, Nd = -1160e-5, -264e-5, -499e-5, -166e-5, 278e-5, -139e-5
    m22, m23, m32, m33 = m - Yvdot, m * xG - Yrdot, m * xG - Nvdot, Iz - Nrdot
    determinant = m22 * m33 - m23 * m32

    def solve(y: float, n: float) -> tuple[float, float]:
        return (m33 * y - m23 * n) / determinant, (m22 * n - m32 * y) / determinant

    (A11, A21), (A12, A22), B = solve(Yv, Nv), solve(Yr, Nr), solve(-Yd, -Nd)
    return _from_prime(160.93, ((A11, A12), (A21, A22)), B)


_PLAUSIBLE = "plausible, not a real ship"

#: The catalogue, by name.
HULLS: dict[str, SimulatedHull] = {
    hull.name: hull
    for hull in (
        SimulatedHull(
            "mariner",
            "linear derivatives of Chislett and Stroem-Tejsen (1965), Hy-5, as in the MSS toolbox; the speed loss, "
            "the wind arm and the roll are plausible",
            _mariner(),
            length_m=160.93,
            beam_m=23.17,
            draught_m=7.47,
            block_coefficient=0.59,
            trial_speed_m_s=7.7175,
            wind_arm_per_m=1.0 / 160.93,
            rudder_rate_rad_s=radians(5.0),
        ),
        SimulatedHull(
            "container",
            _PLAUSIBLE,
            _from_prime(220.0, ((-0.80, -0.36), (-3.6, -2.4)), (-0.17, 1.5)),
            length_m=220.0,
            beam_m=32.2,
            draught_m=11.0,
            block_coefficient=0.6,
            trial_speed_m_s=11.0,
            wind_arm_per_m=1.1 / 220.0,
            shaft_speed_per_s=1.6,
        ),
        SimulatedHull(
            "tanker",
            _PLAUSIBLE + "; barely stable on a straight course",
            _from_prime(320.0, ((-0.60, -0.30), (-3.0, -1.7)), (-0.12, 1.05)),
            length_m=320.0,
            beam_m=58.0,
            draught_m=20.8,
            block_coefficient=0.81,
            trial_speed_m_s=7.5,
            wind_arm_per_m=0.8 / 320.0,
            shaft_speed_per_s=1.2,
            heel_per_g=0.8,
        ),
        SimulatedHull(
            "ferry",
            _PLAUSIBLE,
            _from_prime(140.0, ((-0.85, -0.33), (-3.6, -2.6)), (-0.20, 1.9)),
            length_m=140.0,
            beam_m=24.0,
            draught_m=6.0,
            block_coefficient=0.58,
            trial_speed_m_s=10.0,
            wind_arm_per_m=1.0 / 140.0,
            rudder_rate_rad_s=radians(5.0),
        ),
        SimulatedHull(
            "usv",
            _PLAUSIBLE,
            _from_prime(3.0, ((-1.0, -0.30), (-3.0, -3.2)), (-0.25, 1.8)),
            length_m=3.0,
            beam_m=1.0,
            draught_m=0.3,
            block_coefficient=0.5,
            trial_speed_m_s=1.8,
            wind_arm_per_m=1.0 / 3.0,
            rudder_rate_rad_s=radians(30.0),
            shaft_speed_per_s=15.0,
        ),
    )
}
