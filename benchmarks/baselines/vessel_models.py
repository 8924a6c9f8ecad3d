"""The package vessel-manoeuvring-models itself on our records: its filter, its smoother, its regression.

Alexandersson, Mao & Ringsberg (2022), Ocean Engineering 266, 112940. The package is no dependency of Kempf and
declares none of its own: `make bench` installs it with all that it imports (requirements/rivals.txt); without it the
page says so.
"""

from __future__ import annotations

import sys
import time
import warnings
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from typing import Any

import numpy as np

from benchmarks import result_page
from benchmarks.baselines.estimators import default_settings, estimate
from benchmarks.baselines.multiple_models import accelerations
from benchmarks.baselines.smoothed_regression import SmoothedRegressionSettings
from benchmarks.baselines.start import ranked_starts
from benchmarks.identify.estimators import HULLS, SEEDS, sail, truth_of
from kempf.pipeline.estimate.classical.resample import even, step_of
from kempf.pipeline.estimate.record.record import Record
from kempf.schemas.model_spec import HULL_PARAMETERS, ModelSpec

PACKAGE = "vessel_manoeuvring_models"
LEVELS = (0.0, 1.0)
PASSES = 6
#: Dimensionless mass, inertia and added masses of a Mariner: any do, since they divide out of eq. (16) again.
MASSES = {"m": 0.00798, "I_z": 0.000392, "x_G": 0.0}
ADDED = {"Xudot": -0.00042, "Yvdot": -0.00748, "Yrdot": 0.0, "Nvdot": 0.0, "Nrdot": -0.000438}


def importable() -> bool:
    """Whether the package is there, made to run beside numpy 2.

    It asks for a private module of numpy and for a name that numpy 2 has taken away; both are lent to it.
    """
    if find_spec(PACKAGE) is None:
        return False
    sys.modules.setdefault("numpy.linalg.linalg", np.linalg)
    if not hasattr(np, "NaN"):
        np.nan = np.nan  # type: ignore[attr-defined]
    return True


@dataclass(frozen=True, eq=False)
class Ship:
    """Conversion between the package's dimensionless derivatives and eq. (16), for a nominal length."""

    length_m: float
    water_kg_m3: float = 1025.0

    @property
    def particulars(self) -> dict[str, float]:
        """Length and SI masses as the package wants them."""
        L, rho = self.length_m, self.water_kg_m3
        mass = MASSES["m"] * 0.5 * rho * L**3
        return {"L": L, "rho": rho, "m": mass, "I_z": MASSES["I_z"] * 0.5 * rho * L**5, "x_G": 0.0}

    def derivatives(self, hull: np.ndarray) -> dict[str, float]:
        """Dimensionless derivatives of a hull, shape (6,)."""
        L = self.length_m
        a11, a12, a21, a22, b1, b2 = hull * np.array([L, 1.0, L**2, L, L, L**2])
        sway, yaw = MASSES["m"] - ADDED["Yvdot"], MASSES["I_z"] - ADDED["Nrdot"]
        return {
            **{"Yv": sway * a11, "Yr": sway * a12 + MASSES["m"], "Ydelta": sway * b1, "Yu": 0.0},
            **{"Nv": yaw * a21, "Nr": yaw * a22, "Ndelta": yaw * b2, "Nu": 0.0},
            **{"Xu": 0.0, "Xv": 0.0, "Xr": 0.0, "Xdelta": 0.0},
            **ADDED,
        }

    def hull(self, sway: Any, yaw: Any) -> np.ndarray:
        """Eq. (16) from the coefficients of the package's two regressions."""
        L = self.length_m
        return np.array(
            [sway["Yv"] / L, sway["Yr"], yaw["Nv"] / L**2, yaw["Nr"] / L, sway["Ydelta"] / L, yaw["Ndelta"] / L**2]
        )


