"""``kempf report``: one file that asks for nothing outside itself, agrees with its verdict, and repeats to the byte."""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from html.parser import HTMLParser
from math import nan
from pathlib import Path
from shutil import copytree
from typing import Any, get_args
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from benchmarks.diagnose.late_rudder import LAG_S
from kempf.flows.jobs.diagnose import diagnose_vessel
from kempf.flows.jobs.identify.chosen_manoeuvres import choose
from kempf.flows.jobs.identify.standing_model import Own
from kempf.pipeline.diagnose.verdicts.effect_finding import NOT_EXPLAINED
from kempf.pipeline.diagnose.verdicts.verdict import Verdict
from kempf.schemas.diagnosis_evidence import ConfusionMap, DiagnosisEvidence
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import diagnoses
from kempf.workbench.figures import diagnosis_confusion, diagnosis_effects, diagnosis_ladder, diagnosis_zigzag
from kempf.workbench.figures.diagnosis_style import bytes_of
from kempf.workbench.report import sections
from kempf.workbench.report.build import MadeReport, content_of, make_report
from kempf.workbench.report.content import ReportContent
from kempf.workbench.report.page import page
from kempf.workbench.report.wording import CLAIMING, wording_of
from tests.late import VESSEL, some_effects
from tests.workbench.driving import kempf, refused

#: what only a report that claims an effect may say
CLAIMS = re.compile(r"\black(s|ing)?\b|\bmissing\b|\beffects add\b|\bpresent\b|\bis adequate\b|\bincluding\b", re.I)
#: words that a naval architect or a system identifier would not use (the glossary has the others)
ODD = re.compile(r"\b(told|tells|blame|mend|witness|stands? in for|stories|earns?|swallows?|string)\b|\+-", re.I)


class _Seen(HTMLParser):
    """Every attribute that names an address, every tag, every figure's words, and the text."""

    def __init__(self) -> None:
        super().__init__()
        self.addresses: list[tuple[str, str]] = []
        self.tags: list[str] = []
        self.open: list[tuple[str, str]] = []
        self.ids: list[str] = []
        self.alts: list[str] = []
        self.text: list[str] = []
        self.scripts: list[str] = []
        self.bare: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        seen = {name: value or "" for name, value in attrs}
        if tag in ("table", "img") and self.open[-1] != ("div", "scroll"):
            self.bare.append(tag)
        if tag not in ("meta", "img", "br", "link", "input"):
            self.open.append((tag, seen.get("class", "")))
        self.addresses += [(n, v) for n, v in seen.items() if n in ("src", "href", "srcset", "data", "action")]
        assert not [name for name in seen if name.startswith("on")], "no script hides in an attribute"
        if "id" in seen:
            self.ids.append(seen["id"])
        if tag == "img":
            self.alts.append(seen["alt"])
            self.text.append(seen["alt"])

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop()[0] == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1][0] == "script":
            self.scripts.append(data)
        elif self.open and self.open[-1][0] not in ("style", "pre"):
            self.text.append(data)


def seen(html: str) -> _Seen:
    parser = _Seen()
    parser.feed(html)
    parser.close()
    assert parser.open == []
    return parser


