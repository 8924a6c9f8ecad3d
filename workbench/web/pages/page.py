"""What a page gathers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Page:
    """A page before it is drawn."""

    #: File name of its template.
    template: str
    #: Shown above it and in the browser's tab.
    title: str
    #: Names for the template.
    content: Mapping[str, Any]
    #: Way back, from the fleet on: words and addresses.
    above: tuple[tuple[str, str], ...] = field(default=())
