"""The figures that the server draws: what their axes and labels say."""

from __future__ import annotations

import re

import numpy as np
import pytest

from kempf.schemas.channels import CHANNELS
from kempf.workbench.charts.channels import LATERAL, derived, entry
from kempf.workbench.charts.signs import SIGNS
from kempf.workbench.web.draw.correlation import draw_correlation
from kempf.workbench.web.draw.run import draw_run
from kempf.workbench.web.draw.sailed import draw_sailed
from kempf.workbench.web.draw.scale import ticks


def labels(figure: object) -> list[str]:
    """The words of a figure, in order."""
    return re.findall(r"<text[^>]*>([^<]*)</text>", str(figure))


def test_a_correlation_is_in_hundredths_on_the_diagonal_too():
    drawn = draw_correlation(["a11", "a12"], [[4.0, 1.9], [1.9, 1.0]])
    assert labels(drawn) == ["a11", "100", "a12", "95", "100"]


@pytest.mark.parametrize("most", [4, 5, 6, 7, 8, 9])
def test_an_axis_has_two_numbers_at_least_else_it_is_no_scale(most: int):
    rng = np.random.default_rng(1)
    for low, span in zip(rng.normal(0.0, 3.0, 500), 10.0 ** rng.uniform(-4.0, 4.0, 500), strict=True):
        found = ticks(float(low), float(low + span), most)
        assert 2 <= len(found) <= most + 1, (low, span)
        assert all(low - 1e-9 <= tick <= low + span + 1e-6 * span for tick in found)


def test_figures_say_which_way_is_positive():
    n = 20
    columns = {"time_utc_ns": np.arange(n) * 10**9, "rudder_angle_rad": np.zeros(n)}
    for name in ("yaw_rate", "heading", "lateral_speed"):
        unit = {"yaw_rate": "rad_s", "heading": "rad", "lateral_speed": "m_s"}[name]
        columns |= {f"{name}_{unit}": np.linspace(0.1, 0.2, n), f"{name}_predicted_{unit}": np.linspace(0.1, 0.2, n)}
    said = labels(draw_run(columns))
    for words in ("rudder, deg (starboard +)", "yaw rate, deg/s (starboard +)", "lateral speed, m/s (starboard +)"):
        assert words in said
    assert set(SIGNS) <= {*CHANNELS, LATERAL}
    # every channel whose description says so
    says = {name for name, one in CHANNELS.items() if re.search(r"positive|towards|to starboard", one.words)}
    assert says - set(SIGNS) == {"latitude", "longitude", "speed_through_water", "shaft_speed"}
    assert entry("rudder_order", "MCAP", shown=True)["sign"] == derived()["sign"] == "starboard +"


def test_of_a_predicted_zigzag_the_rudder_is_named_beside_its_line():
    over = np.deg2rad(np.repeat([0.0, 20.0, -20.0, 20.0], 5))
    curve = np.column_stack([np.arange(20.0), 0.3 * np.sin(np.arange(20.0)), over]).tolist()
    for side in (1.0, -1.0):
        sailed = [[t, side * k, side * r] for t, k, r in curve]
        said = labels(draw_sailed({"kind": "zigzag"}, {"estimates": [sailed], "ships": []}))
        assert "rudder" in said and "heading and rudder, deg, starboard +" in said
    circle = {"estimates": [[[0.0, 0.0], [1.0, 1.0]]], "ships": []}
    assert "across the approach, m, to the side of the turn +" in labels(
        draw_sailed({"kind": "turning-circle"}, circle)
    )
