"""Nobody but the user's own browser talks to the workbench."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any
from urllib.parse import urlsplit

Message = MutableMapping[str, Any]
App = Callable[
    [Message, Callable[[], Awaitable[Message]], Callable[[Message], Awaitable[None]]],
    Awaitable[None],
]

LOOPBACK = ("127.0.0.1", "localhost", "::1")
"""Names of this machine."""


class Guard:
    """Refuses requests that were not made for this machine, or that another page sends.

    Listening on the loopback address keeps other machines out, but not a foreign page in the user's
    own browser: it could open a socket to the workbench, or reach it under a name of its own.
    """

    def __init__(self, app: App) -> None:
        self.app = app

    async def __call__(
        self,
        scope: Message,
        receive: Callable[[], Awaitable[Message]],
        send: Callable[[Message], Awaitable[None]],
    ) -> None:
        """Pass a request on, or refuse it."""
        if scope["type"] not in ("http", "websocket") or own(dict(scope["headers"])):
            await self.app(scope, receive, send)
        elif scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008})
        else:
            await send({"type": "http.response.start", "status": 403, "headers": []})
            await send({"type": "http.response.body", "body": b"for this machine only\n"})


def own(headers: dict[bytes, bytes]) -> bool:
    """Whether host and origin, where they are stated, are this machine."""
    host = headers.get(b"host", b"").decode("latin-1")
    origin = headers.get(b"origin", b"").decode("latin-1")
    if urlsplit(f"//{host}").hostname not in LOOPBACK:
        return False
    return not origin or urlsplit(origin).netloc == host
