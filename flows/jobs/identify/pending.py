"""What was made and is not stored yet: parameter sets and what aliases shall point to, for one commit a table."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from kempf.schemas.errors import NotFound
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, parameter_sets
from kempf.warehouse.tables.parameter_set import ParameterSet

#: New sets of a vessel that wait for one commit: less than a minute of work, which is what a crash may cost.
_SETS_A_COMMIT = 8


class PendingSets:
    """New sets of one vessel, and her aliases; a long list of sets is stored on the way.

    Parameters
    ----------
    warehouse : Warehouse
    vessel : str
    """

    def __init__(self, warehouse: Warehouse, vessel: str) -> None:
        self._warehouse, self._vessel = warehouse, vessel
        self.sets: list[ParameterSet] = []
        #: by vessel and alias
        self.aliases: dict[tuple[str, str], str] = {}

    def keep(self, sets: Sequence[ParameterSet]) -> None:
        """Take new sets."""
        self.sets.extend(sets)
        if len(self.sets) >= _SETS_A_COMMIT:
            # what cannot be stored is not tried again on the way out
            sets, self.sets = self.sets, []
            parameter_sets.insert(self._warehouse, sets)

    def may_move(self, spec: ModelSpec, *, adopt: bool) -> bool:
        """Return whether ``current`` may go to a set of this model: from a model with effects only to the like.

        The model of a set that was withdrawn counts as hers: it is brought up to date, and is current then.

        Parameters
        ----------
        adopt : bool
            Whether it may leave another model.
        """
        pointed = aliases.of_vessel(self._warehouse, self._vessel)
        name = self.aliases.get((self._vessel, aliases.CURRENT)) or aliases.of_model(pointed)
        if name is None:
            return True
        try:
            standing = self._standing(name)
        except NotFound:
            # its file was lost: which model it was nobody knows, so that only a person may put one in its place
            return adopt
        now = ModelSpec.model_validate(dict(standing.model_spec))
        return now == spec or (adopt and (bool(spec.effects) or not now.effects))

    def _standing(self, name: str) -> ParameterSet:
        """Return a set that waits or is stored, as it is stored."""
        new_set = next((parameter_set for parameter_set in self.sets if parameter_set.parameter_set_id == name), None)
        return new_set or parameter_sets.stored_anywhere(self._warehouse, name, self._vessel)

    def point(self, parameter_set_id: str, alias: str = aliases.CURRENT) -> None:
        """Let an alias point to one of her sets, once that is stored."""
        self.aliases[self._vessel, alias] = parameter_set_id


@contextmanager
def waiting(warehouse: Warehouse, vessel: str) -> Iterator[PendingSets]:
    """Lend a list, and store what is in it also where the block is left by an error."""
    waiting_list = PendingSets(warehouse, vessel)
    try:
        yield waiting_list
    finally:
        store(warehouse, [waiting_list])


def store(warehouse: Warehouse, lists: Sequence[PendingSets]) -> None:
    """Store what waits of several vessels, in one commit a table."""
    parameter_sets.insert(warehouse, [parameter_set for waiting_list in lists for parameter_set in waiting_list.sets])
    # behind the sets: an alias never points to what is not there
    aliases.point_all(warehouse, {key: name for waiting_list in lists for key, name in waiting_list.aliases.items()})
