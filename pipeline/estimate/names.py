"""What a person calls the estimators; apart from them, because naming one must not load it."""

from __future__ import annotations

from typing import Literal, get_args

Name = Literal[
    "ml",
    "paper",
    "least-squares",
    "output-error",
    "subspace",
]
NAMES: tuple[Name, ...] = get_args(Name)
