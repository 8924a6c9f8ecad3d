"""``kempf report``: one file that asks for nothing outside itself, says what was found, and is the same every time."""

from __future__ import annotations

import base64
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from shutil import copytree
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from kempf.flows.jobs.standing_model import Own
from kempf.warehouse.store import Warehouse
from kempf.workbench.chosen_model import PLAIN
from kempf.workbench.figures import (
    diagnosis_added_variable,
    diagnosis_confusion,
    diagnosis_effects,
    diagnosis_ladder,
    diagnosis_missing_force,
    diagnosis_zigzag,
)
from kempf.workbench.figures.diagnosis_style import bytes_of
from kempf.workbench.report import smoothed
from kempf.workbench.report.build import Report, made
from kempf.workbench.report.content import (
    AddedVariable,
    Course,
    MissingForce,
    RankedEffect,
    ReportContent,
    Rung,
)
from kempf.workbench.report.markup import table
from kempf.workbench.report.page import page
from tests.workbench.driving import kempf, refused


class _Seen(HTMLParser):
    """Every attribute that names an address, every tag, every figure's words."""

    def __init__(self) -> None:
        super().__init__()
        self.addresses: list[tuple[str, str]] = []
        self.tags: list[str] = []
        self.open: list[str] = []
        self.ids: list[str] = []
        self.alts: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        if tag not in ("meta", "img", "br", "link"):
            self.open.append(tag)
        told = {name: value or "" for name, value in attrs}
        self.addresses += [
            (n, v) for n, v in told.items() if n in ("src", "href", "srcset", "data", "action", "poster")
        ]
        assert not [name for name in told if name.startswith("on")], "no script hides in an attribute"
        if "id" in told:
            self.ids.append(told["id"])
        if tag == "img":
            self.alts.append(told["alt"])

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def seen(html: str) -> _Seen:
    parser = _Seen()
    parser.feed(html)
    parser.close()
    assert parser.open == []
    return parser


