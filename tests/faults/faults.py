"""Commands under failures: killed, disk full, folder not writable, signals, two at once.

After every fault an output is the complete old file or the complete new one, and a command that was
not killed prints one line. Prints the number of faults of each kind.
"""

from __future__ import annotations

import argparse
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "fuzz"))
from sound_files import csv_text, made, recording, sound_drive, spec

from lostmotion.drives import format_toml

OLD = b"what was there before\n"

PATIENCE_S = 600.0
"""For one command on a machine that does other things too."""

WITHOUT_RIGHTS = """
import ctypes, sys
if sys.platform == "linux":  # also as root the mode of a folder counts, with no capability left
    header, data = (ctypes.c_uint32 * 2)(0x20080522, 0), (ctypes.c_uint32 * 6)()
    assert ctypes.CDLL(None).capset(header, data) == 0
from lostmotion.cli import main
sys.exit(main(sys.argv[1:]))
"""
"""Runs a command without the rights of root."""


@dataclass
class Command:
    """A command, and the files that it leaves.

    Attributes
    ----------
    words : list of str
        The command line, relative to its folder.
    outputs : list of str
        Files that appear whole or stay as they were.
    new_folder : str
        Folder that the command begins; nothing is there before.
    again : list of str
        Command that continues after a kill, to the same files; empty: the same command again.
    """

    words: list[str]
    outputs: list[str]
    new_folder: str = ""
    again: list[str] = field(default_factory=list)


COMMANDS = {
    "fit": Command(
        [
            "fit",
            "d.toml",
            "d.csv",
            "--add",
            "thermal_drift",
            "-o",
            "fitted.toml",
            "--json",
            "a.json",
        ],
        ["fitted.toml", "a.json"],
    ),
    "diagnose": Command(
        ["diagnose", "d.toml", "d.csv", "--save-evidence", "one.npz", "--json", "a.json"],
        ["one.npz", "a.json"],
    ),
    "merge": Command(["merge", "evidence.npz", "--json", "a.json"], ["a.json"]),
    "export": Command(["export", "d.toml", "-o", "params.h", "--json", "a.json"], ["params.h"]),
    "design": Command(
        ["design", "s.toml", "-o", "run"],
        ["run/best.toml", "run/front.csv", "run/history.csv", "run/combinations.csv"],
        "run",
        ["design", "s.toml", "-o", "run", "--resume"],
    ),
    "demo": Command(["demo", "-o", "out"], ["out/fitted.toml", "out/params.h"], "out"),
}


def prepare(folder: Path, command: Command, old: bool = True) -> None:
    """Put the inputs into a folder, and an old file in the place of every output."""
    folder.mkdir(parents=True)
    (folder / "d.toml").write_text(sound_drive("bought"))
    (folder / "d.csv").write_text(csv_text(recording()))
    (folder / "s.toml").write_text(format_toml(spec()))
    if command.words[0] == "merge":
        (folder / "evidence.npz").write_bytes(made("evidence")["one.npz"])
    if old and not command.new_folder:
        for name in command.outputs:
            (folder / name).write_bytes(OLD)


def begin(folder: Path, words: list[str], **options: object) -> subprocess.Popen[str]:
    """Start a command in a folder."""
    return subprocess.Popen(
        [sys.executable, "-m", "lostmotion", *words, "--quiet"],
        cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options,
    )  # type: ignore[call-overload, no-any-return]  # fmt: skip


def run(folder: Path, words: list[str], **options: object) -> tuple[int, str]:
    """Run a command; its status and what it said."""
    process = begin(folder, words, **options)
    out, error = process.communicate(timeout=PATIENCE_S)
    return process.returncode, out + error


def contents(folder: Path, command: Command) -> dict[str, bytes | None]:
    """Bytes of every output, None where there is none."""
    files = {name: folder / name for name in command.outputs}
    return {name: file.read_bytes() if file.is_file() else None for name, file in files.items()}


