"""What became of a damaged warehouse."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import Any

from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.upkeep.verify import UNFINISHED, Problem


@dataclass
class Repaired:
    """What became of a damaged warehouse."""

    #: done, gone: What was made again, and what is lost for good, a sentence each.
    done: list[str] = field(default_factory=list)
    gone: list[str] = field(default_factory=list)
    #: What is still wrong.
    left: list[Problem] = field(default_factory=list)
    #: Of what logs gave that had to be taken out: months (key of the vessel, blank, month), and keys of vessels; None
    #: stands for all of them.
    months: set[str] = field(default_factory=set)
    vessel_keys: set[str | None] = field(default_factory=set)
    #: How much of the parameter sets is lost, such as "2 rows of the table parameter_sets".
    sets: list[str] = field(default_factory=list)
    #: Whether names of parameter sets are lost.
    names: bool = False
    #: Whether rows of the register of vessels are lost.
    vessels: bool = False
    #: Whether rows of the register of logs had to be taken out: then what is kept beside the raw logs counts.
    registers: bool = False

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON content."""
        return {"done": self.done, "lost": self.gone, "left": [problem.as_json() for problem in self.left]}

    def recall(self, warehouse: Warehouse) -> None:
        """Go on with what an earlier repair did not finish."""
        data = warehouse.read_bytes(*UNFINISHED)
        if data is not None:
            content = json.loads(data)
            self.months |= set(content["months"])
            self.vessel_keys |= set(content["vessel_keys"])
            self.registers = bool(content["registers"])

    def keep_unfinished(self, warehouse: Warehouse) -> None:
        """Keep what is still to be read again until that is done."""
        content = {
            "months": sorted(self.months),
            "vessel_keys": sorted(self.vessel_keys, key=str),
            "registers": self.registers,
        }
        warehouse.write_bytes(json.dumps(content).encode(), *UNFINISHED)
