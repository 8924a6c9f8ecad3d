"""Whatever the bytes: an error that a person can read, or ledgers that close."""

import io

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import Writer

from benchmarks.ingest.fuzzing.oracles import check_ledgers
from kempf.schemas.errors import KempfError
from kempf.schemas.profile import VesselProfile
from tests.reading import read_log

PROFILE = VesselProfile.model_validate(
    {
        "sources": [
            {"match": "*.nmea", "format": "nmea"},
            {
                "match": "*.mcap",
                "format": "mcap",
                "channels": {
                    "/a.b": {"channel": "heading", "unit": "deg"},
                    "/a.c.d": {"channel": "roll", "unit": "deg"},
                },
            },
            {
                "match": "*.ws",
                "format": "delimited",
                "separator": "whitespace",
                "columns": ["t", "h", "r"],
                "time": {"column": "t", "unit": "s"},
                "channels": {"h": {"channel": "heading", "unit": "deg"}, "r": {"channel": "roll", "unit": "deg"}},
            },
            {
                "match": "*",
                "time": {"column": "t"},
                "channels": {"h": {"channel": "heading", "unit": "deg"}, "r": {"channel": "roll", "unit": "deg"}},
            },
        ]
    }
)


def check(name, data):
    try:
        readings = read_log(name, data, PROFILE)
    except KempfError as error:
        assert error.message and error.next_step and error.code
        return None
    check_ledgers(readings)
    assert readings.frame["record"].is_sorted() and readings.rejected["record"].is_sorted()
    return readings


QUICK = settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))
name = st.sampled_from(["a.nmea", "a.ws", "a.csv"])


@QUICK
@given(name, st.binary(max_size=300))
def test_any_bytes(file_name, data):
    check(file_name, data)


tokens = st.sampled_from(
    [
        "$",
        "!",
        "*",
        ",",
        "\\",
        "\n",
        "\r\n",
        "GPRMC",
        "HEHDT",
        "YXXDR,A,1,D,ROLL",
        "00",
        "T",
        "A",
        "074701.15",
        "030525",
        " ",
        "5954.0,N",
        "02436.0,E",
        "\0",
        "\xe9",
        '"',
        "\t",
        ";",
        "t,h,r",
        "2025-05-03T07:47:01Z",
        "1e3",
        "-",
        ".",
        "nan",
        "inf",
        "$HEHDT,11.37,T*2B",
        "$SDDPT,53.7,0.0*66",
        "$GPRMC,074701.15,A,5954.0003,N,02435.9999,E,17.64,13.43,030525,,,A*51",
    ]
)


@QUICK
@given(name, st.lists(tokens, max_size=60))
def test_any_text_of_the_right_words(file_name, words):
    check(file_name, "".join(words).encode())


@QUICK
@given(st.lists(st.one_of(tokens, st.just("2025-05-03T07:47:01Z,1,2\n")), max_size=30))
def test_any_rows(words):
    check("a.csv", b"t,h,r\n" + "".join(words).encode())


def _mcap(payloads):
    out = io.BytesIO()
    writer = Writer(out, chunk_size=200)
    writer.start()
    channel = writer.register_channel("/a", "json", 0)
    for k, payload in enumerate(payloads):
        writer.add_message(channel, 1_755_497_274_000_000_000 + k // 2 * 10**9, payload, 0)
    writer.finish()
    return out.getvalue()


json_text = st.sampled_from(
    [
        b'{"b": 1}',
        b'{"b": 2, "c": {"d": 3}}',
        b'{"c": 4}',
        b'{"c": {"d": "x"}}',
        b"{",
        b"",
        b"null",
        b'{"b": 1e400}',
        b"5",
        b'{"b": [1',
        b'{"b": 99999}',
        b'{"b": {"z": 1}}',
        b"[" * 3000,
        b'{"b": "\\ud800"}',
        b'{"b": 1}\x00',
        b'{"b":1}\n\n',
    ]
)


@QUICK
@given(st.lists(st.one_of(json_text, st.binary(max_size=12)), max_size=20))
def test_any_payloads(payloads):
    readings = check("a.mcap", _mcap(payloads))
    assert readings is None or readings.tally.records_read == len(payloads)


@QUICK
@given(st.data())
def test_any_damage_to_an_mcap_file(data):
    whole = bytearray(_mcap([b'{"b": 1, "c": {"d": 2}}'] * 20))
    for _ in range(data.draw(st.integers(0, 6))):
        whole[data.draw(st.integers(8, len(whole) - 1))] = data.draw(st.integers(0, 255))
    check("a.mcap", bytes(whole[: data.draw(st.integers(8, len(whole)))]))
