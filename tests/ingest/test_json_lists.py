"""JSON messages whose numbers stand in lists, or that end with a NUL as strings of C do."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from kempf.pipeline.ingest.messages.json_reader import JsonReader
from kempf.pipeline.ingest.spans import Spans, as_bytes
from tests.ingest.test_mcap import profile, read, write


def columns(messages: list[object], wanted: list[str]) -> list[list[float | None]]:
    """Return what is read of messages, by field; None where a field is absent."""
    payloads = [one if isinstance(one, bytes) else json.dumps(one).encode() for one in messages]
    ends = np.cumsum([len(one) for one in payloads])
    found = JsonReader(wanted).read(Spans(as_bytes(b"".join(payloads)), np.append(0, ends[:-1]), ends))
    assert found.good.all()
    return [
        [float(v) if there else None for v, there in zip(value, present, strict=True)]
        for value, present in zip(found.value, found.present, strict=True)
    ]


def test_elements_of_a_list_are_named_by_their_number_from_0() -> None:
    messages = [
        {"data": [4.5, 99], "rudders": [{"side": "port", "angle": -3}, {"angle": "2.5"}], "grid": [[1, 2], [3, 4]]},
        {"data": [1e-3]},
        {"data": {"0": 7}, "rudders": {"1": {"angle": 8}}},
        {"data": 5, "rudders": [], "grid": None},
        {"data": [None, [1]]},
    ]
    first, second, angle, corner = columns(messages, ["data.0", "data.1", "rudders.1.angle", "grid.1.0"])
    assert first == [4.5, 1e-3, 7.0, None, None]
    assert second[:4] == [99.0, None, None, None] and second[4] is not None and math.isnan(second[4])
    assert angle == [2.5, None, 8.0, None, None]
    assert corner == [3.0, None, None, None, None]


@pytest.mark.parametrize("place", ["00", "1" * 9, "9" * 5000, "²", "-1"])
def test_a_number_that_is_no_place_is_absent(place: str) -> None:
    assert columns([{"data": [1, 2]}], [f"data.{place}"])[0] == ([1.0] if place == "00" else [None])


def test_a_profile_maps_an_element() -> None:
    given = profile({"/steering.angles.1": {"channel": "rudder_angle", "unit": "deg"}})
    readings = read(write([("/steering", k, {"angles": [0, k]}) for k in range(4)]), given)
    assert readings.frame["rudder_angle_rad"].to_list() == [math.radians(k) for k in range(4)]


def test_the_nul_behind_a_string_of_c_is_no_part_of_the_message() -> None:
    nul = json.dumps({"h": 2.5}).encode() + b"\0"
    assert columns([nul, nul + b"\0", '{"h": 3}'.encode("utf-16-le"), {"h": 1}], ["h"]) == [[2.5, 2.5, 3.0, 1.0]]
