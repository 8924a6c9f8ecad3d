"""The catalogue: every effect can be computed, vanishes without its parameters and says what a person must know."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from kempf.pipeline.model import effects
from kempf.pipeline.model.effect_model import Augmented
from kempf.pipeline.model.effects import as_json, catalogue, digest, from_file, get
from kempf.pipeline.model.terms.effect import Effect
from kempf.pipeline.model.terms.expression import FUNCTIONS, compiled, names_in
from kempf.pipeline.model.terms.ordinary import answer, require_ordinary, run
from kempf.pipeline.model.terms.places import places
from kempf.pipeline.model.terms.symbols import CHANNEL_SYMBOLS, SYMBOLS
from kempf.schemas.errors import KempfError, NotFound
from kempf.workbench.effects_table import effects_table

ALL = catalogue()
DOCUMENT = Path(__file__).parents[2] / "docs" / "effects.md"
#: effects that DIAGNOSIS names, by the files that hold them
NAMED = {
    *("cross_flow_drag", "sway_quadratic", "yaw_quadratic", "yaw_abs_v_r", "sway_abs_r_v", "sway_cubic", "yaw_v2r"),
    *("sway_vr2", "yaw_cubic", "rudder_stall", "flow_straightening", "rudder_lag", "dead_time", "backlash"),
    *("rate_limit", "neutral_angle", "rudder_asymmetry", "propeller_wash", "propeller_walk", "speed_loss"),
    *("wind_force", "earth_current", "waves", "shallow_water", "antenna_lever", "heading_misalignment", "gyro_bias"),
    *("gyro_scale", "gnss_latency", "log_scale", "roll_coupling", "load_condition", "memory"),
}
UNITS = {"1", "s", "rad", "rad/s", "s/rad", "1/rad^2", "m", "m/s"}
each = pytest.mark.parametrize("effect", ALL.values(), ids=list(ALL))


def typical(effect: Effect) -> dict[str, float]:
    return {p.name: p.steps[0] for p in effect.parameters}


def at(text: str, parameters: dict[str, float], **symbols: float) -> float:
    """Value of a term for given symbols, all others 0."""
    index = {name: i for i, name in enumerate([*SYMBOLS, *parameters])}
    values = np.zeros(len(index))
    for name, number in {**symbols, **parameters}.items():
        values[index[name]] = number
    return float(run(compiled(text, index), values)[0])


def test_the_catalogue_holds_what_was_asked_for() -> None:
    assert set(ALL) >= NAMED
    assert len(ALL) >= 33
    assert list(ALL) == sorted(ALL)


@each
def test_it_can_be_computed_at_ordinary_states_and_is_absent_without_parameters(effect: Effect) -> None:
    require_ordinary(effect)
    programs, code, _ = Augmented((effect,)).table
    assert len(programs) == len(effect.terms) + 3 * len(effect.states)
    assert code.shape[1] == 2


@each
def test_it_does_something_at_its_typical_values(effect: Effect) -> None:
    own = tuple(state.name for state in effect.states)
    for text in effect.terms.values():
        assert np.any(answer(text, typical(effect), own, 0.1).value != 0.0)
    for state in effect.states:
        assert np.any(answer(state.derivative, typical(effect), own, 0.1).value != 0.0)
    if effect.rudder_course is not None:
        time = np.arange(0.0, 60.0, 0.1)
        rudder = 0.3 * np.sin(0.3 * time)
        assert (
            np.max(
                np.abs(effect.rudder_course(time, rudder, np.array([p.steps[-1] for p in effect.parameters])) - rudder)
            )
            > 1e-3
        )


@each
def test_every_parameter_can_be_absent_and_is_tried_within_its_bounds(effect: Effect) -> None:
    assert effect.parameters
    for parameter in effect.parameters:
        assert parameter.low < parameter.high
        assert parameter.unit in UNITS
        assert parameter.meaning
        assert parameter.name not in SYMBOLS and parameter.name not in FUNCTIONS
        assert list(parameter.steps) == sorted(set(parameter.steps))
        assert all(step != 0.0 and parameter.low < step < parameter.high for step in parameter.steps)
    first = effect.parameters[0]
    assert first.low <= 0.0 < first.high
    assert [p.name for p in effect.parameters if p.shapes] == (["k"] if effect.name == "waves" else [])
    assert len(first.steps) == (3 if effect.name in ("backlash", "dead_time", "rate_limit") else 1)


@each
def test_it_uses_its_parameters_and_asks_for_the_channels_it_speaks_of(effect: Effect) -> None:
    spoken = {name for place in places(effect) for name in names_in(place.text)}
    if effect.rudder_course is None:
        assert {p.name for p in effect.parameters} <= spoken
    assert set(effect.needs) == {channel for symbol, channel in CHANNEL_SYMBOLS.items() if symbol in spoken}


@each
def test_its_words_are_for_a_naval_architect(effect: Effect) -> None:
    assert re.fullmatch(r"[A-Z][A-Za-z ,;'-]{20,}\.", effect.plain), effect.plain
    assert "_" not in effect.title
    assert len(effect.separated_by) > 20 and effect.separated_by.endswith(".")
    assert re.search(r"\b(19|20)\d\d\b|ITTC", effect.reference)
    assert effect.confounded_with
    assert effect.equation
    for name in re.findall(r"\b[a-z]+_[a-z0-9_]+\b", effect.confounded_with):
        assert name in ALL, name


def test_the_document_has_the_table_that_the_command_prints() -> None:
    text = DOCUMENT.read_text(encoding="utf-8")
    shown = text.partition("<!-- catalogue: kempf effects list --markdown -->\n")[2]
    assert shown.partition("<!-- end of the catalogue -->")[0].strip() == effects_table(ALL.values()).strip()


@each
def test_its_content_is_json_and_its_digest_pins_it(effect: Effect) -> None:
    told = json.loads(json.dumps(as_json(effect), allow_nan=False))
    assert told["sha256"] == digest(effect) == digest(get(effect.name))
    assert digest(replace(effect, plain="Other words.")) == digest(effect)
    first = effect.parameters[0]
    wider = replace(effect, parameters=(replace(first, high=2.0 * first.high), *effect.parameters[1:]))
    assert digest(wider) != digest(effect)


def test_a_channel_that_tells_an_effect_already_is_one_that_runs_list() -> None:
    told = {name: effect.told_by for name, effect in ALL.items() if effect.told_by}
    assert told == {"speed_loss": ("speed_through_water",)}
    with pytest.raises(KempfError, match="'yaw_rate'"):
        replace(ALL["yaw_cubic"], told_by=("yaw_rate",))
    assert digest(replace(ALL["speed_loss"], told_by=())) != digest(ALL["speed_loss"])


def test_digests_differ() -> None:
    assert len({digest(effect) for effect in ALL.values()}) == len(ALL)


# ---------------------------------------------------------------- what they compute, against closed forms


def test_cross_flow_drag_is_the_integral_over_the_strips() -> None:
    effect, L = ALL["cross_flow_drag"], 120.0
    x = (np.arange(200_000) + 0.5) / 200_000 - 0.5
    for v, r in ((1.0, 0.0), (-0.7, 0.01), (0.3, 0.02), (0.0, -0.02), (0.6, -0.01), (-0.1, -0.02), (0.0, 0.0)):
        speed = v + x * L * r
        sway = -2.5 / L * np.mean(np.abs(speed) * speed)
        yaw = -16.0 * 2.5 / L**2 * np.mean(x * np.abs(speed) * speed)
        assert at(effect.terms["sway"], {"c": 2.5}, v=v, r=r, L=L) == pytest.approx(sway, rel=1e-8, abs=1e-15)
        assert at(effect.terms["yaw"], {"c": 2.5}, v=v, r=r, L=L) == pytest.approx(yaw, rel=1e-8, abs=1e-15)


@pytest.mark.parametrize("name", [n for n, e in ALL.items() if e.group == "hull" and e.parameters[0].low > -4.0])
def test_hull_damping_opposes_the_motion(name: str) -> None:
    effect = ALL[name]
    for target, symbol in (("sway", "v"), ("yaw", "r")):
        for sign in (-1.0, 1.0):
            if target in effect.terms:
                motion = {"v": 0.5, "r": 0.01, "V": 6.0, "L": 100.0} | {symbol: sign * {"v": 0.5, "r": 0.01}[symbol]}
                assert sign * at(effect.terms[target], typical(effect), **motion) < 0.0


@each
def test_hull_and_rudder_are_alike_to_both_sides_but_for_what_is_not(effect: Effect) -> None:
    if effect.group not in ("hull", "rudder", "propulsion") or effect.name in ("rudder_asymmetry", "neutral_angle"):
        return
    if effect.name == "propeller_walk" or effect.rudder_course is not None:
        return
    ship = {"V": 6.0, "L": 100.0, "V0": 7.0, "n0": 2.0, "n": 1.5, "b1": -1e-3, "b2": 6e-5}
    for target, text in effect.terms.items():
        if target == "speed":
            continue
        there = at(text, typical(effect), v=0.4, r=0.01, delta=0.2, **ship)
        back = at(text, typical(effect), v=-0.4, r=-0.01, delta=-0.2, **ship)
        assert there == pytest.approx(-back) and there != 0.0


def test_sensor_effects_follow_from_eq_18() -> None:
    # a ship that turns with V = 6, v = -0.5, r = 0.02 in a current; velocity over ground tau ago, heading tau ago
    V, r, tau, step = 6.0, 0.02, 0.05, 1e-5
    v = lambda t: -0.5 + 0.03 * t  # noqa: E731
    K = lambda t: 0.7 + r * t  # noqa: E731

    def over_ground(t: float) -> np.ndarray:
        return np.array([V * np.cos(K(t)) - v(t) * np.sin(K(t)) + 0.3, V * np.sin(K(t)) + v(t) * np.cos(K(t)) - 0.2])

    def lateral(velocity: np.ndarray, heading: float) -> float:
        return float(-velocity[0] * np.sin(heading) + velocity[1] * np.cos(heading))

    now = lateral(over_ground(0.0), K(0.0))
    late_gnss = lateral(over_ground(-step), K(0.0)) - now
    term = ALL["gnss_latency"].terms["lateral_speed"]
    assert at(term, {"tau": step}, vdot=0.03, V=V, r=r) == pytest.approx(late_gnss, rel=1e-3)
    late_heading = lateral(over_ground(0.0), K(-step)) - now
    term = ALL["heading_latency"].terms["lateral_speed"]
    current_ahead = 0.3 * np.cos(0.7) - 0.2 * np.sin(0.7)
    assert at(term, {"tau": step}, V=V + current_ahead, r=r) == pytest.approx(late_heading, rel=1e-3)
    askew = lateral(over_ground(0.0), K(0.0) + step) - now
    term = ALL["heading_misalignment"].terms["lateral_speed"]
    assert at(term, {"c": step}, V=V + current_ahead) == pytest.approx(askew, rel=1e-3)
    assert at(ALL["heading_latency"].terms["heading"], {"tau": tau}, r=r) == pytest.approx(K(-tau) - K(0.0))
    assert at(ALL["antenna_lever"].terms["lateral_speed"], {"x": 12.0}, r=r) == pytest.approx(0.24)


def test_waves_have_the_spread_and_the_frequency_that_are_asked_for() -> None:
    effect, L = ALL["waves"], 80.0
    told = {"c": 0.02, "k": 1.3}
    w = 1.3 * np.sqrt(9.81 / L)
    first, second = effect.states
    A = np.array([[0.0, 1.0], [at(second.derivative, told, L=L, m1=1.0), at(second.derivative, told, L=L, m2=1.0)]])
    q = at(second.noise, told, L=L)
    stationary = np.diag([at(first.initial_std, told, L=L) ** 2, at(second.initial_std, told, L=L) ** 2])
    assert A @ stationary + stationary @ A.T + np.diag([0.0, q**2]) == pytest.approx(np.zeros((2, 2)), abs=1e-15)
    assert stationary[0, 0] == pytest.approx(0.02**2)
    assert np.abs(np.linalg.eigvals(A)) == pytest.approx([w, w])
    assert at(first.derivative, told, m2=0.3) == 0.3


def test_what_stands_for_eq_16_scales_it() -> None:
    ship = {"a11": -5e-3, "a21": -1e-4, "a22": -0.01, "b1": -1e-3, "b2": 6e-5, "V": 6.0, "V0": 7.0, "v": 0.4, "r": 0.01}
    sway, yaw = -5e-3 * 6.0 * 0.4, 6.0 * (-1e-4 * 0.4 - 0.01 * 0.01)
    load = ALL["load_condition"].terms
    assert at(load["sway"], {"c": 0.1}, day=2.0, **ship) == pytest.approx(0.2 * sway)
    assert at(load["yaw"], {"c": 0.1}, day=2.0, delta=0.2, **ship) == pytest.approx(0.2 * (yaw + 6e-5 * 36.0 * 0.2))
    shallow = ALL["shallow_water"].terms
    assert at(shallow["yaw"], {"c": 1.0}, T=5.0, h=10.0, **ship) == pytest.approx(0.25 * yaw)
    assert at(shallow["sway"], {"c": 1.0}, T=5.0, h=2.0, **ship) == pytest.approx(sway)  # a depth less than the draught
    power = ALL["speed_exponent"].terms["yaw"]
    assert at(power, {"c": 1.0}, delta=0.2, **ship) == pytest.approx(6e-5 * 0.2 * (36.0 * 7.0 / 6.0 - 36.0))
    wash = ALL["propeller_wash"].terms["yaw"]
    told = {"n": 1.8, "n0": 2.0, "delta": 0.2}
    assert at(wash, {"c": 1.0}, **told, **ship) == pytest.approx(6e-5 * 0.2 * ((7.0 * 0.9) ** 2 - 36.0))


def test_wind_from_starboard_pushes_to_port_and_turns_the_bow_away() -> None:
    effect = ALL["wind_force"]
    wind = {"U": 10.0, "L": 100.0}
    assert at(effect.terms["sway"], typical(effect), gamma=np.pi / 2, **wind) < 0.0
    assert at(effect.terms["yaw"], typical(effect), gamma=np.pi / 4, **wind) < 0.0
    assert at(effect.terms["yaw"], typical(effect), gamma=0.0, **wind) == 0.0


def test_a_turn_takes_speed_away() -> None:
    effect = ALL["speed_loss"]
    told = {"V": 7.0, "L": 100.0, "delta": 0.3, "v": -0.6, "r": 0.02}
    assert at(effect.states[0].derivative, typical(effect), **told) > 0.0
    assert at(effect.terms["speed"], typical(effect), m1=1.0) == -1.0


# ---------------------------------------------------------------- adding one


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A second folder that the catalogue reads."""
    monkeypatch.setattr(effects, "__path__", [*effects.__path__, str(tmp_path)])
    before = set(sys.modules)
    yield tmp_path
    for name in set(sys.modules) - before:
        if name.startswith("kempf.pipeline.model.effects."):
            del sys.modules[name]


