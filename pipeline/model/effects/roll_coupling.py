"""Roll turns the ship: a heeled hull is no longer symmetric."""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="roll_coupling",
    title="turning moment of the heel",
    group="other",
    plain="A heeled hull is no longer symmetric in the water and turns by itself.",
    equation="dr/dt += -c V^2 phi / L^2",
    reference=(
        "Son & Nomoto 1981, On the coupled motion of steering and rolling of a high-speed container ship, J. SNAJ "
        "150; Fossen 2021"
    ),
    parameters=(
        Parameter(
            "c",
            "1",
            -10.0,
            10.0,
            (0.3,),
            "moment without dimension, positive where heel to starboard turns her to port",
        ),
    ),
    terms={"yaw": "-c*V**2*phi/L**2"},
    needs=("roll",),
    confounded_with="the hull's damping where the roll follows the turn without a motion of its own",
    separated_by="Log the roll at 2 Hz or faster in a zigzag that makes her swing, or on a day with a list.",
)
