"""Which cases there are: a balanced sample over effect, hull, noise, disturbance and strength, decided by the seed."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from benchmarks.diagnose.hidden_effects.effects import CATALOGUE, SHARES, HiddenEffect, Kind
from benchmarks.diagnose.hidden_effects.outsiders import OUTSIDERS
from benchmarks.diagnose.hidden_effects.programme import DISTURBANCES
from kempf.pipeline.simulate.hulls import HULLS
from kempf.pipeline.simulate.random_streams import stream

T = TypeVar("T")

#: Factors on the realistic noise.
NOISES = (0.5, 1.0, 2.0)
#: Whether the instruments are as they are sold: a third.
SOLD = (False, False, True)
FORMATS = ("csv", "mcap", "nmea")

#: Parts of the sample without effect and with one outside the catalogue.
_NONE_SHARE, _OUTSIDE_SHARE = 0.125, 0.175


@dataclass(frozen=True)
class Case:
    """One ship with one effect or none."""

    #: Name of her folder and of the vessel; gives nothing away.
    case_id: str
    #: kind, effect: ``catalogue``, ``outsider`` or ``none``; name of the effect, ``none`` where there is none.
    kind: Kind
    effect: str
    #: Key of `kempf.pipeline.simulate.hulls.HULLS`.
    hull: str
    #: Factor on the noise.
    noise: float
    disturbance: str
    #: 0 small, 1 medium, 2 large.
    strength: int
    #: Whether the instruments are as they are sold.
    sold: bool
    #: Of the logs, one a day.
    formats: tuple[str, str]
    #: Of everything random in the case.
    seed: int
    #: Rows a second of the delimited logs; None for as many as every reading needs to stand in two of them.
    rows_hz: float | None = None

    @property
    def hidden(self) -> HiddenEffect | None:
        """The effect, None where there is none."""
        return (CATALOGUE | OUTSIDERS).get(self.effect)


def design(n: int, seed: int, rows_hz: float | None = None) -> tuple[Case, ...]:
    """Return the cases in an order that gives nothing away.

    Parameters
    ----------
    n : int
        How many; an eighth has no effect, about a sixth one outside the catalogue. Effects take turns, so that none
        has two cases more than another of its kind; every factor takes turns within every effect.
    rows_hz : float, optional
        All logs are tables of so many rows a second.
    """
    n_none, n_outside = round(_NONE_SHARE * n), round(_OUTSIDE_SHARE * n)
    labels: list[tuple[Kind, str]] = [("none", "none")] * n_none
    labels += [("outsider", name) for name in _turns(tuple(OUTSIDERS), n_outside, seed, "outsiders")]
    labels += [("catalogue", name) for name in _turns(tuple(CATALOGUE), n - len(labels), seed, "catalogue")]
    rows = []
    for label in dict.fromkeys(labels):
        count = labels.count(label)
        factors = (tuple(HULLS), NOISES, DISTURBANCES, tuple(range(len(SHARES))), SOLD)
        columns = [_turns(f, count, seed, f"{label[1]} {k}") for k, f in enumerate(factors)]
        rows += [(label, *row) for row in zip(*columns, strict=True)]
    order = stream(seed, "order of the cases").permutation(n)
    return tuple(_case(place, seed, rows_hz, *rows[k]) for place, k in enumerate(order))


def _turns(levels: tuple[T, ...], n: int, seed: int, purpose: str) -> list[T]:
    """Return n levels, every one as often as another or once more, in random order."""
    random = stream(seed, purpose)
    first = random.permutation(len(levels))
    found = [levels[int(first[k % len(levels)])] for k in range(n)]
    return [found[int(k)] for k in random.permutation(n)]


def _case(
    place: int,
    seed: int,
    rows_hz: float | None,
    label: tuple[Kind, str],
    hull: str,
    noise: float,
    disturbance: str,
    strength: int,
    sold: bool,
) -> Case:
    digest = hashlib.sha256(f"{seed} {place}".encode()).digest()
    own = int(np.frombuffer(digest[:4], dtype=np.uint32)[0])
    formats = ("csv", "csv") if rows_hz else (FORMATS[place % 3], FORMATS[(place + 1) % 3])
    return Case(digest[4:9].hex(), *label, hull, noise, disturbance, strength, sold, formats, own, rows_hz)
