"""The catalogue: every effect can be computed, vanishes without its parameters and says what a person must know."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

from kempf.pipeline.model.effect_model import EffectModel
from kempf.pipeline.model.effects import RUDDER_COURSES
from kempf.pipeline.model.terms.expression import FUNCTIONS, compiled, names_in
from kempf.pipeline.model.terms.ordinary import answer, require_ordinary, run
from kempf.pipeline.model.terms.own import from_file
from kempf.pipeline.model.terms.places import places
from kempf.schemas import effects
from kempf.schemas.effect import Effect, RudderCourse
from kempf.schemas.effects import catalogue, get
from kempf.schemas.errors import KempfError, NotFound
from kempf.schemas.symbols import CHANNEL_SYMBOLS, SYMBOLS
from kempf.workbench.effects_table import effects_table

ALL = catalogue()
FOLDER = Path(__file__).parents[2] / "schemas" / "effects"
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


def changed(effect: Effect, **fields: Any) -> Effect:
    """The effect with other fields, checked as a new one."""
    return Effect.model_validate({**dict(effect), **fields})


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
    programs, code, _, _ = EffectModel((effect,)).table
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
        course = RUDDER_COURSES[effect.rudder_course]
        felt = course(time, rudder, np.array([p.steps[-1] for p in effect.parameters]))
        assert np.max(np.abs(felt - rudder)) > 1e-3


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
    assert [p.name for p in effect.parameters if p.shapes] == (["k", "chi"] if effect.name == "waves" else [])
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
    shown = json.loads(json.dumps(effect.as_json(), allow_nan=False))
    assert shown["sha256"] == effect.sha256 == get(effect.name).sha256
    assert changed(effect, plain="Other words.").sha256 == effect.sha256
    first = effect.parameters[0]
    wider = changed(effect, parameters=(first.model_copy(update={"high": 2.0 * first.high}), *effect.parameters[1:]))
    assert wider.sha256 != effect.sha256


def test_a_channel_that_measures_an_effect_already_is_one_that_runs_list() -> None:
    measured = {name: effect.measured_by for name, effect in ALL.items() if effect.measured_by}
    assert measured == {"speed_loss": ("speed_through_water",)}
    with pytest.raises(ValueError, match="'yaw_rate'"):
        changed(ALL["yaw_cubic"], measured_by=("yaw_rate",))
    assert changed(ALL["speed_loss"], measured_by=()).sha256 != ALL["speed_loss"].sha256


def test_digests_differ() -> None:
    assert len({effect.sha256 for effect in ALL.values()}) == len(ALL)


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


@pytest.mark.parametrize("heading", [0.3, 1.7, 3.6])
def test_waves_have_the_spread_and_the_frequency_that_are_asked_for(heading: float) -> None:
    effect, L, V, g = ALL["waves"], 80.0, 7.0, 9.81
    values = {"c": 0.02, "k": 1.3, "chi": 0.5}
    w0 = 1.3 * np.sqrt(g / L)
    # met from ahead more often, from astern less
    w = w0 + w0**2 * V * np.cos(0.5 - heading) / g
    first, second = effect.states
    sea = {"L": L, "V": V, "K": heading}
    A = np.array(
        [
            [at(state.derivative, values, **{"m1": 0.0, "m2": 0.0, name: 1.0}, **sea) for name in ("m1", "m2")]
            for state in (first, second)
        ]
    )
    q = at(second.noise, values, L=L)
    # what is seen is the states by the root of encounter by wave frequency: the noise goes with the waves alone
    seen = at(effect.terms["heading"], values, m1=1.0, **sea)
    assert seen == pytest.approx(np.sqrt(abs(w) / w0))
    stationary = (0.02 / seen) ** 2 * np.eye(2)
    assert A @ stationary + stationary @ A.T + np.diag([0.0, q**2]) == pytest.approx(np.zeros((2, 2)), abs=1e-15)
    assert at(first.initial_std, values, L=L) == at(second.initial_std, values, L=L) == 0.02
    assert np.abs(np.linalg.eigvals(A)) == pytest.approx([abs(w), abs(w)])
    # the rate that is measured is that of the yaw
    rate = seen * at(first.derivative, values, m2=0.3, **sea)
    assert at(effect.terms["yaw_rate"], values, m2=0.3, **sea) == pytest.approx(rate)


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
    values = {"n": 1.8, "n0": 2.0, "delta": 0.2}
    assert at(wash, {"c": 1.0}, **values, **ship) == pytest.approx(6e-5 * 0.2 * ((7.0 * 0.9) ** 2 - 36.0))


def test_wind_from_starboard_pushes_to_port_and_turns_the_bow_away() -> None:
    effect = ALL["wind_force"]
    wind = {"U": 10.0, "L": 100.0}
    assert at(effect.terms["sway"], typical(effect), gamma=np.pi / 2, **wind) < 0.0
    assert at(effect.terms["yaw"], typical(effect), gamma=np.pi / 4, **wind) < 0.0
    assert at(effect.terms["yaw"], typical(effect), gamma=0.0, **wind) == 0.0


def test_a_turn_takes_speed_away() -> None:
    effect = ALL["speed_loss"]
    values = {"V": 7.0, "L": 100.0, "delta": 0.3, "v": -0.6, "r": 0.02}
    assert at(effect.states[0].derivative, typical(effect), **values) > 0.0
    assert at(effect.terms["speed"], typical(effect), m1=1.0) == -1.0


# ---------------------------------------------------------------- adding one


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A copy of the catalogue's folder, which the catalogue reads."""
    for name in effects.names():
        shutil.copy(FOLDER / f"{name}.yaml", tmp_path)
    monkeypatch.setattr(effects, "_FOLDER", tmp_path)
    effects._effect.cache_clear()
    yield tmp_path
    effects._effect.cache_clear()