class World:
    """A folder for one case after another, and what a command leaves when nothing fails."""

    def __init__(self, name: str, root: Path) -> None:
        self.command = COMMANDS[name]
        self.root = root
        self.count = 0
        first = self.case(old=False)
        start = time.monotonic()
        status, said = run(first, self.command.words)
        self.seconds = time.monotonic() - start
        assert status == 0, said
        self.whole = contents(first, self.command)
        self.inputs = {n: (first / n).read_bytes() for n in ("d.toml", "d.csv", "s.toml")}
        assert None not in self.whole.values()

    def case(self, *, old: bool = True) -> Path:
        """Make a folder with the inputs."""
        self.count += 1
        folder = self.root / f"{self.command.words[0]}{self.count}"
        prepare(folder, self.command, old)
        return folder

    def wrong(self, folder: Path) -> str:
        """Describe what is neither old nor new; nothing when all is well."""
        for name, found in contents(folder, self.command).items():
            allowed = (
                (None, self.whole[name]) if self.command.new_folder else (OLD, self.whole[name])
            )
            if found not in allowed:
                return f"{name} is neither old nor new: {found[:60] if found else found!r}"
        for name, kept in self.inputs.items():
            if (folder / name).read_bytes() != kept:
                return f"the input {name} was changed"
        return ""

    def goes_on(self, folder: Path) -> str:
        """Run the command again after a fault: it must end in the same files."""
        begun = (folder / "run" / "journal.bin").is_file()
        words = self.command.again if self.command.again and begun else self.command.words
        status, said = run(folder, words)
        if status == 2 and "--resume" in words:  # killed before the journal's head was whole
            shutil.rmtree(folder / "run")
            status, said = run(folder, self.command.words)
        if status != 0:
            return f"afterwards status {status}: {said[:300]}"
        found = contents(folder, self.command)
        changed = [name for name in found if found[name] != self.whole[name]]
        return f"afterwards other bytes in {changed}" if changed else ""


def one_line(status: int, said: str, statuses: tuple[int, ...]) -> str:
    """Describe what is wrong with the end of a command that was not killed."""
    if "Traceback" in said or status not in statuses:
        return f"status {status}: {said[-400:]}"
    return f"more than one line: {said[:300]}" if said.count("\n") > 1 else ""


# --- the faults ----------------------------------------------------------------------------------


def kill(world: World, dice: random.Random) -> str:
    """``kill -9`` at a random moment."""
    folder = world.case()
    process = begin(folder, world.command.words)
    time.sleep(dice.uniform(0.0, 1.05 * world.seconds))
    process.send_signal(signal.SIGKILL)
    process.communicate()
    return world.wrong(folder) or world.goes_on(folder)


def signalled(number: int) -> Callable[[World, random.Random], str]:
    """A signal that ends the command, at a random moment."""

    def fault(world: World, dice: random.Random) -> str:
        folder = world.case()
        process = begin(folder, world.command.words)
        time.sleep(dice.uniform(0.5, 1.0) * world.seconds)
        process.send_signal(number)
        _, error = process.communicate(timeout=PATIENCE_S)
        # Before Python can take a signal the system ends the program.
        ended = one_line(process.returncode, "", (0, 128 + number, -number))
        saved = world.command.words[0] == "design"  # the best so far is in its folder
        wrong = ended or ("Traceback" in error and error[-400:]) or ""
        return wrong or ("" if saved else world.wrong(folder)) or world.goes_on(folder)

    return fault


def full_disk(world: World, dice: random.Random) -> str:
    """No file may grow beyond a random size."""
    largest = max(len(data) for data in world.whole.values() if data is not None)
    limit = dice.randrange(max(largest, 2))

    def bound() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    folder = world.case()
    status, said = run(folder, world.command.words, preexec_fn=bound)
    return one_line(status, said, (0, 1, 2)) or world.wrong(folder) or world.goes_on(folder)


def read_only(world: World, dice: random.Random) -> str:
    """The folder cannot be written to."""
    folder = world.case()
    before = contents(folder, world.command)
    folder.chmod(0o555)
    words = [sys.executable, "-c", WITHOUT_RIGHTS, *world.command.words, "--quiet"]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
    status, said = done.returncode, done.stdout + done.stderr
    folder.chmod(0o755)
    kept = "" if contents(folder, world.command) == before else "a file was changed"
    return one_line(status, said, (1, 2)) or kept


