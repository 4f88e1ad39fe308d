"""A command with little memory and little time."""

from __future__ import annotations

import resource
import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from .clean import DRIVE
from .hostile import ADDRESSES_BYTES, HOSTILE, PATIENCE_S, evidence


@dataclass(frozen=True)
class Walled:
    """Outcome of a command."""

    status: int
    """-1 if it exceeded the time limit."""
    error: str
    seconds: float
    """Seconds of processor time."""

    def wrong(self) -> str:
        """Describe the fault; empty if the command answered, or refused in one line."""
        if self.status == -1:
            return f"not done in {PATIENCE_S:g} s"
        if "Traceback" in self.error:
            return self.error.strip().splitlines()[-1][:200]
        if self.status not in (0, 2):
            return f"status {self.status}: {self.error.strip()[:200]}"
        if self.status == 2 and self.error.count("\n") != 1:
            return f"{self.error.count(chr(10))} lines on standard error"
        if len(self.error) > 1000:
            return f"a line of {len(self.error)} characters"
        return ""


CLOCKS = 12
"""Largest ratio of wall time to processor time on a busy machine."""


def _wall() -> None:
    seconds = int(PATIENCE_S)
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 1))
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESSES_BYTES, ADDRESSES_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def run_walled(words: list[str], folder: Path) -> Walled:
    """Run a command in a separate process with limited address space."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    try:
        done = subprocess.run(
            [sys.executable, "-m", "lostmotion", *words],
            capture_output=True,
            text=True,
            errors="replace",
            cwd=folder,
            preexec_fn=_wall,
            timeout=CLOCKS * PATIENCE_S,
            stdin=subprocess.DEVNULL,
            check=False,
        )
        status, error = done.returncode, done.stderr
        status = -1 if status == -signal.SIGXCPU else status
    except subprocess.TimeoutExpired:
        status, error = -1, ""
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Walled(status, error, seconds)


COMMANDS = ("check", "compare", "diagnose", "fit")


def against(name: str, command: str) -> Walled:
    """Run a command on a hostile file."""
    with tempfile.TemporaryDirectory() as folder:
        file = HOSTILE[name](Path(folder))
        words = [command, *([] if command == "check" else [str(DRIVE)]), str(file), "--quiet"]
        words += ["-o", "fitted.toml"] if command == "fit" else []
        return run_walled(words, Path(folder))


def against_evidence() -> Walled:
    """Merge evidence that states an inflated size of 4 GB."""
    with tempfile.TemporaryDirectory() as folder:
        return run_walled(["merge", str(evidence(Path(folder)))], Path(folder))


def hostile_table(words: Sequence[str], commands: Sequence[str] = COMMANDS) -> int:
    """Print the outcome of every hostile file; 1 if one is wrong."""
    wrong = 0
    for name in HOSTILE:
        if words and not any(word.lower() in name.lower() for word in words):
            continue
        for command in commands:
            outcome = against(name, command)
            wrong += _print(name, command, outcome)
    wrong += _print("evidence that inflates", "merge", against_evidence())
    print(f"{wrong} wrong")
    return 1 if wrong else 0


def _print(name: str, command: str, outcome: Walled) -> bool:
    bad = outcome.wrong()
    said = outcome.error.strip()[:150]
    print(
        f"{'WRONG' if bad else 'ok':5} {name:60} {command:8} status {outcome.status:2} "
        f"{outcome.seconds:5.1f} s  {bad or said}",
        flush=True,
    )
    return bool(bad)
