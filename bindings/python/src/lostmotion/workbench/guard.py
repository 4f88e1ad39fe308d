"""Access control: only the user's browser may access the workbench."""

from __future__ import annotations

import hmac
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any
from urllib.parse import parse_qs, urlsplit

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Message, Receive, Send], Awaitable[None]]

LOOPBACK = ("127.0.0.1", "localhost", "::1")
"""Names of this machine."""

REFUSED = b"403: open the address that lostmotion workbench printed, with its token\n"

TOKEN = "token"
"""Parameter of the opened address."""

HEADERS = (
    (b"content-security-policy", b"frame-ancestors 'none'"),
    (b"x-frame-options", b"DENY"),
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-resource-policy", b"same-origin"),
)
"""Headers of every response: no other page can frame it, and no link reveals its address."""


class Guard:
    """Refuses every request without the token of this run.

    The loopback address excludes other machines, but neither other users of this machine nor a
    foreign page in the user's browser. Therefore the opened address has a random token; the first
    answer sets it as a cookie, and every further request and the websocket must send it. Host and
    origin are also checked: a foreign page could reach the server under its own host name.

    Parameters
    ----------
    app
        Application that answers permitted requests.
    token : str
        The secret.
    cookie : str
        Name of the cookie. Browsers keep cookies by host, not by port: two workbenches at once
        need two names.
    """

    def __init__(self, app: App, token: str, cookie: str) -> None:
        self.app = app
        self.token = token
        self.cookie = cookie

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Pass a request on, or refuse it."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        headers = scope["headers"]
        local = is_local(headers)
        if local and is_opening(scope) and self.is_secret(token_of(scope)):
            cookie = f"{self.cookie}={self.token}; Path=/; HttpOnly; SameSite=Lax"
            added = with_headers(send, (b"set-cookie", cookie.encode()))
            await self.app({**scope, "query_string": b""}, receive, added)
        elif local and self.is_secret(cookie_of(headers, self.cookie)):
            await self.app(scope, receive, with_headers(send))
        elif scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008})
        else:
            await refuse(with_headers(send))

    def is_secret(self, given: str) -> bool:
        """Whether this is the token, in constant time."""
        return hmac.compare_digest(given.encode(), self.token.encode())


async def refuse(send: Send) -> None:
    """Answer that the token is missing."""
    headers = [
        (b"content-type", b"text/plain; charset=utf-8"),
        (b"content-length", str(len(REFUSED)).encode()),
        (b"cache-control", b"no-store"),
    ]
    await send({"type": "http.response.start", "status": 403, "headers": headers})
    await send({"type": "http.response.body", "body": REFUSED})


def with_headers(send: Send, *more: tuple[bytes, bytes]) -> Send:
    """Add `HEADERS` and more to an answer."""

    async def added(message: Message) -> None:
        if message["type"] == "http.response.start":
            message["headers"] = [*message.get("headers", ()), *HEADERS, *more]
        await send(message)

    return added


def values_of(headers: list[tuple[bytes, bytes]], name: bytes) -> list[str]:
    """Every value of a header."""
    return [value.decode("latin-1") for key, value in headers if key.lower() == name]


def cookie_of(headers: list[tuple[bytes, bytes]], name: str) -> str:
    """Value of a cookie, or nothing."""
    for line in values_of(headers, b"cookie"):
        for part in line.split(";"):
            key, _, value = part.strip().partition("=")
            if key == name:
                return value
    return ""


def is_opening(scope: Message) -> bool:
    """Whether a request requires the page itself."""
    return scope["type"] == "http" and scope["path"] == "/" and scope["method"] in ("GET", "HEAD")


def token_of(scope: Message) -> str:
    """Token in the address of a request, or nothing."""
    query = parse_qs(scope.get("query_string", b"").decode("latin-1"))
    return str(query.get(TOKEN, [""])[0])


def is_local(headers: list[tuple[bytes, bytes]]) -> bool:
    """Whether host and origin, where they are stated, are this machine."""
    hosts, origins = values_of(headers, b"host"), values_of(headers, b"origin")
    try:
        if len(hosts) != 1 or urlsplit(f"//{hosts[0]}").hostname not in LOOPBACK:
            return False
        return all(urlsplit(origin).netloc == hosts[0] for origin in origins)
    except ValueError:  # an invalid host such as "[::1"
        return False
