"""The words that the inputs of each reader are made of, and some that they should not be made of."""

from __future__ import annotations

from benchmarks.ingest.fuzzing.corpus import Reader

_TEXT = "\r|\n|\r\n|\t| |  |\x00|\x1f|é|٣|\ufeff|🚢|nan|inf|-|+|.|1e3|1e400|-0|.5|5.|1_0|0x1|99999999999999999999"

_NMEA = (
    r"$|!|*|,|\|*00|*FF|$GPRMC,|$GPZDA,|$GPGGA,|$GPGLL,|$HCHDM,|$HCHDG,|$AGRSA,|$YXXDR,A,|,D,ROLL|!AIVDM,|$PXXX,"
    r"|235959.99|000000|235960|240000|290225|310699|060180|220899|A|V|N|E|W|T|M|K|8999.99|1234567.12345678|0012345678.9"
    r"|\c:1746255600*00\|\g:1-2-3,c:|9999999999999999|2025-05-03T23:59:59.999Z|2025-05-03 23:59:59,|2025-05-03T"
)
_DELIMITED = (
    ',|;|"|""|utc|t|h|r|sog|delta|2025-05-03T06:00:00Z|2025-05-03T06:00:00.123456789+02:00|1746255600000'
    "|9223372036854775807|9223372036854775808|9200000000000000000"
)
_PROFILE = (
    "vessel: |sources: |match: |channels: |channel: |unit: |time: |column: |start: |offset: |positive: |separator: "
    "|encoding: |header_lines: |columns: |format: |&a |*a|*some|<<: |!!binary |!!float |!!python/object:os.system "
    "|!!timestamp |!!set |!!omap |? |>|{|}|[|]|: |- |#|%|@|`|'|\n  |\n  - |.nan|-.inf|null|~|yes|0o7|0x1F|2025-13-01"
    "|2025-05-03T06:00:00Z|9999-01-01T00:00:00Z|utf-16|utf-7|idna|punycode|rot13|hex|base64|zlib|unicode_escape|mbcs"
    "|../../etc|whitespace|speed_over_ground|deg/min|1e999|-1|1000001"
)
_SIZES = (0, 9, 1 << 20, (1 << 63) - 1, (1 << 64) - 1)
_MCAP = (
    b"\x89MCAP0\r\n",
    b'{"heading": 1}',
    b'{"pose": {"speed": 1}}',
    b'{"heading": 1e400}',
    b"[" * 500,
    b"null",
    b"\\ud800",
    b"zstd",
    b"lz4",
    b"json",
    b"protobuf",
    *(bytes([opcode]) + size.to_bytes(8, "little") for opcode in range(1, 16) for size in _SIZES),
)


def _split(*parts: str) -> tuple[bytes, ...]:
    return tuple(word.encode() for part in parts for word in part.split("|"))


WORDS: dict[Reader, tuple[bytes, ...]] = {
    "nmea": (*_split(_NMEA, _TEXT), b"\xff", b"\x80"),
    "delimited": (*_split(_DELIMITED, _TEXT), b"\xff", b"\xff\xfe", b"\xfe\xff"),
    "mcap": _MCAP,
    "profile": (*_split(_PROFILE, _TEXT), b"\xff", b"|"),
}