@pytest.fixture(scope="module")
def _place(_filled: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return copytree(_filled, tmp_path_factory.mktemp("report") / "warehouse")


@pytest.fixture(scope="module")
def report(_place: Path) -> Report:
    """The report of a ship with a single manoeuvre."""
    return made(Warehouse(str(_place)), "mariner", PLAIN, Own())


@pytest.fixture(scope="module")
def improved(report: Report) -> ReportContent:
    """The same ship as if an effect had been added: everything that a report can show."""
    rng = np.random.default_rng(1)

    def better(course: Course) -> Course:
        free = {k: dict.fromkeys(v, 99.0) for k, v in course.fit_percent.items()}
        return replace(course, whitened=rng.standard_normal(course.whitened.shape), fit_percent=free)

    content = report.content
    runs = tuple(replace(run, full=better(run.plain)) for run in content.runs)
    runs += tuple(replace(run, held_out=True, segment_id=run.segment_id, label="Run 2: held") for run in runs)
    level = {"current, m/s per √s": 2e-3}
    ladder = (
        Rung("plain model", np.array([0.1]), np.array([0.2]), level, 10.0, 6),
        Rung("<script>alert(1)</script>", np.array([0.05]), np.array([0.3]), {"current, m/s per √s": 1e-3}, 90.0, 7),
    )
    present = RankedEffect(
        *("wind_force", "force & moment of the wind", "present", "step 1", "sail on two headings", "S1"),
        *(238.8, 2e-50, 0.53, (("c", 0.0115, 0.0010, "1"), ("tau", np.deg2rad(2.0), np.deg2rad(0.5), "rad")), "c = 1"),
    )
    force = MissingForce(*rng.standard_normal((2, 500)) * 1e-3, {"v, m/s": rng.standard_normal(500)})
    expected = 0.4 * rng.standard_normal(2000)
    return replace(
        content,
        vessel='<img src="http://x/">',
        headline="a & b <b>",
        ladder=ladder,
        runs=runs,
        ranked=(present, *content.ranked),
        names=("one", "two"),
        alike=np.array([[1.0, 0.95], [0.95, 1.0]]),
        added_variables=(AddedVariable("one", expected, expected + rng.standard_normal(2000), 320.0),),
        missing_before=force,
        missing_after=replace(force, sway=0.1 * force.sway),
        where_held=content.where_after,
    )


@pytest.fixture(scope="module")
def html(improved: ReportContent) -> str:
    return page(improved)


def test_the_page_asks_for_nothing_outside_itself(html: str, report: Report):
    for one in (html, report.html):
        parser = seen(one)
        assert len(parser.addresses) > 15
        for name, address in parser.addresses:
            assert (name, address[:1]) == ("href", "#") or address.startswith("data:image/svg+xml;base64,"), address[
                :60
            ]
        anchors = [address[1:] for name, address in parser.addresses if name == "href"]
        assert set(anchors) <= set(parser.ids) and len(set(parser.ids)) == len(parser.ids)
        assert not {"script", "link", "iframe", "object", "embed", "form"} & set(parser.tags)
        assert "@import" not in one and "url(" not in one.split("</style>")[0]
        assert "default-src 'none'" in one


def test_figures_are_whole_and_told_in_words(html: str):
    parser = seen(html)
    assert all(len(alt) > 40 for alt in parser.alts)
    pictures = re.findall(r"data:image/svg\+xml;base64,([A-Za-z0-9+/=]+)", html)
    assert len(pictures) == len(parser.alts) >= 12
    for picture in pictures:
        svg = ET.fromstring(base64.b64decode(picture))  # noqa: S314 - our own
        assert svg.tag.endswith("svg")
        for node in svg.iter():
            for name, value in node.attrib.items():
                if name.endswith("href"):
                    assert value.startswith(("#", "data:image/png;base64,"))
            assert not node.tag.endswith("script")
            assert "date" not in node.tag


def test_reads_in_the_order_of_a_naval_architect(html: str, improved: ReportContent):
    order = ["headline", "What to do next", 'id="effects"', 'id="ladder"', 'id="prediction"', 'id="innovations"',
             'id="where"', 'id="correlations"', 'id="added"', 'id="confusion"', 'id="force"', 'id="coverage"',
             'id="zigzags"', 'id="provenance"']  # fmt: skip
    places = [html.index(text) for text in order]
    assert places == sorted(places)
    # the horizon is named and the sample badged beside every prediction, held out first
    held, fitted = html.index('class="badge held">held out'), html.index('class="badge fitted">fitted')
    assert held < fitted
    assert len(re.findall(r"horizon: free run", html)) == len(improved.runs)
    assert len(re.findall(r"horizon: one step", html)) == len(improved.runs)
    for words in ("one step", "10 s ahead", "60 s ahead", "free run"):
        assert f"<td>{words}</td>" in html
    # what got worse is said
    assert "strays no less with the effects (30.00 %) than without (20.00 %)" in html
    assert "One manoeuvre is held out" in html


def test_what_is_told_is_text_and_never_markup(html: str):
    assert "<b>" not in html and "&lt;script&gt;alert(1)" in html and "force &amp; moment" in html
    assert "http://x" not in [address for _, address in seen(html).addresses]
    assert table(["a"], [["<span onclick=x>"]], "c").count("<span") == 0


def test_numbers_of_the_page_are_those_of_the_content(html: str):
    assert "c = 0.0115 ± 0.0020; tau = 2.00 ± 0.98 deg" in html
    assert '<td class="n">238.8</td>' in html and "below 0.0001" in html
    assert '<td class="n">10.00</td><td class="n">20.00</td><td class="n">10.0</td>' in html


def test_single_manoeuvre_is_told_as_insufficient(report: Report):
    content = report.content
    assert content.verdict == "insufficient_data" and not content.improved
    assert "too few manoeuvres" in report.html and "at least three zigzags" in report.html
    assert "model with effects" not in report.html
    assert content.runs[0].plain is content.runs[0].full and not content.where_held
    assert dict(content.provenance)["diagnosis"] == report.diagnosis_id and report.diagnosis_id in report.html
    overshoots = content.runs[0].plain.overshoots
    assert overshoots and all(one.error_deg is not None and abs(one.error_deg) < 2.0 for one in overshoots)
    assert min(content.runs[0].plain.fit_percent["free run"].values()) > 80.0


def test_bytes_repeat(report: Report, improved: ReportContent, html: str, _place: Path, tmp_path: Path):
    assert page(improved) == html
    path = tmp_path / "ship.html"
    told = kempf("report", "--vessel", "mariner", "--output", path, "--warehouse", _place, "--json")
    assert told.code == 0, told
    assert path.read_text(encoding="utf-8") == report.html
    assert told.json["diagnosis_id"] == report.diagnosis_id and told.json["out"] == str(path)
    refused(
        kempf("report", "--vessel", "mariner", "--output", path, "--warehouse", _place, "--json"), 2, "cannot_write"
    )
    refused(
        kempf("report", "--vessel", "nobody", "--output", tmp_path / "n.html", "--warehouse", _place, "--json"),
        *(4, "no_vessel"),
    )
    gone = tmp_path / "nowhere" / "x.html"
    refused(
        kempf("report", "--vessel", "mariner", "--output", gone, "--warehouse", _place, "--json"), 2, "cannot_write"
    )
    assert not (tmp_path / "n.html").exists()


def test_added_variable_means_and_slope():
    rng = np.random.default_rng(7)
    x = rng.standard_normal(5000)
    middle, mean, half = diagnosis_added_variable.binned(x, x + rng.standard_normal(5000))
    assert middle.size == 14 and np.all(np.diff(middle) > 0)
    assert np.all(np.abs(mean - middle) < 2.5 * half)
    told = diagnosis_added_variable.describe_added_variable([AddedVariable("e", x, 1.0 * x, 1.0)])
    assert "e, slope 1.00" in told


def test_missing_force_bins_are_medians_and_quartiles():
    x = np.repeat([0.0, 12.0], 100)
    y = np.concatenate([np.arange(100.0), np.full(100, 5.0)])
    middle, low, median, high = diagnosis_missing_force.spread(x, y)
    assert middle.tolist() == [0.5, 11.5] and median.tolist() == [49.5, 5.0]
    assert (low[0], high[0]) == (24.75, 74.25)


def test_limits_stand_at_their_overshoots(report: Report):
    run = replace(
        report.content.runs[0],
        imo={
            "10/10 second overshoot": {"limit_deg": 30.0},
            "10/10 first overshoot": {"limit_deg": 15.0},
            "overshoot": {"limit_deg": None},
        },
    )
    assert diagnosis_zigzag.limits(run) == {0: 15.0, 1: 30.0}
    deviation = diagnosis_zigzag._deviation(run, run.measured[:, 2])
    assert abs(np.nanmean(deviation[run.time_s < run.executes_s[0]])) < 1.0
    for at, side, beyond in run.peaks:
        there = float(np.interp(at, run.time_s, deviation))
        assert there == pytest.approx(side * (run.psi0_deg + beyond), abs=0.3)


def test_figures_stand_what_is_missing(improved: ReportContent):
    """No score, one effect, no held-out run: a figure all the same."""
    untested = replace(improved.ranked[0], score=np.nan, set_id=None)
    first = replace(improved.ladder[0], held_out=np.zeros(0))
    for draw in (
        lambda: diagnosis_effects.draw_effects([untested, improved.ranked[0]]),
        lambda: diagnosis_ladder.draw_ladder([first]),
        lambda: diagnosis_ladder.draw_ladder([replace(improved.ladder[1], held_out=np.array([np.inf]))]),
        lambda: diagnosis_confusion.draw_confusion(["one"], np.ones((1, 1))),
    ):
        assert bytes_of(draw()) == bytes_of(draw())
        assert bytes_of(draw(), "png")[:4] == b"\x89PNG"


def test_smoothed_departures_are_those_of_the_joint_gaussian(report: Report):
    """The transitions are exact exponentials: two half steps make one."""
    looked = report.content.runs[0].plain.looked
    A = np.array([[[-0.1, -2.0], [0.001, -0.05]]])
    W = np.array([[[1e-3, 1e-4], [1e-4, 2e-3]]])
    Phi, Q = smoothed._sampled(A, W, 2.0)
    half, q = smoothed._sampled(A, W, 1.0)
    assert Phi[0] == pytest.approx(half[0] @ half[0], rel=1e-12)
    assert Q[0] == pytest.approx(half[0] @ q[0] @ half[0].T + q[0], rel=1e-12)
    states = report.content.runs[0].plain.states
    rates = looked.filtered.run.measured[:, 1]
    good = np.isfinite(rates)
    assert np.sqrt(np.mean((states[good, 1] - rates[good]) ** 2)) < 0.1 * np.std(rates[good])