def two_at_once(world: World, dice: random.Random) -> str:
    """Two processes write the same output."""
    folder = world.case()
    both = [begin(folder, world.command.words) for _ in range(2)]
    ends = [(p.communicate(timeout=PATIENCE_S), p.returncode) for p in both]
    for (out, error), status in ends:
        wrong = one_line(status, out + error, (0, 2))
        if wrong:
            return wrong
    return world.wrong(folder) or world.goes_on(folder)


def no_tmpdir(world: World, dice: random.Random) -> str:
    """TMPDIR names a folder that is gone."""
    folder = world.case()
    environment = {**os.environ, "TMPDIR": str(folder / "gone")}
    status, said = run(folder, world.command.words, env=environment)
    return one_line(status, said, (0, 1, 2)) or world.wrong(folder) or world.goes_on(folder)


SHIM = """
#define _GNU_SOURCE
#include <stddef.h>
#include <sys/time.h>
#include <time.h>
static long calls;
time_t time(time_t *to) { time_t t = 1700000000 - 10 * ++calls; if (to) *to = t; return t; }
int gettimeofday(struct timeval *tv, void *tz) {
  (void)tz; tv->tv_sec = time(NULL); tv->tv_usec = 0; return 0; }
"""
"""A clock that runs backward; the monotonic clock is another."""


def backward_clock(world: World, dice: random.Random) -> str:
    """The clock of the system goes backward."""
    compiler = shutil.which("cc")
    if compiler is None:
        return ""
    shim = world.root / "backward.so"
    if not shim.is_file():
        source = world.root / "backward.c"
        source.write_text(SHIM)
        subprocess.run([compiler, "-shared", "-fPIC", "-o", shim, source], check=True)
    folder = world.case()
    environment = {**os.environ, "LD_PRELOAD": str(shim)}
    status, said = run(folder, world.command.words, env=environment)
    return one_line(status, said, (0,)) or world.wrong(folder) or world.goes_on(folder)


FAULTS: dict[str, Callable[[World, random.Random], str]] = {
    "kill -9": kill,
    "SIGTERM": signalled(signal.SIGTERM),
    "SIGHUP": signalled(signal.SIGHUP),
    "full disk": full_disk,
    "read-only folder": read_only,
    "two at once": two_at_once,
    "TMPDIR gone": no_tmpdir,
    "clock backward": backward_clock,
}


def cases(
    names: list[str], counts: dict[str, int], seed: int, root: Path
) -> Iterator[tuple[str, str, int, list[str]]]:
    """Run faults; yields command, fault, how many, and what was wrong."""
    for name in names:
        world = World(name, root)
        for fault, count in counts.items():
            dice = random.Random(f"{seed} {name} {fault}")
            wrongs = []
            for _ in range(count):
                wrong = FAULTS[fault](world, dice)
                if wrong:
                    wrongs.append(wrong)
                for old in root.glob(f"{world.command.words[0]}[0-9]*"):
                    shutil.rmtree(old, ignore_errors=True)
            yield name, fault, count, wrongs


def main() -> int:
    """Run faults and print how many there were."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=50, help="of each command")
    parser.add_argument("--others", type=int, default=5, help="of each other fault and command")
    parser.add_argument("--commands", nargs="+", default=list(COMMANDS), choices=list(COMMANDS))
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    counts = {f: arguments.kills if f == "kill -9" else arguments.others for f in FAULTS}
    failed = done = 0
    with tempfile.TemporaryDirectory(prefix="faults-") as root:
        for name, fault, count, wrongs in cases(
            arguments.commands, counts, arguments.seed, Path(root)
        ):
            done, failed = done + count, failed + len(wrongs)
            print(f"{name:9} {fault:17} {count:4}  {len(wrongs)} failed", flush=True)
            for wrong in wrongs[:3]:
                print(f"    {wrong}", flush=True)
    print(f"faults: {done}, {failed} failed")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
