"""Cross-flow drag: every strip of the hull resists its own sideways speed with the square of it.

The integral over the length is exact: with the greater M and the less m of the speeds |v| amidships and |r| L / 2 of
the ends by the turn alone, the mean of |v + x r| (v + x r) is v (M + m^2 / (3 M)), and the moment likewise. One drag
coefficient serves sway and yaw: their inertias, added mass included, stand as those of a hull whose radius of
gyration is a quarter of her length.
"""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

#: inertia in sway times the length squared over that in yaw
_INERTIA = 16.0
#: sideways speed amidships, and that of the ends by the turn alone
_DRIFT, _SWING = "abs(v)", "abs(L*r/2)"
_LESS, _MORE = f"min({_DRIFT}, {_SWING})", f"max({_DRIFT}, {_SWING})"
_SWAY = f"-c*v/L*({_MORE} + {_LESS}**2/(3*max({_MORE}, 0.000001)))"
_INNER = f"{_SWING}**2/8 + {_LESS}**2/4 - {_LESS}**4/(24*max({_SWING}**2, 0.000000000001))"
_YAW = f"-{_INERTIA:g}*c/L**2*(sign(r)*({_INNER}) + L*r/6*max({_DRIFT} - {_SWING}, 0))"

EFFECT = Effect(
    name="cross_flow_drag",
    title="cross-flow drag of the hull",
    group="hull",
    plain=(
        "Every strip along the hull resists its own sideways flow with the square of its speed, so a hull that "
        "drifts and turns is slowed more than in proportion."
    ),
    equation=(
        "dv/dt += -c/L mean(|v + x r| (v + x r)), dr/dt += -16 c/L^2 mean(x/L |v + x r| (v + x r)), means over "
        "-L/2 < x < L/2"
    ),
    reference=(
        "Fossen 2021, Handbook of marine craft hydrodynamics and motion control, 2nd ed.; Norrbin 1971, Theory "
        "and observations on the use of a mathematical model for ship manoeuvring, SSPA publ. 68"
    ),
    parameters=(
        Parameter(
            "c",
            "1",
            -1.0,
            12.0,
            (0.1,),
            "drag coefficient times draught, length squared and half the density, over the mass with added mass",
        ),
    ),
    terms={"sway": _SWAY, "yaw": _YAW},
    confounded_with=(
        "sway_quadratic, yaw_quadratic, yaw_abs_v_r, sway_abs_r_v and the cubic hull terms: it is close to a sum "
        "of them"
    ),
    separated_by=(
        "Turns at several rudder angles with a spiral or pull-out: drift and turn in other ratios weigh the parts "
        "of the drag differently."
    ),
)
