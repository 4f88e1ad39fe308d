"""The package uses no function of a single operating system, and no text depends on the locale."""

from __future__ import annotations

import ast
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

import lostmotion
from lostmotion import files

PACKAGE = Path(lostmotion.__file__).parent
POSIX_MODULES = {"fcntl", "grp", "pty", "pwd", "resource", "syslog", "termios", "tty"}
POSIX_NAMES = {
    "os": {
        "fork", "forkpty", "getuid", "geteuid", "getgid", "killpg", "mkfifo", "setsid",
        "sysconf", "uname", "wait", "chown", "fchmod", "sched_getaffinity",
    },
    "signal": {
        "SIGHUP", "SIGKILL", "SIGUSR1", "SIGUSR2", "SIGPIPE", "SIGALRM", "SIGCHLD", "SIGXFSZ",
        "alarm", "pause", "setitimer", "sigwait",
    },
    "time": {"tzset"},
}  # fmt: skip


def asked_for(tree: ast.AST) -> set[str]:
    """Names that a function requires by ``hasattr`` or ``getattr`` before it uses them."""
    return {
        call.args[1].value
        for call in ast.walk(tree)
        if isinstance(call, ast.Call)
        and isinstance(call.func, ast.Name)
        and call.func.id in ("hasattr", "getattr")
        and len(call.args) > 1
        and isinstance(call.args[1], ast.Constant)
    }


def tried(tree: ast.AST) -> set[ast.AST]:
    """Names used where a missing one is handled (``except AttributeError``)."""
    return {
        inner
        for node in ast.walk(tree)
        if isinstance(node, ast.Try)
        and any(getattr(h.type, "id", "") == "AttributeError" for h in node.handlers)
        for inner in ast.walk(node)
    }


def opens_text_by_locale(call: ast.Call) -> bool:
    words = {word.arg for word in call.keywords}
    if "encoding" in words:
        return False
    if isinstance(call.func, ast.Attribute):
        if call.func.attr in ("read_text", "write_text"):
            return True
        if isinstance(call.func.value, ast.Name) and call.func.value.id in ("os", "webbrowser"):
            return False
        name, modes = call.func.attr, call.args[:1]
    else:
        name, modes = getattr(call.func, "id", ""), call.args[1:2]
    modes += [word.value for word in call.keywords if word.arg == "mode"]
    said = [m.value for m in modes if isinstance(m, ast.Constant) and isinstance(m.value, str)]
    is_builtin = isinstance(call.func, ast.Name)
    return name == "open" and (
        "newline" in words
        or any(set(m) <= set("rwax+t") for m in said)
        or (is_builtin and not modes)
    )


def found_in(source: str) -> Iterator[str]:
    tree = ast.parse(source)
    functions = [n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef)]
    answered = tried(tree)
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            names = [a.name for a in node.names]
            if isinstance(node, ast.ImportFrom):
                names = [node.module or ""]
            yield from (f"{node.lineno}: {name}" for name in names if name in POSIX_MODULES)
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            if node.attr in POSIX_NAMES.get(node.value.id, ()):
                around = [f for f in functions if node in list(ast.walk(f))]
                if node not in answered and not any(node.attr in asked_for(f) for f in around):
                    yield f"{node.lineno}: {node.value.id}.{node.attr}"
        elif isinstance(node, ast.Call) and opens_text_by_locale(node):
            yield f"{node.lineno}: text in the encoding of the locale"


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ("import fcntl", 1),
        ("import os\nos.fork()", 1),
        ("import signal\ndef f():\n    signal.SIGHUP", 1),
        ("import signal\ndef f():\n    if hasattr(signal, 'SIGHUP'):\n        signal.SIGHUP", 0),
        ("path.read_text()", 1),
        ("path.read_text(encoding='utf-8')", 0),
        ("open(path)", 1),
        ("open(path, 'rb')", 0),
        ("open(path, 'w')", 1),
        ("path.open('w')", 1),
        ("path.open('rb')", 0),
        ("path.open(newline='')", 1),
    ],
)
def test_what_only_one_system_has_is_seen(source: str, found: int) -> None:
    assert len(list(found_in(source))) == found


def test_the_package_calls_nothing_that_only_one_system_has() -> None:
    found = [
        f"{file.relative_to(PACKAGE)}:{what}"
        for file in sorted(PACKAGE.rglob("*.py"))
        for what in found_in(file.read_text(encoding="utf-8"))
    ]
    assert found == []


def test_only_one_place_renames_a_file() -> None:
    having = [
        file.relative_to(PACKAGE).as_posix()
        for file in sorted(PACKAGE.rglob("*.py"))
        if "os.replace(" in file.read_text(encoding="utf-8")
    ]
    assert having == ["files.py"]


def test_a_file_that_windows_locks_for_a_moment_is_tried_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    beside, place = tmp_path / "beside", tmp_path / "place"
    beside.write_text("new", encoding="utf-8")
    really, refused = os.replace, [PermissionError(13, "held")] * 2

    def held(source: Path, target: Path) -> None:
        if refused:
            raise refused.pop()
        really(source, target)

    monkeypatch.setattr(files.os, "replace", held)
    monkeypatch.setattr(files, "REPLACE_WAIT_S", 0)
    monkeypatch.setattr(files.os, "name", "nt")
    files.replace(beside, place)
    monkeypatch.setattr(files.os, "name", "posix")
    assert place.read_text(encoding="utf-8") == "new"