GOOD = """
name: {name}
plain: p
reference: r
parameters: {{c: {{low: -1, high: 1, steps: [0.1]}}}}
terms: {{{target}: c*r}}
"""


def test_adding_one_is_adding_one_file(folder: Path) -> None:
    (folder / "quite_new.yaml").write_text(GOOD.format(name="quite_new", target="yaw"), encoding="utf-8")
    assert set(catalogue()) == {*ALL, "quite_new"}


@each
def test_its_file_is_one_that_a_user_could_have_written(effect: Effect) -> None:
    text = (FOLDER / f"{effect.name}.yaml").read_text(encoding="utf-8")
    assert from_file(text, "own.yaml") == effect


def shown_files() -> list[str]:
    return re.findall(r"```yaml\n(.*?)```", DOCUMENT.read_text(encoding="utf-8"), flags=re.DOTALL)


def test_the_effect_files_of_the_document_work() -> None:
    own, example, added = shown_files()
    assert from_file(own, "own.yaml").needs == ("wind_speed", "wind_angle")
    assert from_file(own, "own.yaml").name not in ALL
    path, _, text = example.partition("\n")
    assert text == (FOLDER.parents[1] / path.removeprefix("# ")).read_text(encoding="utf-8")
    assert from_file(example, "own.yaml") == ALL["speed_loss"]
    assert from_file(added, "own.yaml").group == "hull"


def test_the_worked_example_of_the_document_joins_the_catalogue(folder: Path) -> None:
    text = shown_files()[-1]
    name = text.partition("\n")[0].removeprefix("# schemas/effects/")
    (folder / name).write_text(text, encoding="utf-8")
    assert set(catalogue()) - set(ALL) == {name.removesuffix(".yaml")}


def test_every_rudder_course_has_its_code() -> None:
    assert set(RUDDER_COURSES) == set(get_args(RudderCourse)) == {e.rudder_course for e in ALL.values()} - {None}


def test_the_catalogue_is_read_without_anything_heavy() -> None:
    code = (
        "import sys; from kempf.schemas.effects import catalogue; print(len(catalogue()))\n"
        "print([m for m in ('numba', 'numpy', 'polars', 'scipy') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == [str(len(ALL)), "[]"]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("x = (", "expected keys"),
        ("x: 1", "name: the key is missing; plain: the key is missing"),
        ("name: [", "not valid YAML"),
        (GOOD.format(name="other", target="yaw"), "bears the name of its effect"),
        (GOOD.format(name="zz_wrong", target="roll"), "'roll'"),
    ],
)
def test_a_wrong_file_in_the_folder_is_one_clear_error(folder: Path, content: str, message: str) -> None:
    (folder / "zz_wrong.yaml").write_text(content, encoding="utf-8")
    with pytest.raises(KempfError, match=re.escape(message)) as caught:
        catalogue()
    assert caught.value.code == "catalogue_invalid"
    assert "zz_wrong.yaml" in caught.value.message


def test_an_unknown_effect_is_not_found() -> None:
    with pytest.raises(NotFound, match="did you mean 'yaw_quadratic'"):
        get("yaw_quadratics")
