"""Access to the workbench: permitted requests, disclosed data, and files left behind."""

from __future__ import annotations

import asyncio
import http.client
import http.server
import os
import random
import signal
import socket
import stat
import subprocess
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from chromium import needs_driver
from hypothesis import given
from hypothesis import strategies as st
from nicegui.version import __version__ as nicegui_version
from test_workbench import View, view
from workbench_server import PATIENCE_S, answer, opener, serving, start

from lostmotion.errors import InputError
from lostmotion.workbench.designs import Search
from lostmotion.workbench.disclosure import public_message
from lostmotion.workbench.guard import Guard
from lostmotion.workbench.page import plain_name

__all__ = ["view"]

DRIVE = (Path(__file__).parents[1] / "data" / "drives" / "reference_a.toml").read_text()

ROUTES = (
    "",
    "?token=",
    "?token=guessed",
    "numbers/none.csv",
    "picture/none.svg",
    f"_nicegui/{nicegui_version}/static/nicegui.js",
    f"_nicegui/{nicegui_version}/libraries/none.js",
    f"_nicegui/{nicegui_version}/components/upload.js",
    "_nicegui/client/none/upload/1",
    "_nicegui_ws/socket.io/?EIO=4&transport=polling",
    "docs",
    "openapi.json",
    "favicon.ico",
    "nothing/of/the/kind",
)

HANDSHAKE = (
    "GET /_nicegui_ws/socket.io/?EIO=4&transport=websocket HTTP/1.1\r\nHost: {host}\r\n"
    "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
    "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n{more}\r\n"
)


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with serving(tmp_path_factory.mktemp("bench")) as found:
        yield found


def parts(address: str) -> tuple[str, int, str, str]:
    """Host, port, token and cookie."""
    host, _, query = address.removeprefix("http://").partition("/")
    port, token = int(host.partition(":")[2]), query.partition("token=")[2]
    assert len(token) >= 32
    return host, port, token, f"lostmotion_{port}={token}"


def raw(port: int, request: str) -> str:
    """First line of the server's response to some bytes."""
    with socket.create_connection(("127.0.0.1", port), timeout=30) as line:
        line.sendall(request.encode("latin-1"))
        return line.recv(4096).decode("latin-1").partition("\r\n")[0]


@pytest.mark.parametrize("route", ROUTES)
@pytest.mark.parametrize("method", ["GET", "POST", "PUT", "HEAD"])
def test_without_the_token_every_route_is_refused(address: str, route: str, method: str) -> None:
    host, port, token, _ = parts(address)
    for headers in ({}, {"Cookie": f"lostmotion_{port}=guessed; other=1"}, {"Origin": "null"}):
        line = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
        line.request(method, "/" + route, headers=headers)
        reply = line.getresponse()
        said = reply.read()
        assert reply.status == 403
        assert token.encode() not in said
        assert reply.headers["Content-Security-Policy"] == "frame-ancestors 'none'"
        line.close()
    assert raw(port, f"GET /{route} HTTP/1.1\r\nHost: {host}\r\n\r\n").split()[1] == "403"


def test_the_websocket_requires_the_cookie_and_its_own_origin(address: str) -> None:
    host, port, _, cookie = parts(address)

    def shake(*more: str, at: str = host) -> str:
        lines = "".join(f"{line}\r\n" for line in more)
        return raw(port, HANDSHAKE.format(host=at, more=lines)).split()[1]

    own = f"Cookie: {cookie}"
    assert shake(own, f"Origin: http://{host}") == "101"
    assert shake(f"Origin: http://{host}") == "403"
    assert shake(own, "Origin: http://127.0.0.1:1") == "403"
    assert shake(own, "Origin: null") == "403"
    assert shake(own, at="evil.example") == "403"


@pytest.mark.parametrize("host", ["[::1", "[", "evil.example", "127.0.0.1.evil.example", "", "]["])
def test_a_host_that_is_not_this_machine_is_refused(address: str, host: str) -> None:
    _, port, token, cookie = parts(address)
    for path, more in (("/", f"Cookie: {cookie}\r\n"), (f"/?token={token}", "")):
        got = raw(port, f"GET {path} HTTP/1.1\r\nHost: {host}\r\n{more}\r\n")
        assert got.split()[1] in ("403", "400"), got


