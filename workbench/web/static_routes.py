"""Scripts and styles below ``/static/``: read once at the start, so that no address ever becomes the path of a file."""

from __future__ import annotations

import hashlib

from fastapi import FastAPI
from starlette.requests import Request
from starlette.responses import Response

from kempf.workbench.static_files import contents


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
