"""The MMG standard method with coefficients from captive tests: what a peer predicts without any free-running log.

Yasukawa & Yoshimura 2015, "Introduction of MMG standard method for ship maneuvering predictions", Journal of Marine
Science and Technology 20, doi 10.1007/s00773-014-0293-y. It shares no code with the models that are judged by it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq

from kempf.pipeline.channels.series import Float
from kempf.pipeline.segment.circles.turning_figures import TurningFigures, turning_figures

_STEP_S = 0.05
_LONGEST_S = 400.0


@dataclass(frozen=True)
class Peer:
    """A ship of the MMG standard method."""

    length_m: float
    speed_m_s: float
    rudder_rate_rad_s: float
    #: As ``benchmarks/peers/kvlcc2.yaml`` has it.
    mmg: Mapping[str, Any]

    @classmethod
    def of(cls, data: Mapping[str, Any]) -> Peer:
        """Return the ship of a file of peers."""
        return cls(data["length_m"], data["speed_m_s"], float(np.deg2rad(data["rudder_rate_deg_s"])), data["mmg"])

    @property
    def revolutions_per_s(self) -> float:
        """At which the propeller drives her on a straight course at her speed."""

        def surplus(n: float) -> float:
            return float(self._forces(np.array([self.speed_m_s, 0.0, 0.0]), 0.0, n)[0])

        return float(brentq(surplus, 1.0, 50.0))

    def _forces(self, motion: Float, rudder: float, n: float) -> Float:
        """Return X, Y and N over half density, length, draught and speed of the approach squared."""
        p, L, d = self.mmg, self.length_m, self.mmg["draught_m"]
        u, v, r = motion
        U = float(np.hypot(u, v))
        v_, r_, beta = v / U, r * L / U, float(np.arctan2(-v, u))
        surge, sway, yaw = p["surge"], p["sway"], p["yaw"]
        along = surge["vv"] * v_**2 + surge["vr"] * v_ * r_ + surge["rr"] * r_**2 + surge["vvvv"] * v_**4
        hull = U**2 * np.array([along - surge["r_0"], _polynomial(sway, v_, r_), _polynomial(yaw, v_, r_)])
        wake, rudder_of, thrust = p["wake"], p["rudder"], p["thrust"]
        at_propeller = beta - wake["x_p"] * r_
        swept = wake["c_2_starboard"] if at_propeller > 0.0 else wake["c_2_port"]
        inflow = 1.0 + (1.0 - np.exp(-wake["c_1"] * abs(at_propeller))) * (swept - 1.0)
        u_p = (1.0 - wake["w_0"]) * inflow * u
        J = u_p / (n * p["propeller_diameter_m"])
        K = thrust["k_0"] + thrust["k_1"] * J + thrust["k_2"] * J**2
        unit = 0.5 * L * d
        push = (1.0 - thrust["deduction"]) * n**2 * p["propeller_diameter_m"] ** 4 * K / unit
        covered = p["propeller_diameter_m"] / p["rudder_span_m"]
        race = 1.0 + rudder_of["kappa"] * (np.sqrt(1.0 + 8.0 * K / (np.pi * J**2)) - 1.0)
        u_r = rudder_of["epsilon"] * u_p * np.sqrt(covered * race**2 + 1.0 - covered)
        at_rudder = beta - rudder_of["l_r"] * r_
        v_r = U * (rudder_of["gamma_starboard"] if at_rudder > 0.0 else rudder_of["gamma_port"]) * at_rudder
        angle = rudder - float(np.arctan2(v_r, u_r))
        normal = 0.5 * p["rudder_area_m2"] * (u_r**2 + v_r**2) * rudder_of["f_alpha"] * np.sin(angle) / unit
        arm = -0.5 + rudder_of["a_h"] * rudder_of["x_h"]
        steered = -normal * np.array(
            [
                (1.0 - rudder_of["t_r"]) * np.sin(rudder),
                (1.0 + rudder_of["a_h"]) * np.cos(rudder),
                arm * np.cos(rudder),
            ]
        )
        found: Float = hull + np.array([push, 0.0, 0.0]) + steered
        return found

    def _slope(self, state: Float, rudder: float, n: float) -> Float:
        p, L = self.mmg, self.length_m
        u, v, r, heading = state[:4]
        X, Y, N = self._forces(state[:3], rudder, n)
        # masses over half density, length squared and draught; r and its slope by the length
        m = p["displacement_m3"] / (0.5 * L**2 * p["draught_m"])
        m_x, m_y, J = p["added"]["m_x"], p["added"]["m_y"], p["added"]["j_z"]
        x, R = p["x_g"], r * L
        inertia = m * p["gyration"] ** 2 + x**2 * m + J
        du = (X + ((m + m_y) * v * R + x * m * R**2)) / (m + m_x) / L
        A = np.array([[m + m_y, x * m], [x * m, inertia]])
        dv, dR = np.linalg.solve(A, np.array([Y - (m + m_x) * u * R, N - x * m * u * R])) / L
        return np.array(
            [du, dv, dR / L, r, u * np.cos(heading) - v * np.sin(heading), u * np.sin(heading) + v * np.cos(heading)]
        )

    def _steered(self, order: Any) -> Float:
        """Sail with a helm that ``order(t, heading)`` directs, None ends it; rows of t, u, v, r, psi, x, y, rudder."""
        n, state, rudder, t = self.revolutions_per_s, np.zeros(6), 0.0, 0.0
        state[0] = self.speed_m_s
        rows = [np.concatenate([[t], state, [rudder]])]
        while t < _LONGEST_S:
            wanted = order(t, float(state[3]))
            if wanted is None:
                break
            most = self.rudder_rate_rad_s * _STEP_S
            after = rudder + float(np.clip(wanted - rudder, -most, most))
            middle = 0.5 * (rudder + after)
            a = self._slope(state, rudder, n)
            b = self._slope(state + 0.5 * _STEP_S * a, middle, n)
            c = self._slope(state + 0.5 * _STEP_S * b, middle, n)
            e = self._slope(state + _STEP_S * c, after, n)
            state, rudder, t = state + _STEP_S / 6.0 * (a + 2.0 * b + 2.0 * c + e), after, t + _STEP_S
            rows.append(np.concatenate([[t], state, [rudder]]))
        return np.array(rows)

    def circle(self, rudder_rad: float) -> TurningFigures:
        """Return the figures of a turning circle, of midships; a positive rudder turns her to starboard."""
        t, u, v, _, heading, x, y, _ = self._steered(lambda _, psi: rudder_rad if abs(psi) < 3.0 * np.pi else None).T
        return turning_figures(t, x, y, heading, np.hypot(u, v), np.arctan2(-v, u), 0.0)

    def zigzag(self, heading_rad: float, rudder_rad: float, side: int, until_s: float, begin_s: float = 1.0) -> Float:
        """Return a zigzag as it goes on, at 20 Hz.

        Parameters
        ----------
        side : int
            1: starboard first.
        until_s, begin_s : float
            When the log ends, and when the first execute is; it begins at 0.

        Returns
        -------
        ndarray, shape (n, 8)
            Rows of t, u, v, r, psi, x, y and rudder, of midships; s, m and rad.
        """
        return self._zigzag(heading_rad, rudder_rad, side, lambda t, _: t >= until_s, begin_s)

    def _zigzag(
        self, heading_rad: float, rudder_rad: float, side: int, over: Callable[[float, int], bool], begin_s: float = 0.0
    ) -> Float:
        """Sail a zigzag until it is over, by time and by how often the rudder was reversed."""
        turns = 0

        def order(t: float, psi: float) -> float | None:
            nonlocal turns
            now = side if turns % 2 == 0 else -side
            if now * psi >= heading_rad:
                turns += 1
                now = -now
            if over(t, turns):
                return None
            return now * rudder_rad if t >= begin_s else 0.0

        return self._steered(order)

    def overshoots_deg(self, heading_rad: float, rudder_rad: float, side: int, count: int = 2) -> tuple[float, ...]:
        """Return the overshoots of a zigzag beyond the nominal heading."""
        psi = self._zigzag(heading_rad, rudder_rad, side, lambda _, turns: turns > count)[:, 4]
        found, to, start = [], side, 0
        for _ in range(count):
            there = start + int(np.argmax(to * psi[start:] >= heading_rad))
            back = np.flatnonzero(-to * psi[there:] >= heading_rad)
            end = there + int(back[0]) if back.size else psi.size
            found.append(float(np.rad2deg(np.max(to * psi[there:end]) - heading_rad)))
            start, to = there, -to
        return tuple(found)


def _polynomial(c: Mapping[str, float], v: float, r: float) -> float:
    linear = c["v"] * v + c["r"] * r
    return linear + c["vvv"] * v**3 + c["vvr"] * v**2 * r + c["vrr"] * v * r**2 + c["rrr"] * r**3
