"""Scripts and styles: read once at the start, so that no address ever becomes the path of a file."""

from __future__ import annotations

import hashlib
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable

from fastapi import FastAPI
from starlette.requests import Request
from starlette.responses import Response

_TYPES = {"js": "text/javascript", "css": "text/css", "svg": "image/svg+xml"}


@cache
def contents() -> dict[str, tuple[bytes, str]]:
    """Return what is served below ``/static/``: bytes and media type by name."""
    return dict(sorted(_below(files("kempf.workbench.web") / "static", "")))


def _below(folder: Traversable, begin: str) -> list[tuple[str, tuple[bytes, str]]]:
    entries = []
    for entry in folder.iterdir():
        if entry.is_dir():
            entries += _below(entry, f"{begin}{entry.name}/")
        elif (kind := entry.name.rpartition(".")[2]) in _TYPES:
            entries.append((begin + entry.name, (entry.read_bytes(), _TYPES[kind])))
    return entries


def serve(app: FastAPI) -> None:
    """Answer with them; a browser that asks again gets none of it anew where nothing changed."""
    for name, (content, kind) in contents().items():
        app.add_route(f"/static/{name}", _answering(content, kind))


def _answering(content: bytes, kind: str):  # type: ignore[no-untyped-def]
    tag = f'"{hashlib.sha256(content).hexdigest()[:16]}"'
    headers = {"ETag": tag, "Cache-Control": "no-cache"}

    def answer(request: Request) -> Response:
        if request.headers.get("if-none-match") == tag:
            return Response(status_code=304, headers=headers)
        return Response(content, media_type=kind, headers=headers)

    return answer
