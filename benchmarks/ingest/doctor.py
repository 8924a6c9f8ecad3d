"""How often the channel doctor finds a fault, and how often it raises a false alarm.

The thresholds are those of the instruments' and ships' physics; what was tuned at all was tuned on seeds below 1000.
Here are the real traps, simulated logs of seeds from 1000 on, and the trial logs of seven ships.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter

import numpy as np

from benchmarks import result_page
from benchmarks.baselines.doctor_rule_of_thumb import suspected
from benchmarks.ingest.doctor_faults import FAULTS, NEEDS, Stated, with_body_velocities, with_velocities
from benchmarks.ingest.doctor_logs import fleet, simulated
from benchmarks.ingest.doctor_traps import examined, traps
from kempf.pipeline.channels.doctor.corrections import put_into
from kempf.pipeline.channels.doctor.examine import Examination, examine
from kempf.pipeline.channels.doctor.log import Log
from kempf.schemas.profile import ChannelMap

_FIRST_SEED, _LOGS_A_FAULT = 1000, 10
#: Sizes of the figure: heading turned, deg; yaw rate late, s.
_TURNS_DEG, _DELAYS_S = (4.0, 8.0, 12.0, 16.0, 24.0, 32.0), (0.5, 1.0, 2.0, 3.0, 4.0, 6.0)


@dataclass
class Score:
    """Counts over the logs that one fault was put into."""

    stated: int = 0
    found: int = 0
    alone: int = 0
    others: int = 0
    by_eye: int = 0
    missed: list[str] = field(default_factory=list)


def named(found: Examination, stated: Stated) -> tuple[bool, bool, bool]:
    """Whether the fault is named, whether named alone, whether a sound channel is accused for certain."""
    right = [
        [f for f in x.faults if f.kind == stated.kind and set(f.channels) <= set(stated.channels)]
        for x in found.findings
    ]
    alone = any(len(x.faults) == 1 and ok for x, ok in zip(found.findings, right, strict=True))
    wrong = any(len(x.faults) == 1 and not ok for x, ok in zip(found.findings, right, strict=True))
    return any(right), alone, wrong


def interval(k: int, n: int) -> str:
    """A share with its 95 % interval (Wilson, 1927, Journal of the American Statistical Association 22)."""
    z, p = 1.96, k / n
    middle = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z * np.sqrt(p * (1 - p) / n + z * z / (4 * n * n)) / (1 + z * z / n)
    return f"{k} of {n}, {100 * p:.1f} % ({100 * max(middle - half, 0):.1f} to {100 * min(middle + half, 1):.1f})"


def trap_rows(data: Path) -> list[list[str]]:
    rows = []
    for trap in traps(data):
        testable = found = silent = 0
        lines: set[str] = set()
        for path in trap.logs:
            one = examined(path, trap.profile)
            compared = {c for o in one.examination.outcomes if o.state != "untestable" for c in o.channels}
            if not set(trap.channels) <= compared:
                continue
            testable += 1
            faults = [f for x in one.content["findings"] for f in x["faults"] if x["certain"]]
            right = [f for f in faults if f["kind"] == trap.kind and set(f["channels"]) <= set(trap.channels)]
            found += bool(right)
            for fault in right:
                lines |= set(fault["profile"])
                source = put_into(trap.profile.source_for(path.name), _mends(fault), path.name)
                mended = trap.profile.model_copy(update={"sources": [source]})
                silent += not examined(path, mended).examination.findings
        shown = "; ".join(sorted(lines)[:2])
        rows.append([trap.name, str(len(trap.logs)), str(testable), str(found), str(silent), f"`{shown}`"])
    return rows


def _mends(fault: dict[str, object]) -> tuple[object, ...]:
    from kempf.pipeline.channels.doctor.corrections import ProfileCorrection

    entries = fault["entries"]
    assert isinstance(entries, dict)
    return tuple(ProfileCorrection(key, ChannelMap.model_validate(entry)) for key, entry in entries.items())


def with_faults(logs: Sequence[tuple[str, Log]]) -> tuple[dict[str, Score], float, float]:
    scores, doctor_s, eye_s = {}, 0.0, 0.0
    for place, (what, fault) in enumerate(FAULTS.items()):
        score = scores[what] = Score()
        fitting = [one for one in logs if NEEDS.get(what, "heading") in one[1].series]
        for k in range(_LOGS_A_FAULT):
            name, log = fitting[(place * 5 + k * 7) % len(fitting)]
            stated = fault(log, np.random.Generator(np.random.PCG64([place, k])))
            start = perf_counter()
            found = examine(stated.log)
            middle = perf_counter()
            eye = suspected(stated.log)
            doctor_s, eye_s = doctor_s + middle - start, eye_s + perf_counter() - middle
            right, alone, wrong = named(found, stated)
            score.stated += 1
            score.found += right
            score.alone += alone
            score.others += wrong
            score.by_eye += bool(eye & set(stated.channels))
            if not right:
                score.missed.append(f"{name} ({stated.size:.3g})")
        print(f"{what}: {score.found} of {score.stated}, alone {score.alone}", flush=True)
    return scores, doctor_s, eye_s


def clean_rows(logs: Sequence[tuple[str, Log]]) -> tuple[list[list[str]], list[str], float]:
    rows, stated, seconds = [], [], 0.0
    forms = {"speed and course": lambda log: log, "earth-fixed": with_velocities, "body-fixed": with_body_velocities}
    total = eye_total = 0
    for form, changed in forms.items():
        alarmed = eye = 0
        for name, log in logs:
            sound = changed(log)
            start = perf_counter()
            found = examine(sound)
            seconds += perf_counter() - start
            alarmed += bool(found.findings)
            eye += bool(suspected(sound))
            if found.findings:
                stated.append(f"{name}, {form}: {', '.join(o.check for x in found.findings for o in x.evidence)}")
        rows.append([form, interval(alarmed, len(logs)), interval(eye, len(logs))])
        total, eye_total = total + alarmed, eye_total + eye
    n = len(forms) * len(logs)
    rows.append(["all", interval(total, n), interval(eye_total, n)])
    return rows, stated, seconds / n


def by_size(logs: Sequence[tuple[str, Log]]) -> dict[str, tuple[tuple[float, ...], list[float]]]:
    """Share of the logs in which a heading turned so far, and a yaw rate late by so much, is named."""
    from kempf.pipeline.channels.doctor.faults import Fault

    def share(kind: str, channel: str, value: float) -> float:
        hits = 0
        for _, log in logs:
            faulty = Fault(kind, (channel,), value, "turned" if kind == "offset" else "late").corrected(log)  # type: ignore[arg-type]
            hits += named(examine(faulty), Stated(faulty, kind, (channel,)))[0]
        return hits / len(logs)

    return {
        "heading turned, deg": (_TURNS_DEG, [share("offset", "heading", float(np.deg2rad(a))) for a in _TURNS_DEG]),
        "yaw rate late, s": (_DELAYS_S, [share("latency", "yaw_rate", -d) for d in _DELAYS_S]),
    }


def draw(scores: dict[str, Score], sizes: dict[str, tuple[tuple[float, ...], list[float]]], path: Path) -> None:
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, (left, *right) = plt.subplots(1, 3, figsize=(13, 5.5), width_ratios=[2, 1, 1], layout="constrained")
    place = np.arange(len(scores))[::-1]
    found = np.array([100 * s.found / s.stated for s in scores.values()])
    alone = np.array([100 * s.alone / s.stated for s in scores.values()])
    eye = np.array([100 * s.by_eye / s.stated for s in scores.values()])
    left.barh(place + 0.2, found, 0.38, color="tab:blue", alpha=0.45, label="among those named")
    left.barh(place + 0.2, alone, 0.38, color="tab:blue", label="named alone")
    left.barh(place - 0.2, eye, 0.3, color="0.7", label="by correlations: the pair looks wrong")
    left.set_yticks(place, list(scores), fontsize=8)
    left.set_xlabel("found, %")
    left.legend(fontsize=7, loc="upper center", bbox_to_anchor=(0.4, -0.09), ncols=3)
    for panel, (what, (size, share)) in zip(right, sizes.items(), strict=True):
        panel.plot(size, 100 * np.array(share), "o-")
        panel.set_xlabel(what)
        panel.set_ylim(-3, 103)
        panel.grid(lw=0.3)
    figure.savefig(path, dpi=110, metadata={"Software": None})


def page(data: Path, many: int) -> list[str]:
    logs = [simulated(seed) for seed in range(_FIRST_SEED, _FIRST_SEED + many)] + list(fleet(data))
    traps_found = trap_rows(data)
    clean, alarms, clean_s = clean_rows(logs)
    scores, doctor_s, eye_s = with_faults(logs)
    draw(scores, by_size(logs[:10]), result_page.RESULTS / "doctor.png")
    stated, found = sum(s.stated for s in scores.values()), sum(s.found for s in scores.values())
    rows = [
        [what, f"{s.found} of {s.stated}", str(s.alone), str(s.others), str(s.by_eye), ", ".join(s.missed) or "none"]
        for what, s in scores.items()
    ]
    ships = len({name.partition(",")[0] for name, _ in logs[many:]})
    alone, eye = sum(s.alone for s in scores.values()), sum(s.by_eye for s in scores.values())
    others = sum(s.others for s in scores.values())
    rows.append(["all", interval(found, stated), interval(alone, stated), str(others), interval(eye, stated), ""])
    return [
        "## Real traps",
        "",
        "Measured logs read with the profile less the line that mends them. Testable: the checks could compare the "
        "channel (a zigzag within a degree shows no frame). Silent: with the proposed line in the profile nothing "
        "disagrees.",
        "",
        *result_page.table(["trap", "logs", "testable", "named alone", "then silent", "line"], traps_found),
        "",
        f"## Faults put into sound logs: {many} simulated ones and {len(logs) - many} of {ships} ships",
        "",
        "Found: the right fault of the right channel is named, alone or as one of these. Accused: another channel is "
        "named alone. By correlations: medians and correlations of pairs, and the right channel is in a pair that "
        "looks wrong.",
        "",
        *result_page.table(
            ["fault", "found", "named alone", "accused", "by correlations", "not found in (size)"], rows
        ),
        "",
        "## False alarms on sound logs",
        "",
        *result_page.table(["velocities as", "doctor", "correlations of pairs"], clean),
        "",
        f"False alarms: {'; '.join(alarms) or 'none'}.",
        "",
        "## Cost",
        "",
        f"A sound log takes {clean_s:.2f} s, one with a fault {doctor_s / stated / clean_s:.1f} times as long; the "
        f"correlations take {eye_s / stated / clean_s:.2f} times as long as a sound log's examination.",
        "",
        "![Found by fault, and by the size of two of them](doctor.png)",
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=result_page.DATA)
    parser.add_argument("--logs", type=int, default=40, help="simulated logs")
    options = parser.parse_args()
    result_page.RESULTS.mkdir(exist_ok=True)
    path = result_page.write("ingest.doctor", "The channel doctor", page(options.data, options.logs))
    print(path.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
