"""What speaks against an estimate although the search converged, in words for the person who is to trust it."""

from __future__ import annotations

from typing import Any

from kempf.pipeline.channels.series import Float
from kempf.schemas.model_spec import HULL_PARAMETERS

#: lag-1 autocorrelation of whitened innovations above which the standard errors are not to be believed
_NOT_WHITE = 0.3
#: standard errors of a lag-1 autocorrelation within which noise may be fresh at every reading
_CHANCE = 3.0
#: a 95 % interval that holds fewer than this share of the measurements is too narrow
_TOO_FEW = 0.90
#: standard errors beyond which a value has a sign
_SIGN = 2.0


def not_white(fit: dict[str, Any]) -> tuple[str, ...]:
    """Return the measurements whose prediction errors resemble their predecessors.

    Parameters
    ----------
    fit : dict
        See `kempf.pipeline.estimate.one_step_fit.one_step_fit`.
    """
    channels = fit.get("channels", {})
    return tuple(name for name, channel in channels.items() if abs(channel["lag1_autocorrelation"]) > _NOT_WHITE)


def may_last(fit: dict[str, Any]) -> bool:
    """Return whether prediction errors of a measurement resemble their predecessors by more than chance.

    Parameters
    ----------
    fit : dict
        See `kempf.pipeline.estimate.one_step_fit.one_step_fit`.
    """
    channels = fit.get("channels", {}).values()
    return any(abs(channel["lag1_autocorrelation"]) > _CHANCE / channel["n"] ** 0.5 for channel in channels)


def plausibility_warnings(hull: Float, std: Float, fit: dict[str, Any]) -> tuple[str, ...]:
    """Name what is implausible about an estimate.

    Parameters
    ----------
    hull : ndarray, shape (6,)
        a11, a12, a21, a22, b1, b2.
    std : ndarray, shape (6,)
        Their standard errors, NaN where there is none.
    fit : dict
        See `kempf.pipeline.estimate.one_step_fit.one_step_fit`.

    Returns
    -------
    tuple of str
        One sentence each; empty where nothing speaks against it.
    """
    # a sign is one only beyond the error
    a11, _, a21, a22, b1, b2 = (
        0.0 if abs(p) <= _SIGN * error else float(p) for p, error in zip(hull, std, strict=True)
    )
    vague = [name for name, value, error in zip(HULL_PARAMETERS, hull, std, strict=True) if error >= abs(value)]
    warnings = []
    if vague:
        cure = "a zigzag of other angles or more legs, or several pooled, would determine them"
        warnings.append(f"not determined, error as large as the value ({cure}): {', '.join(vague)}")
    if a11 > 0:
        warnings.append("a11 > 0: sway unstable by itself, not physical; an unmodelled force is likely")
    if a22 > 0:
        warnings.append("a22 > 0: yaw unstable by itself, not physical; an unmodelled moment is likely")
    if a21 > 0:
        warnings.append("a21 > 0: unusual for a hull; an unmodelled force is likely")
    if b2 < 0:
        warnings.append("b2 < 0: the rudder turns the ship the wrong way; check the sign of the rudder channel")
    elif b1 > 0:
        warnings.append("b1 > 0: the rudder pushes the stern the wrong way; sway and yaw are hardly distinguished")
    unlike_noise = not_white(fit)
    for name, channel in fit.get("channels", {}).items():
        lag, inside = channel["lag1_autocorrelation"], channel["inside_95_percent"]
        if name in unlike_noise:
            warnings.append(
                f"the prediction errors of {name} are not white (lag-1 autocorrelation {lag:.2f}): "
                "the model lacks something, or the instrument's noise is not independent"
            )
        if inside < _TOO_FEW:
            warnings.append(f"only {100 * inside:.0f} % of {name} lie in their 95 % prediction interval")
    return tuple(warnings)