def test_the_token_becomes_a_cookie_that_scripts_cannot_read_and_leaves_the_address(
    address: str,
) -> None:
    host, port, token, cookie = parts(address)
    line = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
    line.request("GET", f"/?token={token}")
    reply = line.getresponse()
    assert reply.status == 200
    assert token not in reply.read().decode()
    assert reply.headers["Set-Cookie"] == f"{cookie}; Path=/; HttpOnly; SameSite=Lax"
    line.close()
    own = opener(address)
    assert answer(f"http://{host}/", own) == 200
    with own.open(f"http://{host}/") as page:
        assert page.headers["Content-Security-Policy"] == "frame-ancestors 'none'"
        assert page.headers["X-Frame-Options"] == "DENY"


ASK = """
import sys, urllib.error, urllib.request
for route in sys.argv[2:]:
    try:
        print(urllib.request.urlopen(sys.argv[1] + route, timeout=30).status)
    except urllib.error.HTTPError as error:
        print(error.code)
"""


@pytest.mark.skipif(
    os.name != "posix" or os.geteuid() != 0,
    reason="asks as a second user: run the tests as root on a POSIX system",
)
def test_another_user_of_the_machine_gets_nothing(tmp_path: Path) -> None:
    opened = tmp_path / "opened"
    browser = tmp_path / "browser.sh"
    browser.write_text(f'#!/bin/sh\nprintf "%s\\n" "$@" >{opened}\n')
    browser.chmod(0o755)
    temporary = tmp_path / "tmp"
    temporary.mkdir()
    server, address = start(tmp_path, BROWSER=f"{browser} %s", TMPDIR=str(temporary), DISPLAY="")
    try:
        host, _, token, _ = parts(address)
        asked = subprocess.run(
            ["/usr/bin/env", "python3", "-c", ASK, f"http://{host}/", *ROUTES],
            capture_output=True, text=True, check=True, user=65534, group=65534,
            extra_groups=[], cwd="/",
        )  # fmt: skip
        assert asked.stdout.split() == ["403"] * len(ROUTES)
        for _ in range(100):
            if opened.is_file() and opened.read_text():
                break
            time.sleep(0.1)
        # Command lines that a second user sees, and the file that the browser opens.
        assert token not in opened.read_text()
        leads = Path(opened.read_text().strip().removeprefix("file://"))
        assert token in leads.read_text()
        assert stat.S_IMODE(leads.parent.stat().st_mode) == 0o700
        assert stat.S_IMODE(leads.stat().st_mode) == 0o600
        words = Path(f"/proc/{server.pid}/cmdline").read_bytes()
        assert token.encode() not in words
        environment = subprocess.run(
            ["cat", f"/proc/{server.pid}/environ"],
            capture_output=True, check=False, user=65534, group=65534, extra_groups=[],
        )  # fmt: skip
        assert token.encode() not in environment.stdout
    finally:
        server.send_signal(signal.SIGINT)
        server.communicate(timeout=PATIENCE_S)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
def test_what_was_dropped_is_gone_when_the_server_ends(tmp_path: Path, number: int) -> None:
    temporary = tmp_path / "tmp"
    temporary.mkdir()
    server, _ = start(tmp_path, "--no-browser", TMPDIR=str(temporary))
    made = list(temporary.glob("lostmotion-*"))
    assert len(made) == 1
    (made[0] / "dropped.csv").write_text("x")
    server.send_signal(number)
    rest, _ = server.communicate(timeout=PATIENCE_S)
    assert "Traceback" not in rest
    assert list(temporary.glob("lostmotion-*")) == []


def frame(payload: bytes, opcode: int) -> bytes:
    """A websocket frame of a client: masked by zeros, which do not change it."""
    size = len(payload)
    if size < 126:
        head = bytes([0x80 | opcode, 0x80 | size])
    else:
        head = bytes([0x80 | opcode, 0x80 | 126]) + size.to_bytes(2, "big")
    return head + bytes(4) + payload


PIECES = (
    *(
        "0",
        "2",
        "3",
        "40",
        "41",
        "42",
        "43",
        "44",
        "450-",
        "451-",
        "421",
        "4",
        "6",
        "-1",
        "99999999",
    ),
    *('["event",{}]', '["handshake",{"client_id":"x"}]', '["ack",{"next_message_id":-1}]'),
    *(
        '["log_html",null]',
        "[[[",
        '["javascript_response",{"request_id":1,"result":{}}]',
        "{}",
        '""',
    ),
    *("/", ",", '{"_placeholder":true,"num":0}', "NaN", '"' + "x" * 5000, "\\u0000", "[" * 500),
)
"""Parts of valid and of invalid messages of the page."""


def test_messages_that_are_none_leave_the_server_alive(tmp_path: Path) -> None:
    server, address = start(tmp_path, "--no-browser")
    # The library logs each of them: the output must be read.
    threading.Thread(target=lambda: [None for _ in server.stdout or ()], daemon=True).start()
    try:
        send_anything(address)
        assert answer(f"{address.partition('?')[0]}", opener(address)) == 200
    finally:
        server.send_signal(signal.SIGINT)
        server.wait(timeout=PATIENCE_S)


