"""A parameter set as a file that other programs read: YAML, CSV, JSON, python-control, MATLAB."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import yaml

from kempf.warehouse.tables.parameter_set import ParameterSet

if TYPE_CHECKING:
    from kempf.flows.jobs.identify.ship_model import ShipOfSet
    from kempf.pipeline.steering.state_space import StateSpace

#: bytes of the description at the head of a MAT file, which scipy fills with the time of day
_MAT_DESCRIPTION = 116


@dataclass(frozen=True, eq=False)
class Linear:
    """A ship with her state space, continuous and sampled at a step."""

    ship: ShipOfSet
    continuous: StateSpace
    discrete: StateSpace


def as_text(parameter_set: ParameterSet, form: str) -> str:
    """Write a parameter set as YAML, CSV or JSON.

    Parameters
    ----------
    form : {"yaml", "csv", "json"}
        CSV holds the parameters alone: group, name, value, std, unit; the group ``fitted_to_legs`` where predictions
        take these.
    """
    from kempf.flows.jobs.identify.leg_fit import by_name

    if form == "csv":
        stream = io.StringIO()
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(["parameter_set_id", "group", "name", "value", "std", "unit"])
        for group in ("parameters", "discrete", "noise"):
            for p in getattr(parameter_set, group):
                error = "" if p.std is None else repr(p.std)
                writer.writerow([parameter_set.parameter_set_id, group, p.name, repr(p.value), error, p.unit])
        units = {p.name: p.unit for p in parameter_set.parameters}
        for name, (value, std) in by_name(parameter_set).items():
            row = [parameter_set.parameter_set_id, "fitted_to_legs", name, repr(value), repr(std), units[name]]
            writer.writerow(row)
        return stream.getvalue()
    content = {key: value for key, value in parameter_set.as_json().items() if key != "iterations"}
    if form == "json":
        return json.dumps(content, indent=2) + "\n"
    return str(yaml.safe_dump(json.loads(json.dumps(content)), sort_keys=False, allow_unicode=True))


def linear(ship: ShipOfSet, step_s: float, course_rad: float) -> Linear:
    """Return the state space of a ship about a course, continuous and at a step.

    Raises
    ------
    UsageError
        The step is not positive, or the course not finite.
    """
    from kempf.pipeline.steering.state_space import continuous, discretised

    model = continuous(
        ship.hull,
        ship.spec,
        ship.speed_m_s,
        arm_per_m=ship.arm_per_m,
        course_rad=course_rad,
        noise=ship.noise,
        effects=ship.effects,
    )
    return Linear(ship, model, discretised(model, step_s))


def as_control(model: Linear) -> str:
    """Write a Python module for python-control with the continuous and the discrete system, named, and their noise."""
    parameter_set, about = model.ship.parameter_set, model.continuous
    names, values, spread, units = _parameters(model.ship)
    units_of = {**about.states, **about.inputs, **about.outputs}
    lines = [
        '"""A ship identified by Kempf as python-control systems: `continuous` and `discrete`."""',
        "",
        "import control",
        "import numpy as np",
        "",
        "nan = np.nan",
        f"VESSEL = {parameter_set.vessel!r}",
        f"PARAMETER_SET = {parameter_set.parameter_set_id!r}",
        f"CONVERGED = {bool(parameter_set.convergence.get('converged'))!r}",
        f"WARNINGS = {list(model.ship.warnings)!r}",
        f"SPEED_M_S = {about.speed_m_s!r}  # through the water; the matrices hold at this speed",
        f"COURSE_RAD = {about.course_rad!r}  # psi is counted from it",
        f"RUDDER_RAD = {about.rudder_rad!r}  # with which she holds the course; the input is counted from it",
        f"OFFSETS = {_array(about.offsets)}  # of the outputs on that course",
        f"UNITS = {units_of!r}",
        f"PARAMETERS = {dict(zip(names, values, strict=True))!r}",
        f"STANDARD_ERRORS = {dict(zip(names, spread, strict=True))!r}  # None: unknown",
        f"PARAMETER_UNITS = {dict(zip(names, units, strict=True))!r}",
        f"COVARIANCE = {_array(model.ship.covariance)}  # of PARAMETERS, in their order",
        "",
        f"NAMES = dict(states={list(about.states)!r}, inputs={list(about.inputs)!r}, outputs={list(about.outputs)!r})",
    ]
    for name, system in (("continuous", about), ("discrete", model.discrete)):
        matrices = ",\n".join(f"    {_array(matrix)}" for matrix in (system.A, system.B, system.C, system.D))
        step = "" if system.step_s is None else f"    {system.step_s!r},  # s, the rudder held over the step\n"
        lines += ["", f"{name} = control.ss(\n{matrices},\n{step}    name={name!r},\n    **NAMES,\n)"]
    lines += [
        "",
        "# Noise: W per second on the states of `continuous`, Q a step on those of `discrete`; R of one measurement of",
        "# the first three outputs. For an estimator: control.lqe(A, I, C[:3], W, R), control.dlqe(A, I, C[:3], Q, R).",
        f"W = {_array(about.Q)}",
        f"Q = {_array(model.discrete.Q)}",
        f"R = {_array(about.R)}",
    ]
    return "\n".join(lines) + "\n"


def as_mat(model: Linear) -> bytes:
    """Write a MATLAB file (version 5): A, B, C, D, Ad, Bd, step_s, noise, names, units, parameters, covariance.

    Equal content gives equal bytes.
    """
    import numpy as np
    from scipy.io import savemat

    parameter_set, about = model.ship.parameter_set, model.continuous
    names, values, spread, units = _parameters(model.ship)

    def cells(texts: list[str]) -> Any:
        column = np.empty((len(texts), 1), dtype=object)
        column[:, 0] = texts
        return column

    content: dict[str, Any] = {
        "A": about.A,
        "B": about.B,
        "C": about.C,
        "D": about.D,
        "W": about.Q,
        "Ad": model.discrete.A,
        "Bd": model.discrete.B,
        "Qd": model.discrete.Q,
        "R": about.R,
        "step_s": model.discrete.step_s,
        "speed_m_s": about.speed_m_s,
        "course_rad": about.course_rad,
        "rudder_rad": about.rudder_rad,
        "output_offsets": about.offsets[:, None],
        "state_names": cells(list(about.states)),
        "state_units": cells(list(about.states.values())),
        "input_names": cells(list(about.inputs)),
        "input_units": cells(list(about.inputs.values())),
        "output_names": cells(list(about.outputs)),
        "output_units": cells(list(about.outputs.values())),
        "parameter_names": cells(names),
        "parameter_units": cells(units),
        "parameter_values": np.array(values, dtype=np.float64)[:, None],
        "parameter_std": np.array(spread, dtype=np.float64)[:, None],
        "parameter_covariance": model.ship.covariance,
        "parameter_set_id": parameter_set.parameter_set_id,
        "vessel": parameter_set.vessel,
        "converged": bool(parameter_set.convergence.get("converged")),
        "warnings": cells(list(model.ship.warnings)),
    }
    stream = io.BytesIO()
    savemat(stream, content)
    data = stream.getvalue()
    described = f"MATLAB 5.0 MAT-file, ship of parameter set {parameter_set.parameter_set_id}, written by Kempf"
    return described.encode("ascii", "replace")[:_MAT_DESCRIPTION].ljust(_MAT_DESCRIPTION) + data[_MAT_DESCRIPTION:]


def _parameters(ship: ShipOfSet) -> tuple[list[str], list[float], list[float | None], list[str]]:
    parameters = ship.parameters
    spread = [p.std if p.std is not None and p.std == p.std else None for p in parameters]
    return [p.name for p in parameters], [p.value for p in parameters], spread, [p.unit for p in parameters]


def _array(matrix: Any) -> str:
    return f"np.array({matrix.tolist()!r})"
