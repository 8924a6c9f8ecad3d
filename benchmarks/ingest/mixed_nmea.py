"""Writes an NMEA 0183 log of every sentence that is read, and of some that are not, for measuring and for fuzzing."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Literal

import numpy as np

from kempf.pipeline.simulate.nmea_log import checksum, damage

#: What stands in front of the sentences: nothing, the logger's ISO 8601 stamp, or a TAG block with source and time.
Dress = Literal["plain", "stamped", "tagged"]

#: Start of the log, UTC seconds since 1970: 2025-05-03 22:00, so that an hour and a half in the day ends.
START_S = 1_746_309_600

#: Every dress.
DRESSES: tuple[Dress, ...] = ("stamped", "plain", "tagged")

Body = Callable[[str, str, np.random.Generator], str]


def _at(decimals: int, low: float, high: float, random: np.random.Generator) -> str:
    return f"{random.uniform(low, high):.{decimals}f}"


def _place(r: np.random.Generator) -> str:
    return f"59{r.uniform(50, 59):08.5f},N,024{r.uniform(10, 40):08.5f},E"


#: Talker and sentence from time of day, date and a source of random numbers; sentences that come often stand twice.
BODIES: tuple[Body, ...] = (
    lambda t, d, r: f"GPRMC,{t},A,{_place(r)},{_at(2, 10, 16, r)},{_at(2, 0, 359, r)},{d},7.9,E,A",
    lambda t, d, r: f"GPRMC,{t},A,{_place(r)},{_at(2, 10, 16, r)},{_at(2, 0, 359, r)},{d},7.9,E,A",
    lambda t, d, r: f"GPVTG,{_at(2, 0, 359, r)},T,,M,{_at(2, 10, 16, r)},N,,K,A",
    lambda t, d, r: f"GPGGA,{t},{_place(r)},1,10,0.8,12.3,M,18.2,M,,",
    lambda t, d, r: f"GPGLL,{_place(r)},{t},A,A",
    lambda t, d, r: f"GPZDA,{t},{d[:2]},{d[2:4]},20{d[4:]},00,00",
    lambda t, d, r: f"HEHDT,{_at(2, 0, 359, r)},T",
    lambda t, d, r: f"HEHDT,{_at(2, 0, 359, r)},T",
    lambda t, d, r: f"HEHDT,{_at(2, 0, 359, r)},T",
    lambda t, d, r: f"HETHS,{_at(2, 0, 359, r)},A",
    lambda t, d, r: f"HCHDG,{_at(1, 0, 359, r)},0.5,W,7.9,E",
    lambda t, d, r: f"HCHDM,{_at(1, 0, 359, r)},M",
    lambda t, d, r: f"TIROT,{_at(1, -90, 90, r)},A",
    lambda t, d, r: f"TIROT,{_at(1, -90, 90, r)},A",
    lambda t, d, r: f"AGRSA,{_at(1, -20, 20, r)},A,,",
    lambda t, d, r: f"AGRSA,{_at(1, -20, 20, r)},A,,",
    lambda t, d, r: f"VDVHW,,T,,M,{_at(2, 10, 16, r)},N,,K",
    lambda t, d, r: f"VDVBW,{_at(2, 10, 16, r)},{_at(2, -1, 1, r)},A,,,V",
    lambda t, d, r: f"VDVLW,{_at(1, 2000, 3000, r)},N,{_at(1, 0, 90, r)},N",
    lambda t, d, r: f"WIMWV,{_at(1, 0, 359, r)},R,{_at(1, 0, 20, r)},M,A",
    lambda t, d, r: f"WIMWD,{_at(1, 0, 359, r)},T,,M,{_at(1, 0, 20, r)},N,,M",
    lambda t, d, r: f"ERRPM,S,1,{_at(1, 80, 130, r)},,A",
    lambda t, d, r: f"SDDPT,{_at(1, 30, 90, r)},0.5",
    lambda t, d, r: f"SDDBT,,f,{_at(1, 30, 90, r)},M,,F",
    lambda t, d, r: f"YXXDR,A,{_at(2, -9, 9, r)},D,ROLL,A,{_at(2, -2, 2, r)},D,PTCH",
    lambda t, d, r: "GPGSV,3,1,12,01,40,083,46,02,17,308,41,12,07,344,39,14,22,228,45",
    lambda t, d, r: f"PGRME,{_at(1, 1, 20, r)},M,19.8,M,27.5,M",
    lambda t, d, r: "AIVDM,1,1,,A,13u?etPv2;0n:dDPwUM1U1Cb069D,0",
)


def mixed_log(lines: int, dress: Dress, damaged: int, seed: int = 5) -> tuple[bytes, set[int]]:
    """Return a log, ten sentences a second, and the numbers of the lines whose checksum was made wrong."""
    random = np.random.default_rng(seed)
    # a log begins with a date, or its first sentences had no time
    kinds = [0, *random.integers(len(BODIES), size=lines - 1).tolist()]
    written = list(_dressed(kinds, dress, random))
    wrong = {int(k) for k in random.choice(np.arange(1, lines), size=damaged, replace=False)}
    for k in wrong:
        line = written[k]
        at = line.rindex(b"!" if b"!" in line else b"$")
        # `damage` knows no TAG block, whose asterisk comes first, and no other opening
        written[k] = line[: at + 1] + damage(b"$" + line[at + 1 :], random)[1:]
    return b"\r\n".join([*written, b""]), wrong


def _dressed(kinds: list[int], dress: Dress, random: np.random.Generator) -> Iterator[bytes]:
    for number, kind in enumerate(kinds):
        tenths = number % 10
        second = np.datetime64(START_S + number // 10, "s").item()
        body = BODIES[kind](f"{second:%H%M%S}.{tenths}0", f"{second:%d%m%y}", random)
        line = f"{'!' if body.startswith('AI') else '$'}{body}*{checksum(body)}"
        if dress == "stamped":
            line = f"{second:%Y-%m-%dT%H:%M:%S}.{tenths}43Z {line}"
        elif dress == "tagged":
            tag = f"s:GP0001,c:{START_S + number // 10}{tenths}43"
            line = f"\\{tag}*{checksum(tag)}\\{line}"
        yield line.encode("ascii")