def run(record: Record, matrices: Any) -> tuple[list[np.ndarray], float]:
    """Let the package filter, smooth and regress `PASSES` times; hulls and seconds.

    Parameters
    ----------
    matrices : SystemMatrixes
        The package's symbolic work, done once for all records and not counted.
    """
    import pandas as pd
    from vessel_manoeuvring_models.extended_kalman_vmm import ExtendedKalman
    from vessel_manoeuvring_models.models.regression import MotionRegression
    from vessel_manoeuvring_models.models.vmm_linear import vmm_linear
    from vessel_manoeuvring_models.symbols import delta, r, u, v

    used = even(record, None)
    length, start = ranked_starts(used)[0]
    ship, step = Ship(length), step_of(used)
    good = np.all(np.isfinite(used.measured[:, :2]), axis=1)
    y_v, y_r = used.measured[good, 0], used.measured[good, 1]
    columns = {"x0": 0.0 * y_v, "y0": 0.0 * y_v, "psi": used.heading_rad[good], "u": used.speed_m_s[good]}
    data = pd.DataFrame({**columns, "v": y_v, "r": y_r, "delta": used.rudder_rad[good]}, index=used.time_s[good])
    share = SmoothedRegressionSettings().process_share
    sway, yaw = share * accelerations(used.measured[:, :2], step)
    # it discretises white acceleration as (step E) Q (step E)'
    Q = np.diag([0.01**2, sway**2, yaw**2])
    R = np.diag([used.noise_start[2] ** 2, 0.05**2, used.noise_start[0] ** 2, used.noise_start[1] ** 2])
    E, C = np.vstack([np.zeros((3, 3)), np.eye(3)]), np.eye(6)[2:]
    first = np.diag([1.0, 1.0, 0.01, 1.0, 4.0, 0.04])
    parameters, found = pd.Series(ship.derivatives(start)), []
    begin = time.perf_counter()
    for _ in range(PASSES):
        filtering = ExtendedKalman(
            vmm=vmm_linear,
            parameters=parameters,
            ship_parameters={**ship.particulars, "U": 1.0},
            system_matrixes=matrices,
        )
        measured = ["psi", "u", "v", "r"]
        filtering.filter(data=data, P_prd=first, Qd=Q, Rd=R, E=E, Cd=C, measurement_columns=measured, do_checks=False)
        filtering.smoother()
        states = np.array([one["x_hat"].ravel() for one in filtering.time_steps_smooth])
        times = np.array([one["time"] for one in filtering.time_steps_smooth])
        smooth = pd.DataFrame(states, index=times, columns=["x0", "y0", "psi", "u", "v", "r"])
        for name in ("u", "v", "r"):
            smooth[f"{name}1d"] = np.gradient(smooth[name].to_numpy(), times)
        smooth["delta"] = data["delta"].to_numpy()[: len(smooth)]
        fitted = MotionRegression(
            vmm=vmm_linear,
            data=smooth,
            added_masses=ADDED,
            ship_parameters=ship.particulars,
            base_features=[delta, u, v, r],
            connect_equations_Y_N_rudder=False,
        )
        found.append(ship.hull(fitted.model_Y.params, fitted.model_N.params))
        parameters = pd.Series({**ship.derivatives(found[-1]), "Yu": _force(fitted.model_Y.params["Yu"], "Y")})
        parameters["Nu"] = _force(fitted.model_N.params["Nu"], "N")
    return found, time.perf_counter() - begin


def _force(acceleration: float, direction: str) -> float:
    inertia = MASSES["m"] - ADDED["Yvdot"] if direction == "Y" else MASSES["I_z"] - ADDED["Nrdot"]
    return float(acceleration * inertia)


def measured_lines() -> list[str]:
    """Lines of the page where the package is there."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from vessel_manoeuvring_models.extended_kalman_vmm import SystemMatrixes
        from vessel_manoeuvring_models.models.vmm_linear import vmm_linear

        matrices = SystemMatrixes(vmm_linear)
        rows, ratios = [], []
        for level in LEVELS:
            for seed in SEEDS[:3]:
                trial, record = sail(HULLS[0], level, seed)
                truth, arm = truth_of(trial), trial.truth.wind_arm_per_m
                found, seconds = run(record, matrices)
                passes = [found[0], found[-1]]
                for label, hull in zip(("package, 1 pass", f"package, {PASSES} passes"), passes, strict=True):
                    rows.append(_row(level, seed, label, hull, truth))
                for name in ("ekf-ols", "ml"):
                    own = estimate(name, record, ModelSpec(), arm, default_settings(name))
                    rows.append(_row(level, seed, name, own.hull.array(), truth))
                begin = time.perf_counter()
                estimate("ml", record, ModelSpec(), arm, default_settings("ml"))
                ratios.append(seconds / PASSES / (time.perf_counter() - begin))
    try:
        number = version(PACKAGE)
    except PackageNotFoundError:
        number = "of unknown version"
    head = ["level", "seed", "method", *HULL_PARAMETERS, "rms"]
    return [
        f"vessel-manoeuvring-models {number}, its linear model, beside numpy {version('numpy')} with two names lent to "
        "it (see the script); the first three records of each level on the page of the rivals. Given to it: heading, "
        "speed, lateral speed and yaw rate of the same record on the same grid, the same first ship, the same noise "
        "levels as our ekf-ols. Its equations hold the terms Yu u and Nu u, which take a constant force, as ours does.",
        "",
        "Errors, percent:",
        "",
        *result_page.table(head, rows),
        "",
        f"One pass of its filter, smoother and regression over a record took {np.median(ratios):.1f} times as long as "
        f"the whole maximum-likelihood fit of that record (median of {len(ratios)} records, one core, the symbolic "
        "preparation not counted).",
    ]


def _row(level: float, seed: int, label: str, hull: np.ndarray, truth: np.ndarray) -> list[str]:
    error = 100.0 * (hull / truth - 1.0)
    return [f"{level:g}", str(seed), label, *(f"{e:+.1f}" for e in error), f"{np.sqrt(np.mean(error**2)):.1f}"]


def main() -> None:
    missing = ["The package vessel-manoeuvring-models is not importable here, so it was not measured."]
    lines = measured_lines() if importable() else missing
    path = result_page.write("baselines.vessel_models", "EKF, smoother and regression: the package itself", lines)
    print(path.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
