"""Which symbols stand where: a term may ask for nothing that the filter has not computed by then."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from kempf.pipeline.model.terms.expression import names_in
from kempf.schemas.effect import Effect
from kempf.schemas.errors import UsageError
from kempf.schemas.symbols import (
    ACCELERATION_SYMBOLS,
    CHANNEL_SYMBOLS,
    INSTRUMENT_STATES,
    OWN_STATES,
    RUN_SYMBOLS,
    STATE_SYMBOLS,
    SYMBOLS,
)

Kind = Literal["speed", "rudder", "force", "measured", "noise"]

#: what a term of each kind may not ask for beyond the states of other effects
_LATER: Mapping[Kind, frozenset[str]] = {
    "speed": frozenset({"delta", *ACCELERATION_SYMBOLS}),
    "rudder": frozenset(ACCELERATION_SYMBOLS),
    "force": frozenset(ACCELERATION_SYMBOLS),
    "measured": frozenset(),
    # asked for once, before the run begins
    "noise": frozenset({*STATE_SYMBOLS, "delta", *ACCELERATION_SYMBOLS, *CHANNEL_SYMBOLS, *RUN_SYMBOLS}),
}
#: kind of term by target
KINDS: Mapping[str, Kind] = {
    "speed": "speed",
    "rudder": "rudder",
    "sway": "force",
    "yaw": "force",
    "lateral_speed": "measured",
    "yaw_rate": "measured",
    "heading": "measured",
}


@dataclass(frozen=True)
class Place:
    """One expression of an effect and where it stands."""

    #: As a person would say it: ``yaw``, ``m1.derivative``.
    name: str
    kind: Kind
    text: str


def places(effect: Effect) -> list[Place]:
    """Return every expression of an effect: terms in the order given, then its states."""
    expressions = [Place(target, KINDS[target], text) for target, text in effect.terms.items()]
    for state in effect.states:
        expressions.append(Place(f"{state.name}.derivative", "force", state.derivative))
        expressions.append(Place(f"{state.name}.noise", "noise", state.noise))
        expressions.append(Place(f"{state.name}.initial_std", "noise", state.initial_std))
    return expressions


def allowed(kind: Kind, own_states: tuple[str, ...] = ()) -> tuple[str, ...]:
    """Return the symbols that a term of a kind may ask for.

    Parameters
    ----------
    own_states : tuple of str, optional
        States that its effect brings along.
    """
    return tuple(name for name in symbols_beside(own_states) if name not in _LATER[kind])


def symbols_beside(own_states: Sequence[str]) -> list[str]:
    """Return all symbols but the states that other effects bring along.

    Parameters
    ----------
    own_states : sequence of str
        States that the effect in question brings along.
    """
    others = {*OWN_STATES, *INSTRUMENT_STATES} - {*own_states}
    return [name for name in SYMBOLS if name not in others]


def require_in_place(place: Place, own_states: tuple[str, ...] = ()) -> None:
    """Refuse an expression that asks for a symbol which is not there yet where it stands.

    Parameters
    ----------
    own_states : tuple of str, optional
        States that its effect brings along.

    Raises
    ------
    UsageError
        ``symbol_out_of_place``.
    """
    known = allowed(place.kind, own_states)
    for name in names_in(place.text):
        if name in SYMBOLS and name not in known:
            why = "belongs to no state of this effect" if name in OWN_STATES else "is not known yet where it stands"
            raise UsageError(
                "symbol_out_of_place",
                f"The expression for {place.name} asks for {name!r}, which {why}.",
                f"Use {', '.join(known)}.",
                {"place": place.name, "symbol": name},
            )
