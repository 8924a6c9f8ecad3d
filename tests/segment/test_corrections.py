"""What a person says of manoeuvres, laid over what the search finds."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from kempf.pipeline.channels.series import Series
from kempf.pipeline.segment.corrections import applied, same, standing
from kempf.pipeline.segment.zigzags.by_hand import zigzag_between
from kempf.pipeline.segment.zigzags.find_zigzags import find_zigzags
from kempf.pipeline.segment.zigzags.zigzag import Zigzag
from kempf.schemas.correction import Correction
from kempf.schemas.errors import DataRejected
from kempf.schemas.units import SECOND_NS
from tests.segment.nomoto import Instruments, Ship, measure


def sailed(switching_deg: tuple[float, ...] = (20.0,) * 6) -> tuple[Series, Series]:
    """A zigzag with 20 deg of rudder, reversed at these deviations from the course she began on."""
    ship, side = Ship(), 1
    ship.wait(0.0, 100.0)
    for deviation in switching_deg:
        ship.steer(side * 20.0, lambda side=side, d=deviation: side * ship.heading >= d)  # type: ignore[misc]
        side = -side
    ship.wait(0.0, 60.0)
    return measure(ship, Instruments())


def said(action: str, subject: tuple[int, int], bounds: tuple[int, int] | None = None) -> Correction:
    return Correction(action, subject, bounds, f"because of {action}")  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def log() -> tuple[Series, Series, Zigzag]:
    heading, rudder = sailed()
    (zigzag,) = find_zigzags(heading, rudder)
    return heading, rudder, zigzag


def test_bounds_are_of_one_manoeuvre_where_they_share_most_of_the_shorter() -> None:
    assert same((0, 100), (10, 110)) and same((0, 100), (40, 60)) and not same((0, 100), (50, 150))
    assert not same((0, 100), (200, 300))


def test_the_last_word_decides() -> None:
    found, other, new = (0, 100), (5, 90), (200, 300)
    spoken = [said("correct", found, other), said("exclude", found)]
    (one,) = standing(spoken)
    assert (one.bounds_utc_ns, one.excluded) == (other, "because of exclude")
    (one,) = standing([*spoken, said("accept", found)])
    assert (one.bounds_utc_ns, one.excluded) == (None, None)
    first, second = standing([said("exclude", found), said("add", new, new), said("correct", new, (210, 300))])
    assert first.excluded == "because of exclude" and second.bounds_utc_ns == (210, 300)
    *_, second = standing([said("add", new, new), said("correct", new, (210, 300)), said("accept", new)])
    assert second.bounds_utc_ns == new


def test_a_corrected_zigzag_takes_the_place_of_the_one_found(log: tuple[Series, Series, Zigzag]) -> None:
    heading, rudder, zigzag = log
    found = zigzag.start_utc_ns, zigzag.end_utc_ns
    # to where the second leg from the end begins
    bounds = zigzag.start_utc_ns + 2 * SECOND_NS, zigzag.executes[-2].time_utc_ns
    ((one,), _) = applied(
        [zigzag], standing([said("correct", found, bounds)]), lambda b: zigzag_between(heading, rudder, None, *b)
    )
    corrected = one.zigzag
    assert (corrected.start_utc_ns, corrected.end_utc_ns) == bounds
    assert (corrected.psi0_deg, corrected.delta0_deg) == (zigzag.psi0_deg, zigzag.delta0_deg)
    assert [e.time_utc_ns for e in corrected.executes] == pytest.approx(
        [e.time_utc_ns for e in zigzag.executes[: len(corrected.executes)]], abs=SECOND_NS
    )
    assert len(corrected.executes) == len(zigzag.executes) - 2
    edges = [(phase.start_utc_ns, phase.end_utc_ns) for phase in corrected.phases]
    assert edges[0][0] == bounds[0] and edges[-1][1] == bounds[1]
    assert all(before[1] == after[0] for before, after in pairwise(edges))
    # newer code finds it a little later: the correction is of the same manoeuvre
    late = (zigzag.start_utc_ns - 3 * SECOND_NS, zigzag.end_utc_ns)
    ((again,), _) = applied(
        [zigzag], standing([said("correct", late, bounds)]), lambda b: zigzag_between(heading, rudder, None, *b)
    )
    assert again.zigzag == corrected


def test_an_excluded_one_stays_and_is_marked(log: tuple[Series, Series, Zigzag]) -> None:
    _, _, zigzag = log
    ((one,), _) = applied(
        [zigzag], standing([said("exclude", (zigzag.start_utc_ns, zigzag.end_utc_ns))]), lambda _: zigzag
    )
    assert one.zigzag == zigzag and one.standing is not None and one.standing.excluded == "because of exclude"


def test_between_bounds_without_legs_is_no_zigzag(log: tuple[Series, Series, Zigzag]) -> None:
    heading, rudder, zigzag = log
    first = zigzag.executes[0].time_utc_ns
    for bounds in ((first - 30 * SECOND_NS, first - SECOND_NS), (first, first + SECOND_NS), (0, 10)):
        with pytest.raises(DataRejected, match="no zigzag to describe"):
            zigzag_between(heading, rudder, None, *bounds)


def test_what_the_search_refuses_is_described_where_a_person_says_so() -> None:
    """The rudder is reversed at headings that agree with nothing: the search finds none."""
    heading, rudder = sailed(switching_deg=(20.0, 9.0, 31.0, 12.0, 25.0))
    assert find_zigzags(heading, rudder) == []
    zigzag = zigzag_between(heading, rudder, None, int(rudder.time_utc_ns[0]), int(rudder.time_utc_ns[-1]))
    assert len(zigzag.executes) >= 4 and zigzag.delta0_deg == 20.0
    assert np.isfinite(zigzag.psi0_deg)


def test_bounds_that_hold_no_zigzag_any_more_stop_nothing(log: tuple[Series, Series, Zigzag]) -> None:
    heading, rudder, zigzag = log
    before = zigzag.executes[0].time_utc_ns
    nothing = before - 30 * SECOND_NS, before - SECOND_NS
    spoken = [said("add", nothing, nothing)]
    found, notes = applied([zigzag], standing(spoken), lambda b: zigzag_between(heading, rudder, None, *b))
    assert [one.zigzag for one in found] == [zigzag]
    assert len(notes) == 1 and "added by hand (because of add) is not there" in notes[0]
    spoken.append(said("exclude", nothing))
    assert applied([zigzag], standing(spoken), lambda b: zigzag_between(heading, rudder, None, *b))[1] == ()
