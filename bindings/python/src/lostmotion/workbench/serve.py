"""The server of the workbench, on the loopback address and protected by a token."""

from __future__ import annotations

import contextlib
import secrets
import signal
import socket
import threading
import time
import webbrowser
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from nicegui import app, ui
from starlette.responses import PlainTextResponse, Response

from lostmotion.effects.effect import Effect
from lostmotion.errors import InputError, LostMotionError, one_line
from lostmotion.recordings import parse_map
from lostmotion.recordings.joining import Join
from lostmotion.report.effect_pictures import draw_effect
from lostmotion.report.figure_data import numbers_csv
from lostmotion.terminal import ending_in_order
from lostmotion.workbench.bench import Bench
from lostmotion.workbench.designs import Search
from lostmotion.workbench.guard import TOKEN, Guard
from lostmotion.workbench.page import Page
from lostmotion.workbench.work import Work

HOST = "127.0.0.1"

FIRST_PORT, PORTS = 8265, 20
"""Ports that are tried if none is stated."""

TOKEN_BYTES = 32
"""Random bytes of the token, as the documentation of `secrets` advises."""

LISTEN_TRIES = 100
"""Number of checks, a tenth of a second apart, whether the server responds before the browser
opens."""

AWAY_S = 600.0
"""Time for which a busy or sleeping browser may be silent before its page is discarded. The page is
then drawn again, and typed text is lost."""


def free_port(wanted: int | None) -> int:
    """Return the requested port, or the first free one."""
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
    join: Join | None = None,
    port: int | None = None,
    show: bool = True,
    quiet: bool = False,
    roots: Sequence[str | Path] = (),
) -> None:
    """Show the workbench until it is interrupted.

    Parameters
    ----------
    drive, data, mapping
        Data to load at once; unreadable files are refused before the page opens.
    effects : mapping
        Effects that may be missing: those of the library, and the user's own.
    join : {"nearest", "linear"}, optional
        Resampling of columns of a ROS 2 bag with different stamps.
    port : int, optional
        By default the first free one from `FIRST_PORT` on.
    show : bool
        Whether to open the browser.
    quiet : bool
        Whether to suppress the address; without a browser it is always printed.
    roots : sequence of path
        Folders that a design search may write to; by default the current one.

    Raises
    ------
    InputError
        If the drive, the recordings or the port cannot be used.
    """
    place = free_port(port)
    token = secrets.token_urlsafe(TOKEN_BYTES)
    address = f"http://{HOST}:{place}/?{TOKEN}={token}"
    with ending_in_order(), contextlib.ExitStack() as stack:
        stack.enter_context(hangup_as_termination())
        bench = Bench(effects=dict(effects), join=join)
        work, search = Work(), Search(roots or (".",))
        for close in (bench.close, work.close, search.close):
            stack.callback(close)
        if drive is not None:
            bench.load_drive(drive)
        if data:
            bench.load_recordings(data, parse_map(mapping), lambda *_: None)
        make_app(bench, work, search)
        app.add_middleware(Guard, token=token, cookie=f"lostmotion_{place}")
        if not quiet or not show:
            print(f"workbench at {address} (end it with Ctrl-C)", flush=True)
        if show:
            app.on_startup(lambda: open_browser(address, place, bench.folder))
        ui.run(
            host=HOST,
            port=place,
            title="lostmotion workbench",
            language="en-US",
            favicon="📐",
            show=False,
            reload=False,
            reconnect_timeout=AWAY_S,
            show_welcome_message=False,
            tailwind=False,
            access_log=False,
        )


@contextlib.contextmanager
def hangup_as_termination() -> Iterator[None]:
    """Make SIGHUP end the server like SIGTERM, which the server handles."""
    if not hasattr(signal, "SIGHUP") or signal.getsignal(signal.SIGHUP) == signal.SIG_IGN:
        yield
        return
    before = signal.signal(signal.SIGHUP, lambda *_: signal.raise_signal(signal.SIGTERM))
    try:
        yield
    finally:
        signal.signal(signal.SIGHUP, before)


def open_browser(address: str, port: int, folder: Path) -> None:
    """Open the page once the server listens.

    Through a file that only the user can read, because other users see command lines and the
    address contains the token.
    """
    leads = folder / "workbench.html"
    leads.write_text(
        f'<!doctype html><meta charset="utf-8"><title>lostmotion workbench</title>'
        f'<meta http-equiv="refresh" content="0;url={address}"><a href="{address}">workbench</a>\n',
        encoding="utf-8",
    )
    leads.chmod(0o600)

    def wait() -> None:
        for _ in range(LISTEN_TRIES):
            with contextlib.suppress(OSError), socket.create_connection((HOST, port), 1.0):
                webbrowser.open(leads.as_uri())
                return
            time.sleep(0.1)

    threading.Thread(target=wait, daemon=True).start()


def make_app(bench: Bench, work: Work, search: Search) -> None:
    """Register the page and the links to data and figures."""

    @ui.page("/")
    def page() -> None:
        Page(bench, work, search).build()

    @app.get("/numbers/{name}.csv")
    def numbers(name: str) -> Response:
        for page in (bench.comparison_page, bench.drive_page):
            if name in page.tables:
                return attachment(numbers_csv(page.tables[name]), f"{name}.csv", "text/csv")
        return PlainTextResponse("no such numbers\n", 404)

    @app.get("/picture/{name}.svg")
    def picture(name: str) -> Response:
        for page in (bench.comparison_page, bench.drive_page):
            if name in page.pictures:
                return attachment(page.pictures[name], f"{name}.svg", "image/svg+xml")
        return PlainTextResponse("no such picture\n", 404)

    drawn: dict[str, str] = {}

    @app.get("/effect/{name}.svg")
    def effect_picture(name: str) -> Response:
        if name not in drawn:
            if name not in bench.effects:
                return PlainTextResponse("no such effect\n", 404)
            try:
                drawn[name] = draw_effect(bench.effects[name])
            except LostMotionError as error:  # the user's own code may refuse the typical values
                return PlainTextResponse(f"{one_line(str(error))}\n", 404)
        return Response(drawn[name], media_type="image/svg+xml")


def attachment(content: str, name: str, kind: str) -> Response:
    """Respond with a file to download."""
    return Response(
        content, media_type=kind, headers={"Content-Disposition": f'attachment; filename="{name}"'}
    )
