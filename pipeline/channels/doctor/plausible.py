"""Values that no ship has: beyond what the channel can measure, or of a ship of another size or speed than hers.

No two channels are compared here, but one with the nature of the thing, and all with the profile's length and trial
speed.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from kempf.pipeline.channels.doctor.faults import unit_faults
from kempf.pipeline.channels.doctor.log import VELOCITIES, Log, integral
from kempf.pipeline.channels.doctor.motion import may_drift, speed_of, stream_std, under_way
from kempf.pipeline.channels.doctor.outcome import CheckFigure, Outcome, State, worst
from kempf.pipeline.channels.doctor.robust_regression import quantile, reach
from kempf.pipeline.channels.series import Float
from kempf.schemas.channels import CHANNELS

#: Share of a channel's values that may lie outside its physical range: damaged lines make one in some hundred.
_DAMAGED = 0.05
_FEWEST = 10
#: What the readings may reach all but one time in fifty, SI: no displacement ship makes 35 m/s or turns by 60 deg
#: in a second, and no rudder or ship lies over so far.
_REACH = {
    **dict.fromkeys(
        ("speed_over_ground", "speed_through_water", *VELOCITIES["earth"], *VELOCITIES["body"]), 35.0
    ),
    "yaw_rate": float(np.deg2rad(60.0)),
    "rudder_angle": float(np.deg2rad(80.0)),
    "rudder_order": float(np.deg2rad(80.0)),
    "roll": float(np.deg2rad(60.0)),
    "pitch": float(np.deg2rad(45.0)),
}  # fmt: skip
_MOSTLY = 0.98
#: What a ship's fast speed is of her trial speed, at most.
_OF_TRIAL = 1.5
_GRAVITY_M_S2 = 9.80665
#: Froude number, rate of turn times length over speed, and the same for each rad of rudder, that no ship leaves: of
#: displacement ships 0.1 to 0.4, at most about 1, and 0.5 to 2.
_FROUDE, _TURN, _TURN_OF_RUDDER = (0.0, 1.0), (0.0, 2.5), (0.4, 4.5)
#: One standard error of these figures as a share of them; less rudder and less
#: of a turn than this say nothing, rad.
_SHARE, _LEAST_RUDDER, _LEAST_TURN = 0.07, float(np.deg2rad(10.0)), float(np.deg2rad(30.0))
#: Logarithms of what the three and the share of the trial speed usually are, and how they vary from ship to ship.
_USUAL = {"speed": (0.0, 0.25), "froude": (np.log(0.2), 0.8), "turn": (np.log(0.6), 0.5), "rudder": (0.0, 0.45)}
#: What each of them is multiplied by, as a power, where length, speed or trial speed are too large by a factor.
_LENGTH, _SPEED = "length_m of the profile", "the speed"
_POWERS = {
    _LENGTH: {"froude": -0.5, "turn": 1.0, "rudder": 1.0},
    _SPEED: {"speed": 1.0, "froude": 1.0, "turn": -1.0, "rudder": -1.0},
    "trial_speed_m_s of the profile": {"speed": -1.0},
    "the turn": {"turn": 1.0, "rudder": 1.0},
}
#: A cause leaves so much less over than another where it is the likelier one, and so much at most where it is one at
#: all, in squared standard deviations.
_LIKELIER, _FITS = 4.0, 9.0


def examine(log: Log, *, thorough: bool = True) -> list[Outcome]:
    """Compare values with what a channel and a ship of her size can have.

    Returns
    -------
    list of Outcome
        ``range_CHANNEL`` of each channel that has values beyond its reach; ``size_and_speed`` where the profile has a
        length or a trial speed.

    References
    ----------
    Clarke, Gedling and Hine (1983), "The application of manoeuvring criteria in hull design using linear theory", RINA
    Transactions 125: gains K' = K L/U of ships.
    """
    outcomes = [*_ranges(log)]
    if thorough and (log.length_m is not None or log.trial_speed_m_s is not None):
        outcomes += _size_and_speed(log)
    return outcomes


def _ranges(log: Log) -> Iterator[Outcome]:
    for name in [*CHANNELS, *(name for name in log.refused if name not in CHANNELS)]:
        series, refused = log.series.get(name), log.refused.get(name, 0)
        kept = 0 if series is None else len(series)
        figures, words = [], []
        channel = CHANNELS.get(name)
        if refused >= _FEWEST:
            share = refused / (refused + kept)
            std = float(np.sqrt(max(share * (1.0 - share), 1e-12) / (refused + kept)))
            figures.append(CheckFigure("share of the values outside the channel's range", share, std, 0.0, _DAMAGED))
            words.append(f"{refused} of {refused + kept} values lie outside its range{_limits(name)} and were refused")
        if series is not None and channel is not None and name in _REACH and kept >= _FEWEST:
            fast = quantile(np.abs(series.value), _MOSTLY)
            figures.append(CheckFigure("size of the values", fast, 0.0, 0.0, _REACH[name], channel.unit))
            words.append(f"one in fifty values is beyond {_shown(fast, channel.unit)}")
        if any(figure.state == "disagree" for figure in figures):
            text = "; ".join(w for w, figure in zip(words, figures, strict=True) if figure.state == "disagree")
            yield Outcome(f"range_{name}", (name,), "disagree", text, tuple(figures), 1.0,
                          claim=f"{name} has values that no ship has")  # fmt: skip
        elif figures:
            yield Outcome(f"range_{name}", (name,), "agree", f"{name} is within its range", tuple(figures),
                          alone=True)  # fmt: skip


def _limits(name: str) -> str:
    channel = CHANNELS.get(name)
    return f" ({_shown(channel.low, channel.unit)} to {_shown(channel.high, channel.unit)})" if channel else ""


def _shown(value: float, unit: str) -> str:
    if unit == "rad":
        return f"{np.rad2deg(value):.4g} deg"
    return f"{np.rad2deg(value):.4g} deg/s" if unit == "rad/s" else f"{value:.4g} {unit}"


def _size_and_speed(log: Log) -> list[Outcome]:
    speeds = dict(_fast_speeds(log))
    if not speeds:
        return []
    figures: list[CheckFigure] = []
    ratios: dict[str, float] = {}
    typical = float(np.median(list(speeds.values())))
    trial, length = log.trial_speed_m_s, log.length_m
    if trial is not None:
        std = stream_std(log, trial) / trial
        figures += [
            CheckFigure(f"{name} over trial speed", speed / trial, std, 0.0, _OF_TRIAL)
            for name, speed in speeds.items()
        ]
        ratios["speed"] = typical / trial
    if length is not None:
        ratios["froude"] = typical / float(np.sqrt(_GRAVITY_M_S2 * length))
        figures.append(_figure("Froude number", ratios["froude"], _FROUDE))
        figures += _turning(log, length, ratios)
    whose = [channel for name in speeds for channel in _CHANNELS.get(name, (name,))]
    whose += [name for name, figure in (("yaw_rate", "turn"), ("rudder_angle", "rudder")) if figure in ratios]
    channels = tuple(dict.fromkeys(whose))
    state: State = worst([figure.state for figure in figures])
    if state != "disagree":
        return [
            Outcome("size_and_speed", channels, "agree", "values of a ship of her size", tuple(figures), alone=True)
        ]
    text = "; ".join(
        f"{figure.name} is {figure.value:.2g}, expected {figure.low:g} to {figure.high:g}"
        for figure in figures if figure.state == "disagree"
    )  # fmt: skip
    words = f"up to {max(speeds.values()):.3g} m/s{_of_whom(log)}: {text}"
    likely = _likely(ratios)
    suspects = tuple(
        replace(fault, simplicity=2) for name in speeds for fault in unit_faults(_CHANNELS.get(name, (name,)), "m/s")
        if likely is None or list(likely) == [_SPEED]
    )  # fmt: skip
    outcome = Outcome("size_and_speed", channels, "disagree", words, tuple(figures), _left(ratios), suspects,
                      claim=_claimed(likely), distrusts_length=True)  # fmt: skip
    return [outcome]


_CHANNELS = {"velocity": VELOCITIES["earth"], "body-fixed velocity": VELOCITIES["body"]}


def _fast_speeds(log: Log) -> Iterator[tuple[str, float]]:
    for name in ("speed_through_water", "speed_over_ground"):
        if name in log.series:
            yield name, quantile(np.abs(log.series[name].value), _MOSTLY)
    for name, kind in (("velocity", "earth"), ("body-fixed velocity", "body")):
        velocity = log.velocity(kind)
        if velocity is not None:
            yield name, quantile(np.abs(velocity.value), _MOSTLY)


def _turning(log: Log, length: float, ratios: dict[str, float]) -> Iterator[CheckFigure]:
    """Yield the figures of the rate of turn while she is under way."""
    rate, speed, rudder = log.series.get("yaw_rate"), speed_of(log), log.series.get("rudder_angle")
    if rate is None or speed is None or may_drift(log, quantile(speed.value, _MOSTLY)):
        return  # one that drifts may turn as she likes
    at = speed.at(rate.time_utc_ns, np.inf)
    known = np.concatenate([under_way(speed, rate.time_utc_ns), [False]]) & np.isfinite(at)
    if np.count_nonzero(known) < _FEWEST or reach(integral(rate).value[known]) < _LEAST_TURN:
        return
    turned: Float = rate.value[known] * length / at[known]
    ratios["turn"] = quantile(np.abs(turned), 0.99)
    yield _figure("rate of turn times length over speed", ratios["turn"], _TURN)
    put = None if rudder is None else rudder.at(rate.time_utc_ns[known], np.inf)
    put = None if put is None else put[np.isfinite(put)]
    if put is not None and put.size >= _FEWEST and reach(put) > _LEAST_RUDDER and ratios["turn"] > 0.0:
        ratios["rudder"] = reach(turned) / reach(put)
        yield _figure("the same over the rudder angle", ratios["rudder"], _TURN_OF_RUDDER)


def _figure(name: str, value: float, band: tuple[float, float]) -> CheckFigure:
    return CheckFigure(name, value, _SHARE * value, *band)


def _of_whom(log: Log) -> str:
    particulars = []
    if log.length_m is not None:
        particulars.append(f"{log.length_m:g} m long")
    if log.trial_speed_m_s is not None:
        particulars.append(f"with a trial speed of {log.trial_speed_m_s:g} m/s")
    return f", in a ship {' and '.join(particulars)}"


def _scaled(ratios: dict[str, float]) -> dict[str, float]:
    """Return by how many of their standard deviations the logarithms lie beside what is usual."""
    return {
        name: (float(np.log(max(value, 1e-6))) - _USUAL[name][0]) / _USUAL[name][1] for name, value in ratios.items()
    }


def _left(ratios: dict[str, float]) -> float:
    return min(sum(off**2 for off in _scaled(ratios).values()) / 25.0, 1.0)


def _likely(ratios: dict[str, float]) -> dict[str, float] | None:
    """Return which of the profile's figures or of the channels may be off, and by what factor; None where none fits.

    One of them is taken to be wrong by a factor: what it then leaves over of the logarithms, in squares of how these
    vary from ship to ship, is compared with what the others would.
    """
    off = _scaled(ratios)
    total, left, factor = sum(value**2 for value in off.values()), dict[str, float](), dict[str, float]()
    for cause, powers in _POWERS.items():
        way = {name: powers.get(name, 0.0) / _USUAL[name][1] for name in off}
        size = sum(value**2 for value in way.values())
        if size > 0.0:
            along = sum(off[name] * way[name] for name in off) / size
            left[cause], factor[cause] = total - along**2 * size, float(np.exp(along))
    best = min(left.values())
    return {c: factor[c] for c, rest in left.items() if rest - best < _LIKELIER} if best <= _FITS else None


def _claimed(likely: dict[str, float] | None) -> str:
    if likely is None:
        return "speeds, turns, length and trial speed are not those of one ship"
    each = " or ".join(f"{cause} ({_times(factor)})" for cause, factor in likely.items())
    return f"{each} is likely wrong"


def _times(factor: float) -> str:
    return f"about {factor:.2g} times too large" if factor > 1.0 else f"about {1.0 / factor:.2g} times too small"
