"""ROS 2 messages in CDR, read in columns by a program made of their definition."""

from __future__ import annotations

import numpy as np

from kempf.pipeline.ingest.messages.cdr_definition import full_name, types_of
from kempf.pipeline.ingest.messages.cdr_program import program_for
from kempf.pipeline.ingest.messages.cdr_walk import walk
from kempf.pipeline.ingest.messages.columns import Columns, NoReaderError
from kempf.pipeline.ingest.spans import Spans


class CdrReader:
    """Reads fields of ROS 2 messages of one type.

    Parameters
    ----------
    name : str
        Of the schema.
    definition : str
        Its text, with the definitions that it refers to.
    wanted : list of str
        Fields, nested ones with dots.

    Raises
    ------
    NoReaderError
        The definition cannot be read, or a field cannot be reached.
    """

    def __init__(self, name: str, definition: str, wanted: list[str]) -> None:
        types = types_of(name, definition)
        if full_name(name, "") not in types:
            raise NoReaderError(f"the type {name} is not defined")
        program = program_for(types, name, wanted)
        self._steps, self._kinds, self._closed = program.table(), program.kinds, program.closed
        self.missing = program.missing

    def read(self, payloads: Spans) -> Columns:
        """Return the wanted fields of messages.

        Parameters
        ----------
        payloads : Spans
            With their encapsulation, shape (m,).
        """
        m, k = len(payloads), len(self._kinds)
        found = Columns.empty(k, m)
        bits, present = np.zeros((m, k), dtype=np.uint64), np.zeros((m, k), dtype=np.bool_)
        walk(payloads.buffer, payloads.start, payloads.stop, self._steps, self._closed, bits, present, found.good)
        for slot, kind in enumerate(self._kinds):
            if kind:
                dtype = np.dtype(kind)
                raw = bits[:, slot].astype(f"<u{dtype.itemsize}").view(dtype.newbyteorder("<"))
                found.present[slot] = present[:, slot] & found.good
                found.value[slot] = np.where(found.present[slot], raw.astype(np.float64), np.nan)
        return found