GOOD = """
from kempf.pipeline.model.terms.effect import Effect, Parameter
EFFECT = Effect(
    name="{name}", title="t", group="hull", plain="p", equation="e", reference="r",
    parameters=(Parameter("c", "1", -1.0, 1.0, (0.1,), "m"),), terms={{"{target}": "c*r"}},
)
"""


def test_adding_one_is_adding_one_file(folder: Path) -> None:
    (folder / "quite_new.py").write_text(GOOD.format(name="quite_new", target="yaw"), encoding="utf-8")
    assert set(catalogue()) == {*ALL, "quite_new"}


def test_the_worked_example_of_the_document_works(folder: Path) -> None:
    text = DOCUMENT.read_text(encoding="utf-8")
    name, source = re.findall(r"```python\n# pipeline/model/effects/(\w+)\.py\n(.*?)```", text, flags=re.DOTALL)[0]
    (folder / f"{name}.py").write_text(source, encoding="utf-8")
    assert name not in ALL
    added = catalogue()[name]
    require_ordinary(added)
    assert added.plain and added.separated_by


def test_the_effect_file_of_the_document_works() -> None:
    shown = re.findall(r"```yaml\n(.*?)```", DOCUMENT.read_text(encoding="utf-8"), flags=re.DOTALL)
    assert len(shown) == 1
    effect = from_file(shown[0], "own.yaml")
    assert effect.group == "own"
    assert effect.needs == ("wind_speed", "wind_angle")


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ("raise RuntimeError('no')", "raised RuntimeError: no"),
        ("import there_is_no_such_module", "ModuleNotFoundError"),
        ("x = (", "SyntaxError"),
        ("x = 1", "defines no EFFECT"),
        (GOOD.format(name="other", target="yaw"), "bears the name of its effect"),
        (GOOD.format(name="yaw_cubic", target="yaw"), "is called 'yaw_cubic'"),
        (GOOD.format(name="zz_wrong", target="roll"), "'roll'"),
    ],
)
def test_a_wrong_file_in_the_folder_is_one_clear_error(folder: Path, content: str, told: str) -> None:
    (folder / "zz_wrong.py").write_text(content, encoding="utf-8")
    with pytest.raises(KempfError, match=re.escape(told)) as caught:
        catalogue()
    assert caught.value.code == "catalogue_invalid"
    assert "zz_wrong.py" in caught.value.message


def test_an_unknown_effect_is_not_found() -> None:
    with pytest.raises(NotFound, match="did you mean 'yaw_quadratic'"):
        get("yaw_quadratics")
