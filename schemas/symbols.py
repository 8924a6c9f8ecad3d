"""What the formula of an effect may speak of, and what it may act on."""

from __future__ import annotations

#: what a term is added to, its unit, and in plain words
TARGETS: dict[str, tuple[str, str]] = {
    "sway": ("m/s^2", "sway acceleration dv/dt"),
    "yaw": ("rad/s^2", "yaw acceleration dr/dt"),
    "rudder": ("rad", "rudder angle that the hull feels"),
    "speed": ("m/s", "speed through the water"),
    "lateral_speed": ("m/s", "measured lateral speed, eq. (18)"),
    "yaw_rate": ("rad/s", "measured yaw rate"),
    "heading": ("rad", "measured heading"),
}
#: states that carry derivatives, in the filter's order; m1 to m4 belong to effects that bring states along
STATE_SYMBOLS: dict[str, str] = {
    "v": "lateral speed through the water, m/s",
    "r": "yaw rate, rad/s",
    "psi": "heading from its first value, rad",
    "F": "lateral wind acceleration, m/s^2",
    "M": "yaw acceleration beside the wind's, rad/s^2",
    "dV": "error of the speed as it was logged, m/s",
    "m1": "state of an effect",
    "m2": "state of an effect",
    "m3": "state of an effect",
    "m4": "state of an effect",
    "m5": "state of an instrument",
    "m6": "state of an instrument",
    "m7": "state of an instrument",
}
#: computed on the way, with derivatives
COMPUTED_SYMBOLS: dict[str, str] = {
    "delta": "rudder angle that the hull feels, rad",
    "V": "speed through the water, m/s",
    "vdot": "sway acceleration of the model, m/s^2 (in measurements only)",
    "rdot": "yaw acceleration of the model, rad/s^2 (in measurements only)",
    "vddot": "rate of change of vdot over the last step of the grid, m/s^3 (in measurements only)",
    "rddot": "rate of change of rdot over the last step of the grid, rad/s^3 (in measurements only)",
}
#: of these, what is known once the forces are
ACCELERATION_SYMBOLS: tuple[str, ...] = ("vdot", "rdot", "vddot", "rddot")
#: constants of the ship
SHIP_SYMBOLS: dict[str, str] = {
    "a11": "of eq. (16), 1/m",
    "a12": "of eq. (16)",
    "a21": "of eq. (16), 1/m^2",
    "a22": "of eq. (16), 1/m",
    "b1": "of eq. (16), 1/m",
    "b2": "of eq. (16), 1/m^2",
    "L": "length, m",
    "T": "draught, m",
    "V0": "speed that the shaft keeps on a straight course, that of the approach where no shaft speed is logged, m/s",
    "n0": "shaft speed that keeps V0, 1/s",
}
#: channels of the log by symbol; and three that every run has
CHANNEL_SYMBOLS: dict[str, str] = {
    "U": "wind_speed",
    "gamma": "wind_angle",
    "n": "shaft_speed",
    "h": "water_depth",
    "phi": "roll",
}
#: channels that a run lists: those above, and the log, without which V is the speed over ground
LOGGED_CHANNELS: tuple[str, ...] = (*CHANNEL_SYMBOLS.values(), "speed_through_water")
#: states that an effect may bring along
OWN_STATES: tuple[str, ...] = ("m1", "m2", "m3", "m4")
#: those that errors of instruments bring along beside them; no formula speaks of them by these names
INSTRUMENT_STATES: tuple[str, ...] = ("m5", "m6", "m7")
RUN_SYMBOLS: dict[str, str] = {
    "K": "true heading, rad",
    "t": "time from the beginning of the run, s",
    "day": "0 in runs of the vessel's first log, 1 in the second, and so on; where a draught is noted for each log, by "
    "how many tenths of the first one she lies deeper",
}
SYMBOLS: tuple[str, ...] = (
    *STATE_SYMBOLS,
    *COMPUTED_SYMBOLS,
    *SHIP_SYMBOLS,
    *CHANNEL_SYMBOLS,
    *RUN_SYMBOLS,
)
#: Place of each symbol among them.
INDEX: dict[str, int] = {name: i for i, name in enumerate(SYMBOLS)}