def send_anything(address: str) -> None:
    """Send many messages, most of which are invalid."""
    host, port, _, cookie = parts(address)
    own = f"Cookie: {cookie}\r\nOrigin: http://{host}\r\n"
    for number in range(60):
        dice = random.Random(number)
        with socket.create_connection(("127.0.0.1", port), timeout=30) as line:
            line.sendall(HANDSHAKE.format(host=host, more=own).encode())
            assert b"101" in line.recv(4096).partition(b"\r\n")[0]
            for _ in range(8):
                text = "".join(dice.choices(PIECES, k=dice.randrange(1, 5))).encode()
                payload = text if dice.random() < 0.8 else dice.randbytes(dice.randrange(200))
                try:
                    line.sendall(frame(payload[:60_000], dice.choice([1, 1, 1, 2, 9, 0])))
                except OSError:  # closed by the server, which is permitted
                    break


@given(
    host=st.one_of(
        st.sampled_from(["127.0.0.1:1", "localhost", "[::1]:1"]), st.binary(max_size=40)
    ),
    cookie=st.binary(max_size=80),
    query=st.binary(max_size=80),
    origin=st.one_of(st.none(), st.binary(max_size=40)),
    path=st.sampled_from(["/", "/numbers/x.csv", "/_nicegui_ws/socket.io/"]),
    kind=st.sampled_from(["http", "websocket"]),
)
def test_no_request_passes_without_the_secret(
    host: str | bytes, cookie: bytes, query: bytes, origin: bytes | None, path: str, kind: str
) -> None:
    passed, sent = [], []

    async def app(*_: object) -> None:
        passed.append(1)

    async def send(message: Any) -> None:
        sent.append(message)

    async def receive() -> Any:
        return {}

    headers = [(b"host", host.encode() if isinstance(host, str) else host), (b"cookie", cookie)]
    headers += [] if origin is None else [(b"origin", origin)]
    scope = {"type": kind, "path": path, "method": "GET", "headers": headers, "query_string": query}
    asyncio.run(Guard(app, "a secret token", "lostmotion_1")(scope, receive, send))
    assert not passed
    assert sent[0].get("status", 403) == 403


# --- in a browser ---------------------------------------------------------------------------------


class Foreign(http.server.BaseHTTPRequestHandler):
    """A foreign page: it frames the workbench and opens a socket to it."""

    target = ""

    def do_GET(self) -> None:
        page = f"""<!doctype html><title>foreign</title><iframe id=f src="http://{self.target}/">
        </iframe><script>
        window.said = "";
        const s = new WebSocket("ws://{self.target}/_nicegui_ws/socket.io/?EIO=4&transport=websocket");
        s.onopen = () => window.said += "open ";
        s.onmessage = (m) => window.said += m.data;
        s.onclose = () => window.said += "closed";
        fetch("http://{self.target}/", {{credentials: "include"}}).then(
          () => window.read = "read", () => window.read = "not read");
        </script>"""
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        self.wfile.write(page.encode())

    def log_message(self, *_: Any) -> None:
        """Keep quiet."""


@needs_driver
def test_a_foreign_page_in_the_own_browser_gets_nothing(view: View, address: str) -> None:
    host, _, _, _ = parts(address)
    view.driver.get(address)
    view.wait(lambda: "Load the example" in view.text("body"), "the page")
    assert "token" not in view.driver.current_url
    handler = type("Foreign", (Foreign,), {"target": host})
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        view.driver.get(f"http://127.0.0.1:{server.server_port}/")
        said = view.wait(lambda: view.driver.execute_script("return window.said"), "the socket")
        assert said == "closed"
        read = view.wait(lambda: view.driver.execute_script("return window.read"), "the request")
        assert read == "not read"
        view.driver.switch_to.frame("f")
        assert "Load the example" not in view.driver.page_source
        view.driver.switch_to.default_content()
    finally:
        server.shutdown()
        view.driver.get_log("browser")  # its errors are the subject of this test


