"""Every command that takes a parameter set, with one whose rudder lags: the lag shows, or the command says why not."""

from __future__ import annotations

import json
import runpy
from collections.abc import Callable
from pathlib import Path
from shutil import copytree
from typing import Any

import click
import numpy as np
import pytest
from scipy.io import loadmat

from benchmarks.diagnose import late_rudder
from kempf.workbench.cli.entry import cli
from tests.workbench.driving import kempf, tree

VESSEL, NAME = late_rudder.VESSEL, "rudder_lag.tau"


class Late:
    """A warehouse with the plain model of a late ship and that with the lag, which is current."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.uri = folder, folder / "w"
        sets = {s["model_name"]: s["parameter_set_id"] for s in self.json("params", "list")}
        self.plain, self.lag = sets["plain"], sets["plain + rudder_lag"]

    def run(self, *arguments: object) -> Any:
        return kempf(*arguments, "--warehouse", self.uri)

    def json(self, *arguments: object) -> Any:
        ran = self.run(*arguments, "--json")
        assert ran.code == 0, ran
        return ran.json

    def text(self, *arguments: object) -> str:
        ran = self.run(*arguments)
        assert ran.code == 0, ran
        return str(ran.out)


@pytest.fixture(scope="module")
def late(late_added: Path, tmp_path_factory: pytest.TempPathFactory) -> Late:
    return Late(copytree(late_added, tmp_path_factory.mktemp("late") / "added"))


@pytest.fixture(scope="module")
def tau(late: Late) -> dict[str, Any]:
    return dict(late.json("params", "show", late.lag)["parameters"][NAME])


def shown(late: Late, tau: dict[str, Any]) -> None:
    assert abs(tau["value"] - late_rudder.LAG_S) < 3.0 * tau["std"] and tau["unit"] == "s"
    assert NAME in late.text("params", "show", late.lag)


def differs(late: Late, tau: dict[str, Any]) -> None:
    output = late.json("params", "diff", late.plain, late.lag)["parameters"][NAME]
    assert output == {"first": None, "second": tau["value"], "difference": None, "in_std": None, "unit": "s"}
    assert late.json("params", "diff", late.lag, late.plain)["parameters"][NAME]["first"] == tau["value"]
    row = next(line.split() for line in late.text("params", "diff", late.plain, late.lag).splitlines() if NAME in line)
    assert row[1] == "-" and row[-1] == "s"


def test_the_discrete_matrices_are_said_to_be_the_hulls(late: Late) -> None:
    assert "of the hull alone, without rudder_lag" in late.text("params", "show", late.lag)
    assert "of the hull alone" not in late.text("params", "show", late.plain)


def steering(late: Late, tau: dict[str, Any]) -> None:
    output = late.json("params", "steering", late.lag)
    assert output["effects"] == {NAME: tau}
    assert all(np.isfinite(c["std"]) for c in output["nomoto"]["constants"].values())
    assert NAME in late.text("params", "steering", late.lag)
    # the plain model puts the lag into the hull
    plain = late.json("params", "steering", late.plain)["nomoto"]["constants"]["T"]
    assert plain["value"] != pytest.approx(output["nomoto"]["constants"]["T"]["value"], rel=0.05)


def exported(late: Late, tau: dict[str, Any]) -> None:
    content = json.loads(late.text("params", "export", late.lag, "--format", "json"))
    assert content["parameters"][NAME] == tau and content["covariance"]["names"][6:] == [NAME]
    assert np.sqrt(content["covariance"]["values"][6][6]) == pytest.approx(tau["std"])


def as_text(form: str) -> Callable[[Late, dict[str, Any]], None]:
    def check(late: Late, tau: dict[str, Any]) -> None:
        text = late.text("export", form, late.lag)
        assert NAME in text and repr(tau["value"]) in text

    return check


def as_control(late: Late, tau: dict[str, Any]) -> None:
    pytest.importorskip("control", reason="python-control is not installed")
    path = late.folder / "ship.py"
    late.text("export", "control", late.lag, "--out", path)
    made = runpy.run_path(str(path))
    assert made["PARAMETERS"][NAME] == tau["value"] and made["COVARIANCE"].shape == (7, 7)
    smooth = made["continuous"]
    assert smooth.state_labels[-1] == "rudder_lag" and made["UNITS"]["rudder_lag"] == "rad"
    assert smooth.A[-1, -1] == pytest.approx(-1.0 / tau["value"])
    assert smooth.B[:-1] == pytest.approx(0.0), "the rudder reaches the hull through its lag alone"


def as_mat(late: Late, tau: dict[str, Any]) -> None:
    path = late.folder / "ship.mat"
    late.text("export", "mat", late.lag, "--out", path)
    held = loadmat(path)
    assert str(held["state_names"][-1, 0][0]) == "rudder_lag"
    assert held["parameter_covariance"].shape == (7, 7) and held["parameter_values"][6, 0] == tau["value"]


def as_mcap(late: Late, tau: dict[str, Any]) -> None:
    path = late.folder / "runs.mcap"
    late.text("export", "mcap", "--vessel", VESSEL, "--set", late.lag, "--output", path)
    assert late.lag.encode() in path.read_bytes()


def steered(late: Late, tau: dict[str, Any]) -> None:
    asked = ("steer", "--vessel", VESSEL, "--set", late.lag, "--minutes", "8")
    output = late.json(*asked, "--wrong", late.plain)
    knows, ignores = output["laws"]
    assert output["effects"] == {NAME: tau}
    assert (
        knows["law"]["states"] == ["v", "r", "psi", "F", "V_T", "rudder_lag"] and "rudder_lag" in knows["law"]["gain"]
    )
    assert "rudder_lag" not in ignores["law"]["gain"]
    # two ships' states and estimates: the ship that is steered lags whatever the law thinks of her
    assert [len(one["closed_loop"]["poles"]) for one in (knows, ignores)] == [4 + 6, 4 + 5]
    assert knows["performance"]["kept"] and f"effect: {NAME}" in late.text(*asked)


def compared(late: Late, tau: dict[str, Any]) -> None:
    lag, plain = (late.json("compare", "--vessel", VESSEL, "--set", one) for one in (late.lag, late.plain))
    errors = [one["judged"]["free_run_error_percent"] for one in (lag, plain)]
    assert errors[0] < 0.8 * errors[1]


def moved(late: Late, tau: dict[str, Any]) -> None:
    found = late.json("what-if", NAME, "--vessel", VESSEL, "--set", late.lag)
    assert (found["value"], found["std"], found["unit"]) == (tau["value"], tau["std"], "s")
    errors = [one["free_run_error_percent"] for one in found["tried"]]
    assert len(set(errors)) == len(errors), "each lag is another ship"
    refused = late.run("what-if", NAME, "--vessel", VESSEL, "--set", late.plain, "--json")
    assert refused.code == 4 and refused.json["error"]["code"] == "no_parameter"


def explained(late: Late, tau: dict[str, Any]) -> None:
    where = late.json("compare", "--vessel", VESSEL, "--where", "--set", late.plain)["where"]
    worst = next(one for one in (where["held_out"] or where["fitted"])["worst"] if one["channel"] == "yaw_rate")
    stretch = ("explain", "--vessel", VESSEL, "--from", worst["start"], "--to", worst["end"])
    lag, plain = (late.json(*stretch, "--set", one) for one in (late.lag, late.plain))
    assert lag["beside"] == ["rudder_lag"] and plain["beside"] == []
    # what the model has is not looked for, and with it the stretch is as a right model leaves it
    assert "rudder_lag" not in {one["effect"] for one in lag["effects"]}
    assert lag["times_a_right_model"] < plain["times_a_right_model"]


def predicted(late: Late, tau: dict[str, Any]) -> None:
    lag, plain = (
        late.json("predict", "zigzag", "--vessel", VESSEL, "--set", one, "--angles", "15/15")
        for one in (late.lag, late.plain)
    )
    assert lag["models"][0]["effects"] == ["rudder_lag"] and plain["models"][0]["effects"] == []
    # she turns on while the rudder is still on its way
    assert lag["figures"]["overshoots_deg"][0]["value"] > plain["figures"]["overshoots_deg"][0]["value"]


def proposed(late: Late, tau: dict[str, Any]) -> None:
    found = late.json("next-trial", "--vessel", VESSEL, "--set", late.lag, "--parameter", NAME)
    assert [one["effects"] for one in found["models"]] == [["rudder_lag"]] and found["aim"] == "narrow"
    shares = [one["narrowed"][NAME] for one in found["trials"]]
    assert shares == sorted(shares) and 0.0 < shares[0] < shares[-1] < 1.0
    best = found["trials"][0]
    angles = "{heading_deg:g}/{rudder_deg:g}".format(**best["manoeuvre"])
    assert found["order"][0].startswith(f"Zigzag {angles}.") and found["sentences"][0].startswith(
        f"One zigzag {angles} more"
    )
    assert len(found["expected"]["overshoots_deg"]) == 4 and best["duration_s"] > 60.0
    words = late.text("next-trial", "--vessel", VESSEL, "--set", late.lag, "--parameter", NAME)
    assert all(" ".join(words.split()).find(line) >= 0 for line in found["order"])
    refused = late.run("next-trial", "--vessel", VESSEL, "--set", late.plain, "--parameter", NAME, "--json")
    assert refused.code == 2 and refused.json["error"]["code"] == "parameter_unknown"


def built_again(late: Late, tau: dict[str, Any]) -> None:
    assert late.json("rerun", late.lag)["verdict"] == "bit-identical"


def named(late: Late, tau: dict[str, Any]) -> None:
    late.json("params", "alias", "with_lag", late.lag)
    assert late.json("params", "show", "with_lag")["parameters"][NAME] == tau
    commands = ["params show", "params diff", "params steering", "params export", "export yaml", "export csv", "rerun"]
    for command in commands:
        beside = [late.plain] if command == "params diff" else []
        by_id, by_name = (late.json(*command.split(), *beside, one) for one in (late.lag, "with_lag"))
        assert by_name == by_id, command


CHECKS: dict[tuple[str, ...], Callable[[Late, dict[str, Any]], None]] = {
    ("params", "show"): shown,
    ("params", "diff"): differs,
    ("params", "steering"): steering,
    ("params", "export"): exported,
    ("params", "alias"): named,
    ("export", "yaml"): as_text("yaml"),
    ("export", "csv"): as_text("csv"),
    ("export", "control"): as_control,
    ("export", "mat"): as_mat,
    ("export", "mcap"): as_mcap,
    ("steer",): steered,
    ("compare",): compared,
    ("explain",): explained,
    ("what-if",): moved,
    ("predict",): predicted,
    ("next-trial",): proposed,
    ("rerun",): built_again,
}
#: these begin from a set's model and screen what it lacks: tests/flows/test_diagnose.py goes through them
SCREENING = {("diagnose",), ("report",)}
#: what takes the id of a set and reads nothing of what is in it
NOTED = {("note",)}
_SET = {"set_id", "first", "second", "--set"}


def _taking_a_set(command: click.Command, path: tuple[str, ...] = ()) -> set[tuple[str, ...]]:
    if isinstance(command, click.Group):
        with click.Context(command) as context:
            inner = {name: command.get_command(context, name) for name in command.list_commands(context)}
        return set().union(*(_taking_a_set(one, (*path, name)) for name, one in inner.items() if one is not None))
    taken = {word for p in command.params for word in (str(p.name), *p.opts)}
    return {path} if _SET & taken else set()


def test_no_command_that_takes_a_set_is_forgotten() -> None:
    assert _taking_a_set(cli) == set(CHECKS) | SCREENING | NOTED


@pytest.mark.parametrize("path", [path for path in CHECKS if path != ("params", "alias")], ids=" ".join)
def test_the_lag_shows(path: tuple[str, ...], late: Late, tau: dict[str, Any]) -> None:
    before = tree(late.uri)
    CHECKS[path](late, tau)
    assert tree(late.uri) == before, "reading a set writes nothing"


def test_an_alias_stands_for_it(late: Late, tau: dict[str, Any]) -> None:
    CHECKS["params", "alias"](late, tau)