@pytest.fixture(scope="module")
def place(late_diagnosed: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A warehouse with three zigzags of a ship whose rudder answers late, diagnosed."""
    with some_effects():
        yield copytree(late_diagnosed, tmp_path_factory.mktemp("late") / "diagnosed") / "w"


@pytest.fixture(scope="module")
def report(place: Path) -> MadeReport:
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(diagnose_vessel, "examine", None)  # what is stored is not computed again
        return make_report(Warehouse(str(place)), VESSEL, ModelSpec(), Own())


@pytest.fixture(scope="module")
def stored(place: Path, report: MadeReport) -> Mapping[str, Any]:
    found = diagnoses.find(Warehouse(str(place)), report.diagnosis_id)
    assert found is not None
    return found.content


@pytest.fixture(scope="module")
def single(_filled: Path, tmp_path_factory: pytest.TempPathFactory) -> MadeReport:
    """The report of a ship with a single manoeuvre."""
    warehouse = copytree(_filled, tmp_path_factory.mktemp("single") / "warehouse")
    return make_report(Warehouse(str(warehouse)), "mariner", ModelSpec(), Own())


def as_verdict(verdict: str, stored: Mapping[str, Any], evidence: DiagnosisEvidence) -> tuple[Any, DiagnosisEvidence]:
    """What would be stored if the late rudder's diagnosis had come to another verdict."""
    content = {**stored, "verdict": verdict}
    if verdict in ("explained", "partly_explained"):
        return content, evidence
    if verdict == "ambiguous":
        (one,) = stored["sets"]
        return {
            **content,
            "sets": [{**one, "effects": ["rudder_lag", "gyro_bias"], "separated_by": "a turn"}],
        }, evidence
    content |= {"sets": [], "candidates": [{**one, "set_id": None} for one in stored["candidates"]]}
    if verdict == "unexplained":
        candidates = [
            {**one, "verdict": "suspected", "why": f"{NOT_EXPLAINED}: {one['title']}"} for one in content["candidates"]
        ]
        return {
            **content,
            "candidates": candidates,
            "sentences": [f"First-order rudder lag {NOT_EXPLAINED}."],
        }, evidence
    if verdict == "insufficient_data":
        few = ["One manoeuvre alone cannot distinguish an effect from chance."]
        return {**content, "sentences": few, "too_few_manoeuvres": True}, evidence
    candidates = [{**one, "verdict": "absent", "why": "no sign of it"} for one in content["candidates"]]
    manoeuvres = tuple(one.model_copy(update={"after": None}) for one in evidence.manoeuvres)
    plain = {"models": evidence.models[:1], "manoeuvres": manoeuvres, "unmodelled_after": None}
    sentence = "No effect of the catalogue improves the prediction of manoeuvres that were not fitted."
    return {**content, "candidates": candidates, "sentences": [sentence]}, evidence.model_copy(update=plain)


@pytest.mark.parametrize("verdict", get_args(Verdict))
def test_every_word_agrees_with_the_verdict(
    verdict: str, report: MadeReport, stored: Mapping[str, Any], place: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(sections, "bytes_of", lambda _: b"<svg/>")
    content, evidence = as_verdict(verdict, stored, report.content.evidence)
    warehouse = Warehouse(str(place))
    wording = wording_of("late", content, evidence)
    chosen = choose(warehouse, VESSEL)
    shown = content_of("late", content, evidence, chosen, wording, warnings=(), ship={}, provenance=())
    html = page(shown)
    text = " ".join(seen(html).text)
    headlines = {
        "adequate": "The plain model is adequate",
        "explained": "The plain model lacks first-order rudder lag, which explains 26 % of the misfit one leg ahead; ",
        "ambiguous": "The plain model lacks first-order rudder lag or bias of the rate gyro; these data cannot",
        "partly_explained": "The plain model lacks first-order rudder lag, which explains",
        "unexplained": "Not explained: a systematic misfit of the plain model remains",
        "insufficient_data": "Not decided: too few manoeuvres",
    }
    assert wording.headline.startswith(headlines[verdict]) and wording.headline in text
    said = {word.group(0).lower() for word in CLAIMS.finditer(text)}
    if verdict in CLAIMING:
        assert {"lacks", "missing", "effects add", "present"} <= said and "is adequate" not in said
    else:
        assert said == ({"is adequate"} if verdict == "adequate" else set())
        assert "not-confirmed" not in html and "[S1]" not in text
    assert not ODD.findall(text)
    assert ("sail at least three zigzags" in text.lower()) is (verdict == "insufficient_data")
    assert ("try a term of your own" in text) is (verdict in ("unexplained", "partly_explained"))
    assert ("To distinguish first-order rudder lag and bias of the rate gyro: a turn." in text) is (
        verdict == "ambiguous"
    )
    assert ("model with effects tried" in text) is (verdict in ("unexplained", "insufficient_data"))
    for name, words in wording.sections.items():
        assert f'<a href="#{name}">' in html and words.title in text


def test_readings_too_far_apart_have_advice_of_their_own(report: MadeReport, stored: Mapping[str, Any]) -> None:
    content, evidence = as_verdict("insufficient_data", stored, report.content.evidence)
    apart = {
        "channel": "rudder",
        "period_s": 1.0,
        "length_s": 1.7,
        "needed": "Log rudder and heading at 6 Hz or faster.",
    }
    alone = wording_of("late", {**content, "unresolved": apart, "too_few_manoeuvres": False}, evidence)
    assert alone.headline == "Not decided: the rudder is read too seldom for so quick a ship."
    assert alone.next_steps[0] == apart["needed"] and not any("three zigzags" in step for step in alone.next_steps)
    both = wording_of("late", {**content, "unresolved": apart, "too_few_manoeuvres": True}, evidence)
    assert "too few manoeuvres to distinguish an effect from chance and the rudder is read" in both.headline
    assert "three zigzags" in both.next_steps[1]
    claimed, evidence = as_verdict("partly_explained", stored, report.content.evidence)
    rest = wording_of("late", {**claimed, "unresolved": apart}, evidence)
    assert rest.headline.endswith("; what else is missing cannot be tested, as the rudder is read too seldom.")
    assert not any("term of your own" in step for step in rest.next_steps)


def test_what_the_model_has_already_is_not_advised(report: MadeReport, stored: Mapping[str, Any]):
    evidence = report.content.evidence
    before, after = wording_of("late", stored, evidence), wording_of("late", stored, evidence, ("rudder_lag",))
    assert any("effects add rudder_lag" in step for step in before.next_steps)
    assert not any("effects add" in step for step in after.next_steps)
    assert "Nothing to include: the current model has first-order rudder lag already." in after.next_steps


def test_advice_follows_what_the_vessel_has(place: Path, late_added: Path, tmp_path: Path):
    assert "effects add" in _advice(place)
    assert "effects add" not in _advice(copytree(late_added, tmp_path / "added") / "w")


def test_a_model_with_effects_is_shown_beside_the_plain_one(report: MadeReport, late_added: Path, tmp_path: Path):
    there = Warehouse(str(copytree(late_added, tmp_path / "added") / "w"))
    with_lag = ModelSpec().model_copy(update={"effects": ("rudder_lag",)})
    made = make_report(there, VESSEL, with_lag, Own())
    evidence, wording = made.content.evidence, made.content.wording
    assert [model.added for model in evidence.models] == ["", "first-order rudder lag"]
    assert (evidence.given, evidence.improved, evidence.found) == (1, True, False)
    assert wording.headline.startswith("The model with first-order rudder lag is adequate")
    assert (wording.first_model, wording.last_model) == ("plain model", "model with first-order rudder lag")
    assert wording.sections["ladder"].title == "What the effects of the model bring"
    assert "beside the model with first-order rudder lag without refitting" in made.html
    # the same manoeuvres, the same two models: what the ladder of the plain model's diagnosis says
    for ours, theirs in zip(evidence.models, report.content.evidence.models, strict=True):
        assert ours.fitted_error == pytest.approx(theirs.fitted_error, rel=0.02)
    assert all(manoeuvre.after is not None for manoeuvre in evidence.manoeuvres)


def _advice(warehouse: Path) -> str:
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(sections, "bytes_of", lambda _: b"<svg/>")
        return " ".join(make_report(Warehouse(str(warehouse)), VESSEL, ModelSpec(), Own()).content.wording.next_steps)


def test_a_diagnosis_without_curves_is_made_again_and_says_so(
    place: Path, report: MadeReport, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    warehouse = Warehouse(str(copytree(place, tmp_path / "w")))
    with delta.ensured(warehouse, "diagnosis_evidence") as table:
        row = delta.read(warehouse, "diagnosis_evidence").rows(named=True)[0]
        delta.replace(table, "diagnosis_evidence", [{**row, "evidence_json": "{}"}], "TRUE")
    lines: list[str] = []
    again = make_report(warehouse, VESSEL, ModelSpec(), Own(), say=lines.append)
    assert lines == [f"{report.diagnosis_id} was stored without the curves that a report shows; diagnosing late again"]
    assert again.html == report.html


def test_the_page_asks_for_nothing_outside_itself(report: MadeReport, single: MadeReport):
    for html in (report.html, single.html):
        parser = seen(html)
        assert len(parser.addresses) > 15
        for name, address in parser.addresses:
            assert (name, address[:1]) == ("href", "#") or address.startswith("data:image/svg+xml;base64,")
        anchors = [address[1:] for name, address in parser.addresses if name == "href"]
        assert set(anchors) <= set(parser.ids) and len(set(parser.ids)) == len(parser.ids)
        assert not {"link", "iframe", "object", "embed", "form"} & set(parser.tags)
        # one script, the one that the policy lets run; it asks for nothing outside itself either
        (script,) = parser.scripts
        digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
        assert f"script-src 'sha256-{digest}'" in html
        assert re.findall(r"\w+://\S+", script) == ["https://github.com/leeoniya/uPlot"]  # its licence's line
        sheet = html.partition("</style>")[0]
        assert "@import" not in sheet and "url(" not in sheet and "default-src 'none'" in html


def test_nothing_is_wider_than_the_page(report: MadeReport, single: MadeReport):
    for html in (report.html, single.html):
        parser = seen(html)
        assert parser.bare == [], "tables and figures scroll in a box of their own"
        assert parser.tags.count("caption") == parser.tags.count("table") and parser.tags.count("figcaption") > 5
        sheet = html.partition("<style>")[2].partition("</style>")[0]
        for rule in ("overflow-x: auto", "@media print", "prefers-color-scheme: dark", "columns:"):
            assert rule in sheet
        contents = html.partition('aria-label="Contents"')[2].partition("</nav>")[0]
        assert contents.count("<li>") == html.count("<section ") > 10


def test_figures_are_whole_and_have_words(report: MadeReport):
    parser = seen(report.html)
    assert all(len(alt) > 40 for alt in parser.alts)
    pictures = re.findall(r"data:image/svg\+xml;base64,([A-Za-z0-9+/=]+)", report.html)
    assert len(pictures) == len(parser.alts) >= 15
    for picture in pictures:
        text = base64.b64decode(picture).decode()
        assert "prefers-color-scheme:dark" in text and "var(--c0)" in text
        seen_ink = text.replace("stroke: #000000; stroke-opacity: 0", "")
        assert "#000000" not in seen_ink, "what is black is not seen on a dark page"
        svg = ET.fromstring(text)  # noqa: S314 - our own
        assert svg.tag.endswith("svg")
        for node in svg.iter():
            for name, value in node.attrib.items():
                if name.endswith("href"):
                    assert value.startswith(("#", "data:image/png;base64,"))
            assert not node.tag.endswith("script") and "date" not in node.tag


def test_reads_in_the_order_of_a_naval_architect(report: MadeReport):
    html = report.html
    order = ["headline", "What to do next", "Contents", 'id="effects"', 'id="parameters"', 'id="ladder"',
             'id="prediction"', 'id="innovations"', 'id="where"', 'id="correlations"', 'id="added"', 'id="confusion"',
             'id="force"', 'id="coverage"', 'id="zigzags"', 'id="provenance"']  # fmt: skip
    places = [html.index(text) for text in order]
    assert places == sorted(places)
    prediction = html.partition('id="prediction"')[2].partition("</section>")[0]
    assert prediction.index('class="badge held"') < prediction.index('class="badge fitted"')
    for words in ("one step", "10 s ahead", "60 s ahead", "free run"):
        assert f"<td>{words}</td>" in prediction
    assert prediction.count("with the rudder: ") == len(report.content.manoeuvres) == 3
    assert "One manoeuvre is held out" in html


def test_numbers_of_the_page_are_those_that_are_stored(report: MadeReport, stored: Mapping[str, Any]):
    html, evidence = report.html, report.content.evidence
    first, last = stored["ladder"]
    assert f'<td class="n">{100 * first["in_sample_error"]:.2f}</td>' in html
    assert f'<td class="n">{100 * last["held_out_error"]:.2f}</td>' in html
    assert (evidence.models[0].held_out_error, evidence.models[1].fitted_error) == (
        *(first["held_out_error"], last["in_sample_error"]),
    )
    # predictions with the lag take the likelihood's parameters
    assert not last["one_leg_ahead"]["better_than_one_step"]
    assert not evidence.by_legs and html.count("fitted to legs") == 1
    # the sentence on the plain model
    assert "Predictions with the first model take parameters fitted to legs" in html
    parameters = {one.name: one for one in evidence.models[-1].parameters}
    assert {name: one.value for name, one in parameters.items() if "." not in name} == last["hull"]
    tau = parameters["rudder_lag.tau"]
    assert abs(tau.value - LAG_S) < 3.0 * tau.std
    assert tau.std == last["effects"]["rudder_lag.tau"]["std"], "widened as everywhere"
    assert f"{tau.value:.3f} ± {tau.std:.3f} s" in html and "plain model, ± 1 s.e." in html
    assert dict(report.content.provenance)["diagnosis"] == report.diagnosis_id and report.diagnosis_id in html
    for one in evidence.manoeuvres:
        assert one.after is not None
        assert min(one.after.fit_percent["free run"].values()) > 80.0
        assert one.after.overshoots and all(abs(p.predicted_deg - p.measured_deg) < 2.0 for p in one.after.overshoots)
        # the measured heading passes through the overshoots
        for peak in one.peaks:
            nominal = next(shown.psi0_deg for shown in report.content.manoeuvres if shown.evidence is one)
            there = np.degrees(np.interp(peak.at_s, one.time_s, one.heading_deviation))
            assert there == pytest.approx(peak.side * (nominal + peak.beyond_deg), abs=0.5)
        # motions given all measurements are close to what was measured
        good = np.isfinite(one.measured[:, 1])
        error = one.turn[good] - one.measured[good, 1]
        assert np.sqrt(np.mean(error**2)) < 0.1 * np.std(one.measured[good, 1])


def test_single_manoeuvre_is_insufficient(single: MadeReport):
    content = single.content
    assert content.wording.verdict == "insufficient_data" and not content.evidence.improved
    assert "too few manoeuvres" in single.html and "at least three zigzags" in single.html
    assert content.wording.last_model == content.wording.first_model == "plain model"
    assert content.evidence.misfit.held_out == {} and "none held out" in single.html


def test_what_is_shown_is_text_and_never_markup(report: MadeReport, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(sections, "bytes_of", lambda _: b"<svg/>")
    content = report.content
    wording = replace(content.wording, title='<img src="http://x/">', headline="a & b <b>")
    rows = (replace(content.effects[0], title="<script>alert(1)</script>"), *content.effects[1:])
    html = page(replace(content, wording=wording, effects=rows))
    assert "<b>" not in html and "&lt;script&gt;alert(1)" in html and "a &amp; b" in html
    assert "http://x" not in [address for _, address in seen(html).addresses]


def test_bytes_repeat(report: MadeReport, place: Path, tmp_path: Path):
    path = tmp_path / "ship.html"
    done = kempf("report", "--vessel", VESSEL, "--output", path, "--warehouse", place, "--json")
    assert done.code == 0, done
    assert path.read_text(encoding="utf-8") == report.html
    assert done.json["diagnosis_id"] == report.diagnosis_id and done.json["out"] == str(path)
    assert done.json["verdict"] == "explained" and done.json["headline"] == report.content.wording.headline
    asked = ("report", "--vessel", VESSEL, "--warehouse", place, "--json")
    refused(kempf(*asked, "--output", path), 2, "cannot_write")
    refused(kempf(*asked, "--output", tmp_path / "nowhere" / "x.html"), 2, "cannot_write")
    nobody = ("report", "--vessel", "nobody", "--output", tmp_path / "n.html", "--warehouse", place, "--json")
    refused(kempf(*nobody), 4, "no_vessel")
    assert not (tmp_path / "n.html").exists()


def test_limits_are_at_their_overshoots():
    criteria = {
        "10/10 second overshoot": {"limit_deg": 30.0},
        "10/10 first overshoot": {"limit_deg": 15.0},
        "overshoot": {"limit_deg": None},
    }
    assert diagnosis_zigzag.limits(criteria) == {0: 15.0, 1: 30.0}


def test_figures_allow_for_what_is_missing(report: MadeReport):
    """No score, one effect, no held-out manoeuvre: a figure all the same."""
    content: ReportContent = report.content
    untested = replace(content.effects[0], score=nan, set_id="")
    model = content.evidence.models[0]
    alone = model.model_copy(update={"held_out_errors": np.zeros(0), "held_out_error": nan})
    diverging = model.model_copy(update={"held_out_errors": np.array([np.nan]), "held_out_error": nan})
    one = ConfusionMap(titles=("one",), squared_cosine=np.ones((1, 1)), threshold=0.9)
    for draw in (
        lambda: diagnosis_effects.draw_effects([untested, content.effects[0]]),
        lambda: diagnosis_ladder.draw_ladder([alone], "plain model"),
        lambda: diagnosis_ladder.draw_ladder([diverging], "plain model"),
        lambda: diagnosis_confusion.draw_confusion(one),
    ):
        assert bytes_of(draw()) == bytes_of(draw())
        assert bytes_of(draw(), "png")[:4] == b"\x89PNG"
