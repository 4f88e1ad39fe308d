"""The workbench as a process, and requests to it without a browser."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from http.cookiejar import CookieJar
from pathlib import Path

PATIENCE_S = 60.0
"""Time limit for the start or end of a server on a busy machine."""


def start(
    folder: Path, *words: str | Path, **environment: str
) -> tuple[subprocess.Popen[str], str]:
    """Start the workbench in a folder; the process, and the address that it prints.

    NiceGUI behaves differently if it detects a test, so this is hidden from it.
    """
    inherited = {k: v for k, v in os.environ.items() if k != "PYTEST_CURRENT_TEST"}
    server = subprocess.Popen(
        [sys.executable, "-m", "lostmotion", "workbench", *map(str, words), "--port", "0"],
        cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        env={**inherited, **environment},
        # Tests under nohup pass on an ignored SIGHUP, and the server keeps it ignored.
        preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_DFL),
    )  # fmt: skip
    assert server.stdout is not None
    said = server.stdout.readline()
    found = re.search(r"http://127\.0\.0\.1:\d+/\S*", said)
    if found is None:
        server.kill()
        raise AssertionError(said + server.stdout.read())
    opener(found[0])
    return server, found[0]


@contextlib.contextmanager
def serving(folder: Path, *words: str | Path) -> Iterator[str]:
    """Run the workbench in a folder; its address. It must end when it is interrupted."""
    server, address = start(folder, *words, "--no-browser")
    try:
        yield address
        server.send_signal(signal.SIGINT)
        rest, _ = server.communicate(timeout=PATIENCE_S)
        assert "Traceback" not in rest, rest
    finally:
        server.kill()
        server.wait()


def opener(address: str) -> urllib.request.OpenerDirector:
    """Open an address like its user, once the server listens; returns an opener with the cookie."""
    own = urllib.request.build_opener(urllib.request.HTTPCookieProcessor(CookieJar()))
    for _ in range(100):
        try:
            own.open(address, timeout=10).close()
        except urllib.error.HTTPError as error:
            raise AssertionError(f"the page answers {error.code}") from None
        except urllib.error.URLError:
            time.sleep(0.1)
        else:
            return own
    raise AssertionError("the page does not answer")


def answer(address: str, own: urllib.request.OpenerDirector | None = None, **headers: str) -> int:
    """Status of a request, with the cookie of `own` or without one."""
    request = urllib.request.Request(address, headers=headers)
    ask = own or urllib.request.build_opener()
    try:
        with ask.open(request, timeout=30) as reply:
            return int(reply.status)
    except urllib.error.HTTPError as error:
        return error.code
