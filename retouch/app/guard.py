"""Guard of the app's server: who may speak to it.

The server listens on the machine itself alone, but every page that the same browser shows can send requests
there. So each request and each websocket has to name this server as its host (a name that another site has
pointed here is refused: DNS rebinding), must not come from a page of another origin, and has to show the
token of this start, which only who reads the terminal knows. The token comes in the first address, goes into
a cookie that scripts cannot read and that other sites' pages do not send, and leaves the address.
"""

import secrets
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any
from urllib.parse import parse_qsl, urlencode

from fastapi.datastructures import Headers
from fastapi.responses import PlainTextResponse

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
Application = Callable[[Scope, Receive, Send], Awaitable[None]]

TOKEN_BYTES = 24
"""Random bytes of a token: 192 bits, beyond all guessing."""
SAFE_METHODS = frozenset({"GET", "HEAD"})
"""Methods that change nothing. A browser states the origin of every other request."""
POLICY = (
    "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; "
    "img-src 'self' data: blob:; font-src 'self' data:; connect-src 'self'; frame-ancestors 'none'; "
    "base-uri 'self'; form-action 'self'; object-src 'none'"
)
"""Content-Security-Policy: the page asks nothing of another machine. NiceGUI compiles its templates in the
browser, which takes inline scripts and `eval`."""
HEADERS = {
    "content-security-policy": POLICY,
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-resource-policy": "same-origin",
}
"""Headers of every answer."""


def new_token() -> str:
    """A token for one start of the server."""
    return secrets.token_urlsafe(TOKEN_BYTES)


class Guard:
    """An ASGI application that lets the requests of the app's own page through to another one.

    Args:
        application: that answers.
        port: of the server.
        token: that requests have to show.
    """

    def __init__(self, application: Application, port: int, token: str) -> None:
        self._application, self._token = application, token
        self._hosts = {f"{name}:{port}" for name in ("127.0.0.1", "localhost")}
        self._origins = {f"http://{host}" for host in self._hosts}
        # Browsers keep one jar of cookies for all ports of a machine.
        self._cookie = f"retouch-{port}"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self._application(scope, receive, send)
            return
        fault, send = self.fault(scope), _with_headers(send)
        if fault is None and scope["type"] == "http" and self._token_of_query(scope) is not None:
            await self._enter(scope, receive, send)
        elif fault is None:
            await self._application(scope, receive, send)
        elif scope["type"] == "websocket":
            await receive()
            await send({"type": "websocket.close", "code": 1008, "reason": fault})
        else:
            await PlainTextResponse(fault, 403, {"cache-control": "no-store"})(scope, receive, send)

    def fault(self, scope: Scope) -> str | None:
        """Why a request is refused, in a line; None if it may pass."""
        headers = Headers(scope=scope)
        hosts, origins = headers.getlist("host"), headers.getlist("origin")
        if len(hosts) != 1 or hosts[0].lower() not in self._hosts:
            return "The host of this request is not this server."
        states_origin = scope["type"] == "websocket" or scope["method"] not in SAFE_METHODS
        if (states_origin and len(origins) != 1) or not set(origins) <= self._origins:
            return "This request comes from another page."
        if not self._knows_token(scope, headers):
            return "The token is missing or old: open the address that retouch app printed."
        return None

    def _knows_token(self, scope: Scope, headers: Headers) -> bool:
        shown = [self._token_of_query(scope)] if scope["type"] == "http" else []
        shown += _cookies(headers, self._cookie)
        # Compared as bytes: `compare_digest` takes ASCII texts only.
        return any(one and secrets.compare_digest(one.encode(), self._token.encode()) for one in shown)

    @staticmethod
    def _token_of_query(scope: Scope) -> str | None:
        if scope["path"] != "/" or scope["method"] not in SAFE_METHODS:
            return None
        return dict(_query(scope)).get("token")

    async def _enter(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Keep the token as a cookie, and lead to the address without it."""
        rest = urlencode([(key, value) for key, value in _query(scope) if key != "token"])
        cookie = f"{self._cookie}={self._token}; Path=/; HttpOnly; SameSite=Strict"
        headers = {"location": f"/?{rest}" if rest else "/", "set-cookie": cookie}
        await PlainTextResponse("", 303, headers | {"cache-control": "no-store"})(scope, receive, send)


def _query(scope: Scope) -> list[tuple[str, str]]:
    return parse_qsl(scope["query_string"].decode("latin-1"), errors="replace")


def _cookies(headers: Headers, name: str) -> list[str]:
    """Values of a cookie; those of other servers of this machine stand beside it, whatever they look like."""
    pairs = [part.partition("=") for header in headers.getlist("cookie") for part in header.split(";")]
    return [value.strip() for key, _, value in pairs if key.strip() == name]


def _with_headers(send: Send) -> Send:
    async def sending(message: MutableMapping[str, Any]) -> None:
        if message["type"] == "http.response.start":
            own = Headers(raw=list(message.get("headers", ())))
            added = [(name.encode(), text.encode()) for name, text in HEADERS.items() if name not in own]
            message = {**message, "headers": [*own.raw, *added]}
        await send(message)

    return sending