@needs_driver
def test_a_pipe_and_a_secret_as_drive_file_are_refused_and_the_server_ends(
    view: View, tmp_path: Path
) -> None:
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "secret.ini").write_text('[default]\naws_key = "HUSH"\n')
    (tmp_path / "drive.toml").write_text(DRIVE)
    with serving(tmp_path) as address:  # and ends when interrupted
        view.driver.get(address)
        view.type("drive file", "pipe.toml")
        view.press("Load")
        view.wait(lambda: "pipe.toml: found a pipe or a device" in view.text(".message"), "a word")
        view.type("drive file", "secret.ini")
        view.press("Load")
        view.wait(lambda: "secret.ini: found a file of another kind" in view.text(".message"), "it")
        view.type("drive file", "drive.toml")
        view.press("Load")
        view.wait(lambda: view.text(".top .what"), "the drive")
        view.idle()
        assert view.text(".message") == ""
        # A new file does not show the message of an old one.
        view.turn_to("Design")
        view.type("spec, a file", "secret.ini")
        view.press("Start")
        view.wait(lambda: "another kind" in view.text("#panel-design .message"), "the message")
        assert "default" not in view.text("#panel-design .message")
        spec = tmp_path / "joint.toml"
        spec.write_text('[search]\nobjectives = ["lost_motion"]\n')
        view.all("input[type=file]")[0].send_keys(str(spec))
        view.wait(lambda: view.text("#panel-design .message") == "", "the message to go")


# --- parts of it ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        ("joint.toml", "joint.toml"),
        ("..", "recording.csv"),
        ("../../.bashrc", "bashrc"),
        ("..\\..\\evil.csv", "evil.csv"),
        ("a/b/run 2.csv.gz", "run 2.csv.gz"),
        (".csv", "csv"),
        ("a\x00b\n.csv", "ab.csv"),
        ("", "recording.csv"),
    ],
)
def test_a_dropped_file_gets_a_name_of_its_own_folder(given: str, kept: str) -> None:
    assert plain_name(given) == kept


def test_a_long_name_is_cut_and_keeps_its_suffix(tmp_path: Path) -> None:
    for name in ("x" * 300 + ".toml", "ä" * 300 + ".csv.gz", "🚀" * 300 + ".parquet"):
        made = plain_name(name)
        (tmp_path / made).write_text("x")
        assert Path(made).suffixes == Path(name).suffixes
    assert plain_name("a.csv", {"a.csv", "a_2.csv"}) == "a_3.csv"


SECRETS = {
    "shadow": "root:HUSH:19000:0\n",
    "key": "-----BEGIN KEY-----\nHUSH\n",
    "aws.toml": '[HUSH]\nkey = "HUSH"\n',
    "env.toml": 'HUSH = "HUSH"\n',
    "people.csv": "name,HUSH\nx,HUSH\n",
    "twins.csv": "HUSH,HUSH\nx,y\n",
}


@pytest.mark.parametrize("name", SECRETS)
def test_messages_do_not_quote_a_file_of_another_kind(tmp_path: Path, name: str) -> None:
    from lostmotion.drives import read_drive
    from lostmotion.recordings import read_campaign

    file = tmp_path / name
    file.write_text(SECRETS[name])
    for read in (read_drive, lambda path: read_campaign([path], ratio=100.0)):
        with pytest.raises(InputError) as error:
            read(file)
        said = public_message(error.value)
        assert said.startswith(f"{file}: found a file of another kind")
        assert "HUSH" not in said


def test_messages_quote_what_is_wrong_with_a_drive_and_a_recording(tmp_path: Path) -> None:
    from lostmotion.drives import read_drive
    from lostmotion.recordings import read_campaign

    drive, data, foreign = (tmp_path / n for n in ("d.toml", "d.csv", "foreign.csv"))
    drive.write_text("[drive]\nrotio = 100\n")
    data.write_text("time_s,torque_furlong\n0,1\n")
    foreign.write_text("TIME;POSITION\n0.1;2\n")
    for file, read, quoted in (
        (drive, read_drive, "rotio"),
        (data, lambda path: read_campaign([path]), "torque_furlong"),
        (foreign, lambda path: read_campaign([path]), "POSITION"),
    ):
        with pytest.raises(InputError) as error:
            read(file)
        assert quoted in public_message(error.value)


def test_a_search_writes_into_the_stated_folders_only(tmp_path: Path) -> None:
    inside, outside = tmp_path / "in", tmp_path / "out"
    inside.mkdir()
    outside.mkdir()
    (inside / "link").symlink_to(outside)
    spec = inside / "spec.toml"
    spec.write_text('[search]\nobjectives = ["lost_motion"]\n')
    for folder in (outside / "run", inside / ".." / "out" / "run", inside / "link" / "run"):
        search = Search([inside])
        search.spec, search.folder = str(spec), str(folder)
        search.run(resume=False)
        assert f"{folder}: found a folder elsewhere" in search.message
        search.close()
    assert list(outside.iterdir()) == []
