"""The server of the workbench: on the loopback address, for one person."""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Mapping, Sequence

from nicegui import app, ui
from starlette.responses import PlainTextResponse, Response

from lostmotion.discover.effects import Effect
from lostmotion.errors import InputError
from lostmotion.workbench.bench import Bench
from lostmotion.workbench.designs import Search
from lostmotion.workbench.guard import Guard
from lostmotion.workbench.page import Page
from lostmotion.workbench.work import Work

HOST = "127.0.0.1"

FIRST_PORT, PORTS = 8265, 20
"""Ports that are tried where none is stated."""

AWAY_S = 600.0
"""How long a browser that is busy or asleep may be silent before its page is forgotten; after that
it is drawn anew, and what was typed is lost."""


def free_port(wanted: int | None) -> int:
    """Give the port that is wanted, or the first that is free."""
    ports = [wanted] if wanted is not None else range(FIRST_PORT, FIRST_PORT + PORTS)
    for port in ports:
        with socket.socket() as probe, contextlib.suppress(OSError):
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((HOST, port))
            return int(probe.getsockname()[1])
    found = f"{wanted}, which is taken" if wanted is not None else "none that is free"
    raise InputError("--port", "", found, "a free port")


def serve(
    drive: str | None,
    data: Sequence[str],
    mapping: Sequence[str],
    *,
    effects: Mapping[str, Effect],
    port: int | None = None,
    show: bool = True,
    quiet: bool = False,
) -> None:
    """Show the workbench until it is interrupted.

    Parameters
    ----------
    drive, data, mapping
        What to load at once; what cannot be read is refused before the page opens.
    effects : mapping
        Effects that may be missing: those of the library, and the user's own.
    port : int, optional
        By default the first free one from `FIRST_PORT` on.
    show : bool
        Whether to open the browser.
    quiet : bool
        Whether to keep the address to oneself.

    Raises
    ------
    InputError
        The drive, the recordings or the port.
    """
    place = free_port(port)
    bench, work, search = Bench(effects=dict(effects)), Work(), Search()
    try:
        if drive is not None:
            bench.load_drive(drive)
        if data:
            bench.load_recordings(data, mapping, lambda done, steps: None)
        make_app(bench, work, search)
        if not quiet:
            print(f"workbench at http://{HOST}:{place}/ (end it with Ctrl-C)", flush=True)
        ui.run(
            host=HOST,
            port=place,
            title="lostmotion workbench",
            language="en-US",
            favicon="📐",
            show=show,
            reload=False,
            reconnect_timeout=AWAY_S,
            show_welcome_message=False,
            tailwind=False,
            access_log=False,
        )
    finally:
        search.close()
        work.close()
        bench.close()


def make_app(bench: Bench, work: Work, search: Search) -> None:
    """Lay out the page and the links to the numbers behind its pictures."""
    app.add_middleware(Guard)

    @ui.page("/")
    def page() -> None:
        Page(bench, work, search).build()

    @app.get("/numbers/{name}.csv")
    def numbers(name: str) -> Response:
        for page in (bench.comparison_page, bench.drive_page):
            if name in page.tables:
                return attachment(page.tables[name].csv(), f"{name}.csv", "text/csv")
        return PlainTextResponse("no such numbers\n", 404)

    @app.get("/picture/{name}.svg")
    def picture(name: str) -> Response:
        for page in (bench.comparison_page, bench.drive_page):
            if name in page.pictures:
                return attachment(page.pictures[name], f"{name}.svg", "image/svg+xml")
        return PlainTextResponse("no such picture\n", 404)


def attachment(content: str, name: str, kind: str) -> Response:
    """Answer with a file to be kept."""
    return Response(
        content, media_type=kind, headers={"Content-Disposition": f'attachment; filename="{name}"'}
    )
