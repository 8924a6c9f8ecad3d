"""What stands before every page: which requests are answered at all, and what a browser may do with the answer.

A browser that was lured to another site can send requests here. Such a site may let its own name point to this machine
(DNS rebinding); its requests then carry that name, and are refused. What writes needs a cookie that only the address
printed at the start gives, and an origin that is ours. Nothing inline is run, nothing foreign is loaded, and script
cannot turn text into markup (Trusted Types).
"""

from __future__ import annotations

import hmac
from collections.abc import Awaitable, Callable
from urllib.parse import urlencode, urlsplit

from starlette.requests import Request
from starlette.responses import PlainTextResponse, RedirectResponse, Response

from kempf.workbench.web.settings import Settings

POLICY = "; ".join(
    (
        "default-src 'none'",
        "script-src 'self'",
        "style-src 'self'",
        "img-src 'self'",
        "connect-src 'self'",
        "form-action 'self'",
        "base-uri 'none'",
        "frame-ancestors 'none'",
        "require-trusted-types-for 'script'",
        "trusted-types 'none'",
    )
)
HEADERS = {
    "Content-Security-Policy": POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}
COOKIE = "kempf"
_READS = ("GET", "HEAD")
_FOREIGN = "Another site asks for this; only its own pages may.\n"


class Guard:
    """The first of all that a request meets.

    Parameters
    ----------
    settings : Settings
    """

    def __init__(self, settings: Settings) -> None:
        self._names, self._token, self._anybody_reads = settings.names, settings.token, settings.anybody_reads

    async def __call__(self, request: Request, answer: Callable[[Request], Awaitable[Response]]) -> Response:
        """Answer a request, or refuse it."""
        request.state.may_write = self._knows(request.cookies.get(COOKIE))
        refusal = self._refusal(request) or self._exchanged(request)
        response = await answer(request) if refusal is None else refusal
        for name, value in HEADERS.items():
            response.headers[name] = value
        return response

    def _refusal(self, request: Request) -> Response | None:
        host = request.headers.get("host", "")
        if _without_port(host) not in self._names:
            return PlainTextResponse(
                f"This server does not answer to the name {host[:200]!r}. Open it by the address that `kempf "
                "workbench` printed, or start it with --allow-host NAME.\n",
                status_code=421,
            )
        if request.method == "POST":
            return self._no_writer(request)
        if request.method not in _READS:
            return PlainTextResponse("Pages are read and forms are sent.\n", 405, {"Allow": "GET, HEAD, POST"})
        if not self._anybody_reads and not request.state.may_write and "token" not in request.query_params:
            return PlainTextResponse(
                "Open the address that `kempf workbench` printed when it started: it lets this browser in.\n", 403
            )
        site, mode = request.headers.get("sec-fetch-site"), request.headers.get("sec-fetch-mode")
        return PlainTextResponse(_FOREIGN, 403) if site == "cross-site" and mode != "navigate" else None

    def _no_writer(self, request: Request) -> Response | None:
        """Refuse what writes where it is not asked for by a page of ours, in the browser of one who may."""
        origin = urlsplit(request.headers.get("origin", "")).netloc
        site = request.headers.get("sec-fetch-site", "same-origin")
        if _without_port(origin) not in self._names or site not in ("same-origin", "none"):
            return PlainTextResponse(_FOREIGN, 403)
        if not request.state.may_write:
            return PlainTextResponse(
                "This browser may only read. Open the address that `kempf workbench` printed when it started.\n", 403
            )
        return None

    def _knows(self, token: str | None) -> bool:
        if self._token is None or token is None:
            return False
        return hmac.compare_digest(token.encode(), self._token.encode())

    def _exchanged(self, request: Request) -> Response | None:
        """Give the cookie for the token of the start address, and take the token out of the address."""
        token = request.query_params.get("token")
        if token is None:
            return None
        left = urlencode([(key, value) for key, value in request.query_params.multi_items() if key != "token"])
        # "//name" would be another server's address
        path = "/" + request.url.path.lstrip("/")
        to = RedirectResponse(path + (f"?{left}" if left else ""), status_code=303)
        if self._knows(token):
            to.set_cookie(COOKIE, token, httponly=True, samesite="strict")
        return to


def _without_port(host: str) -> str:
    """Return the name in a Host header, in lower case.

    Examples
    --------
    >>> _without_port("localhost:8765"), _without_port("[::1]:80"), _without_port("127.0.0.1")
    ('localhost', '[::1]', '127.0.0.1')
    """
    name, colon, port = host.rpartition(":")
    return (name if colon and port.isdigit() else host).lower()
