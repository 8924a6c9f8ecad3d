"""What the instruments of a hidden case make of a voyage; the effects that sit in an instrument act here."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
from numpy.typing import NDArray

from benchmarks.diagnose.hidden_effects import plant
from benchmarks.diagnose.hidden_effects.as_sold import as_sold
from benchmarks.diagnose.hidden_effects.programme import QUICK_SHIP_S
from benchmarks.diagnose.hidden_effects.sail import Voyage
from kempf.pipeline.simulate.hulls import SimulatedHull
from kempf.pipeline.simulate.instruments import DEFAULT_INSTRUMENTS, Instrument, InstrumentRecord, measure
from kempf.pipeline.simulate.sensors import Setting
from kempf.pipeline.simulate.trajectory import Sample, Trajectory
from kempf.pipeline.simulate.trial import Trial, TrialSettings, Truth
from kempf.schemas.units import SECOND_NS

Float = NDArray[np.float64]

#: Samples a second and first sample, s; a ship whose own time is seconds carries faster ones, one that takes minutes
#: slower ones. All sample on tenths of a second, to 2 ms, and the depth arrives last: so the rows of the delimited log,
#: which start with it, find every reading equally old, and no channel is late that shall not be.
_RATES = {"gnss": 1.0, "heading": 5.0, "yaw_rate": 2.0, "rudder": 2.0, "log": 1.0, "wind": 1.0, "shaft": 1.0}
_RATES |= {"depth": 1.0, "roll": 2.0}
_PHASES = {"gnss": 0.2, "heading": 0.0, "yaw_rate": 0.1, "rudder": 0.3, "log": 0.4, "wind": 0.6, "shaft": 0.3}
_PHASES |= {"depth": 0.9, "roll": 0.1}
_DEPTH_LATENCY_S = 0.05
_QUICK = {"gnss": 5.0, "heading": 10.0, "yaw_rate": 10.0, "rudder": 10.0, "log": 5.0}
_SLOW = {"heading": 2.0, "yaw_rate": 1.0, "roll": 1.0}
_LATE = {"gnss": "gnss_latency", "heading": "heading_latency", "yaw_rate": "gyro_latency"}
_SLOW_SHIP_S = 30.0

#: A boat's log and receiver are of the kind that a boat needs.
_QUICK_NOISE = 0.3


class _Late(Trajectory):
    """A path seen some time after it happened."""

    latency_s: float = 0.0

    def at(self, time_s: Float) -> Sample:
        """Return the truth of ``latency_s`` ago under the instants of now."""
        return replace(super().at(np.maximum(time_s - self.latency_s, 0.0)), time_s=time_s)


def instruments(hull: SimulatedHull) -> tuple[Instrument, ...]:
    """Return what she carries."""
    time_s = hull.length_m / hull.trial_speed_m_s
    quick = _is_quick(hull)
    rates = _RATES | (_QUICK if quick else _SLOW if time_s > _SLOW_SHIP_S else {})
    found = []
    for one in DEFAULT_INSTRUMENTS:
        own = replace(one, rate_hz=rates[one.name], phase_s=_PHASES[one.name])
        if one.name == "depth":
            own = replace(own, jitter_s=0.0, latency_s=_DEPTH_LATENCY_S, latency_jitter_s=0.0)
        if quick:
            finer = {q: s * _QUICK_NOISE for q, s in one.noise.items() if q in ("velocity", "speed_through_water")}
            own = replace(own, noise={**one.noise, **finer})
        found.append(own)
    return tuple(found)


def _is_quick(hull: SimulatedHull) -> bool:
    return hull.length_m / hull.trial_speed_m_s < QUICK_SHIP_S


def read(
    hull: SimulatedHull,
    voyage: Voyage,
    wind_from_rad: float,
    settings: TrialSettings,
    sensor: tuple[str, float] | None,
    *,
    sold: bool = False,
) -> Trial:
    """Let the instruments measure a voyage.

    Parameters
    ----------
    wind_from_rad : float
        Where the true wind comes from.
    settings : TrialSettings
        Seed, noise, start, instruments and where she begins.
    sensor : (str, float) or None
        Name and parameter of the effect, where it sits in an instrument.
    sold : bool, optional
        Whether the instruments are as they are sold, see `benchmarks.diagnose.hidden_effects.as_sold`.

    Returns
    -------
    Trial
        As the loggers of `kempf.pipeline.simulate` write it.
    """
    path = voyage.trajectory()
    name, c = sensor or ("", 0.0)
    setting = Setting(
        *(settings.latitude_deg, settings.longitude_deg, c if name == "antenna_lever" else 0.0, 0.0),
        *(voyage.forcing[:, plant.FORCING.index("wind")], voyage.step_s, wind_from_rad, 0.0),
    )
    late = _Late(path.step_s, path.state, path.slope, path.rudder, path.order, path.forcing)
    late.__dict__["latency_s"] = c
    records = []
    for one in settings.instruments:
        stated = {"start_utc_ns": settings.start_utc_ns, "seed": settings.seed}
        seen = late if name == _LATE.get(one.name) else path
        record, clean = (
            _own(
                measure(one, seen, hull, setting, **stated, noise_scale=scale),
                *(voyage, hull, settings.start_utc_ns, name, c),
            )
            for scale in (settings.noise_scale, 0.0)
        )
        records.append(as_sold(record, clean, quick=_is_quick(hull)) if sold else record)
    truth = Truth(hull.parameters, hull.wind_arm_per_m, path, ())
    return Trial(settings, truth, tuple(records))


def _own(
    record: InstrumentRecord, voyage: Voyage, hull: SimulatedHull, start: int, name: str, c: float
) -> InstrumentRecord:
    """Put in what the instruments of the other simulator do not know: shaft, bottom, roll; and a faulty instrument."""
    time_s = (record.measured_utc_ns - start) / SECOND_NS
    values = dict(record.values)

    def truth(column: Float) -> Float:
        return np.interp(time_s, np.arange(column.size) * voyage.step_s, column)

    state = voyage.state[:, plant.STATE.index("phi")]
    match record.instrument.name:
        case "shaft":
            values["shaft_speed_per_s"] = (
                values["shaft_speed_per_s"] + truth(voyage.conditions[:, plant.N_]) - hull.shaft_speed_per_s
            )
        case "depth":
            values["water_depth_m"] = values["water_depth_m"] + truth(voyage.conditions[:, plant.H_])
        case "roll":
            V, r = (voyage.trajectory().column(x) for x in ("V", "r"))
            # the other simulator's ship heels at once; hers rolls
            values["roll_rad"] = values["roll_rad"] + truth(state) + hull.heel_per_g * truth(V * r) / 9.80665
        case "heading" if name == "heading_misalignment":
            values["heading_rad"] = (values["heading_rad"] + c) % (2.0 * pi)
        case "yaw_rate" if name == "gyro_bias":
            values["yaw_rate_rad_s"] = values["yaw_rate_rad_s"] + c
        case "yaw_rate" if name == "gyro_scale":
            values["yaw_rate_rad_s"] = values["yaw_rate_rad_s"] * (1.0 + c)
        case "log" if name == "log_scale":
            values["speed_through_water_m_s"] = values["speed_through_water_m_s"] / (1.0 + c)
        case _:
            return record
    return replace(record, values=values)
