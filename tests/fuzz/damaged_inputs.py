"""Damaged inputs to every command: a correct result, or status 2 with one clear line.

Each case takes sound files (a bought drive, a drawn one, a recording), damages one of them or an
option, and runs a command on them. Permitted results:

* status 0: an answer in strict JSON whose numbers are finite and consistent, nothing on standard
  error; where the damage is harmless (another line end, a byte order mark, compression, another
  order of keys, columns or tables), the answer of the sound files;
* status 2: one line on standard error with what was found and what was expected, and nothing
  written: no new file, none changed.

Anything else is a failure: a traceback, a warning, another status, an incomplete file, more than
`PATIENCE_S` seconds. A case depends on the seed, its number and the existing commands, so that
``damaged_inputs.py --seed 1 --only 4711`` repeats it.
"""

from __future__ import annotations

import argparse
import contextlib
import copy
import hashlib
import io
import itertools
import json
import math
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from damage import (
    Kitchen,
    damage_bytes,
    damage_evidence,
    damage_search,
    damage_text,
    make_recording,
    make_toml,
    odd_path,
    odd_value,
)
from sound_files import DRIVES, SHEET, made, sound_file, spec

from lostmotion import cli
from lostmotion.errors import InputError
from lostmotion.workbench import bench as workbench

PATIENCE_S = 60.0
"""A command on files this small takes a fraction of a second."""

UNCHANGED = "an output that was there before\n"

SKIPPED = dict.fromkeys(("demo", "completion", "new"), "reads no file")
"""Commands that are left out, and why."""

OUTPUTS = {
    "export": "params.h",
    "fit": "fitted.toml",
    "design": "run",
    "calibrate": "calibrated.toml",
    "drawing": "drawing",
}
"""Arguments for ``-o`` that a command needs in order to write."""

FILES = {
    "LOG": "DATA",
    "PLAN": "DATA",
    "OPTIONS": "DATA",
    "SPEC.toml": "SPEC",
    "SHEET_OR_FITTED": "SHEET",
}
"""Kinds of files by the names of arguments, where these differ."""

GIVEN = {
    "workbench": ["DRIVE", "DATA"],
    "merge": ["EVIDENCE", "EVIDENCE"],
    "effects": ["OWN"],
}
"""Files of commands that take more or fewer than their arguments say."""

NAMES = {
    "DRIVE": "drive.toml",
    "SHEET": "sheet.toml",
    "DATA": "data.csv",
    "SPEC": "spec.toml",
    "EVIDENCE": "one.npz",
    "OWN": "own.py",
}

BLOB = "params.bin"
"""Name of a drive file that is a blob of parameters."""

SEARCH_PATIENCE_S = 3.0
"""A damaged spec may require a search of a day: it is interrupted."""

SHARES = {
    "predict": 6,
    "clearances": 4,
    "export": 4,
    "compare": 2,
    "replay": 3,
    "workbench": 2,
    "merge": 2,
    "effects": 2,
}
"""Weight of a command; all others have 1, because they may take a thousand times as long."""

TABLES: dict[str, Callable[[str], dict[str, Any]]] = {
    "DRIVE": lambda kind: DRIVES[kind](),
    "SHEET": lambda _: copy.deepcopy(SHEET),
    "SPEC": lambda _: spec(),
}
"""Contents of the files that are written as TOML."""


# --- cases ---------------------------------------------------------------------------------------


@dataclass
class Case:
    """One command line with its files.

    Attributes
    ----------
    argv : list of str
        The words of the command line.
    damage : str
        What was done, in a few words.
    harmless : bool
        Whether the answer must be that of the sound files.
    """

    argv: list[str]
    damage: str
    harmless: bool = False


def odd_option(kitchen: Kitchen, command: str) -> list[str]:
    """Return an option with a value that is probably wrong."""
    dice = kitchen.dice
    numbers = [str(odd_value(dice, 1.0))[:50].replace("\0", "") for _ in range(3)]
    options = {
        "--torque": [
            ":".join(numbers[:2]) + f":{dice.choice([0, 1, 2, 33, 1026, -1, 'x', '1e3'])}"
        ],
        "--phase-deg": [numbers[0]],
        "--angles-deg": [",".join(numbers), ",".join(["1"] * 5000), ","],
        "--seed": [str(dice.choice([-1, 0, 2**32, 2**64, 10**400, "x", 1.5]))],
        "--map": [
            dice.choice(["torque_Nm", "run", "x", "", "time_s"])
            + dice.choice(["=", "", "=="])
            + dice.choice(["torque_Nm", "-torque_kNm", "lost_motion", "run", "x_Nm", "", "time_h"])
        ],
        "--json": [str(kitchen.folder / "none" / "a.json"), str(kitchen.folder), "", "a\0b", "/"],
        "--report": [str(kitchen.folder / "none" / "a.html"), str(kitchen.folder), "", "a\0b", "/"],
        "--set": [
            dice.choice(["period_us", "period_s", "torque_limit_Nm", "noise_arcsec", "x", ""])
            + dice.choice(["=", "", "=="])
            + numbers[0]
        ],
        "--name": [dice.choice(["a b", "", "1a", "int", "é", "_", "a" * 5000, numbers[0]])],
        "--fit-on": [dice.choice(["0", "0,1", "9", "", ",", "0,0", "0,1,2", numbers[0]])],
        "--ratio": [numbers[0], "1e999", "0"],
        "--workers": [numbers[0], "0", "-1", "10**9"],
        "--add": [dice.choice(["thermal_gap", "nothing", "", "wear", numbers[0]])],
        "--effects": [str(kitchen.folder / "none.py"), str(kitchen.folder), "", "a\0b.py", "/"],
        "--profile": [dice.choice(["standard", "small", "nothing", ""])],
        "--table": [str(kitchen.folder / "none" / "a.csv"), str(kitchen.folder), "a\0b"],
        "--save-evidence": [str(kitchen.folder / "none" / "a.npz"), str(kitchen.folder), "a\0b"],
        "--nonsense": [""],
    }
    known = {word for action in commands()[command]._actions for word in action.option_strings} | {
        "--nonsense"
    }
    option = dice.choice(sorted(known & set(options)))
    value = dice.choice(options[option])
    kitchen.note("option", option, repr(value)[:60])
    return [f"{option}={value}"] if option != "--nonsense" else [option]


def commands() -> dict[str, argparse.ArgumentParser]:
    """All commands by name."""
    for action in cli.make_parser()._actions:
        if isinstance(action, argparse._SubParsersAction):
            return dict(action.choices)
    raise AssertionError("the parser has no commands")


def command_files(command: str) -> list[str]:
    """Kinds of files that a command is given, by the names of its arguments."""
    if command in GIVEN:
        return GIVEN[command]
    return [
        FILES.get(str(action.metavar), str(action.metavar))
        for action in commands()[command]._actions
        if (not action.option_strings and action.nargs not in ("?", "*"))
        or (action.required and action.dest != "output")
    ]


def written(command: str, files: list[str]) -> list[str]:
    """Words of a command line that name its files; options where it needs options."""
    if command == "effects":
        return [f"--effects={file}" for file in files]
    required = [a for a in commands()[command]._actions if a.option_strings and a.required]
    options = [a.option_strings[0] for a in required if a.dest != "output"]
    first = len(files) - len(options)
    words = list(files[:first])
    for option, file in zip(options, files[first:], strict=True):
        words.append(f"{option}={file}")
    return words


def testable() -> list[str]:
    """Commands that need a drive file, recordings, a place to write to, and nothing else."""
    found = []
    for name, parser in commands().items():
        kinds = command_files(name)
        needed = {a.dest for a in parser._actions if a.required and a.dest == "output"}
        if needed and name not in OUTPUTS:
            continue
        if name not in SKIPPED and kinds and set(kinds) <= set(NAMES):
            found.append(name)
    return found


def drive_kinds(command: str) -> tuple[str, ...]:
    """Kinds of drives that a command takes."""
    if command in ("clearances", "calibrate", "drawing"):
        return ("drawn",)
    if command == "merge":
        return ("bought", "drawn")
    return ("bought", "drawn", "fitted", *(["blob"] if command == "replay" else []))


def name_of(file: str, kind: str) -> str:
    """Name of a file of a kind, for a drive of a kind."""
    return BLOB if (file, kind) == ("DRIVE", "blob") else NAMES[file]


def damaged(kitchen: Kitchen, file: str, kind: str) -> tuple[Path, bool]:
    """Write a damaged file; return it, and whether it should still mean the same."""
    name = name_of(file, kind)
    if file == "DATA":
        return make_recording(kitchen)
    sound = sound_file(file, kind)
    if file == "EVIDENCE":
        raw, harmless = damage_evidence(kitchen, sound)
    elif name == BLOB:
        raw, harmless = damage_bytes(kitchen, sound), False
    elif file == "OWN":
        raw, harmless = damage_text(kitchen, sound.decode())
    else:
        return make_toml(kitchen, name, TABLES[file](kind))
    return kitchen.file(name, raw), harmless


def make_case(seed: int, number: int, folder: Path) -> tuple[Case, str, str]:
    """Make a case; return it with its command and its kind of drive."""
    kitchen = Kitchen(random.Random(f"{seed}:{number}"), folder)
    dice = kitchen.dice
    names = testable()
    command = dice.choices(names, [SHARES.get(name, 1) for name in names])[0]
    kind = dice.choice(drive_kinds(command))
    kinds = command_files(command)
    target = dice.choice([*kinds, *kinds, *kinds, "option", "path"])
    harmless = target in kinds
    words, options = [command], ["--json", str(folder / "answer.json")]
    odd = dice.choice(kinds) if target == "path" else ""
    files = []
    for place, file in enumerate(kinds):
        name = name_of(file, kind)
        if kinds.index(file) != place:  # a second one, as of `next`
            files.append(str(kitchen.file(f"more_{name}", sound_file(file, kind, place))))
        elif file == odd:
            files.append(odd_path(kitchen, Path(name).suffix))
        elif file == target:
            path, harmless = damaged(kitchen, file, kind)
            files.append(str(path))
        else:
            files.append(str(kitchen.file(name, sound_file(file, kind))))
    if command == "design" and dice.random() < 0.5:
        run = dict(made("search"))
        if target == "SPEC":
            harmless = False
        else:
            damage_search(kitchen, run)
        for name, content in run.items():
            kitchen.file(f"run/{name}", content)
        options.append("--resume")
    elif command == "effects" and dice.random() < 0.3:
        # "out_" separates permitted names from the existing file.
        harmless = False
        words += ["new", dice.choice(["out_", "", ""]) + str(odd_value(dice))[:300]]
        words[-1] = words[-1].replace("\0", "")
    words += written(command, files)
    if command in OUTPUTS:
        options += ["-o", str(folder / OUTPUTS[command])]
    if target == "option":
        options += odd_option(kitchen, command)
    elif dice.random() < 0.02 and "--report" in commands()[command].format_help():
        options += ["--report", str(folder / "report.html")]
    if dice.random() < 0.5:
        # Existing files must be unchanged if the command refuses its input.
        for option in ("answer.json", "report.html", "params.h", "fitted.toml"):
            kitchen.file(option, UNCHANGED)
    return Case([*words, *options], "; ".join(kitchen.damage), harmless), command, kind


# --- judgement -----------------------------------------------------------------------------------


class Impatience(Exception):
    """A command took too long."""


@dataclass
class Outcome:
    """Outcome of a command."""

    status: int | str
    error: str
    warnings: list[str]
    trace: str = ""


def run_here(argv: list[str], search_s: float = SEARCH_PATIENCE_S) -> Outcome:
    """Run a command in this process; a search is interrupted after `search_s`."""
    out, error = io.StringIO(), io.StringIO()

    def too_long(*_: object) -> None:
        raise KeyboardInterrupt if argv[0] == "design" else Impatience

    old = signal.signal(signal.SIGALRM, too_long)
    patience = search_s if argv[0] == "design" else PATIENCE_S
    signal.setitimer(signal.ITIMER_REAL, patience)
    try:
        with (
            warnings.catch_warnings(record=True) as caught,
            contextlib.redirect_stdout(out),
            contextlib.redirect_stderr(error),
        ):
            warnings.simplefilter("always")
            try:
                status: int | str = load_bench(argv) if argv[0] == "workbench" else cli.main(argv)
                trace = ""
            except BaseException as failure:
                if isinstance(failure, KeyboardInterrupt):
                    raise
                status, trace = type(failure).__name__, traceback.format_exc()
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, old)
    said = [f"{w.category.__name__}: {w.message} ({w.filename}:{w.lineno})" for w in caught]
    return Outcome(status, error.getvalue(), said, trace)


def load_bench(argv: list[str]) -> int:
    """Load a drive and recordings like the workbench, and return its message."""
    drive, data, _, answer, *rest = argv[1:]
    if rest:
        return cli.main([*argv, "--port=x"])  # an option: it ends before any page is shown
    bench = workbench.Bench()
    try:
        bench.load_drive(drive)
        bench.load_recordings([data], {}, lambda *_: None)
        assert bench.comparison is not None
        Path(answer).write_text(json.dumps(bench.comparison.answer(), allow_nan=False))
    except InputError as error:
        print(f"lostmotion: {error}", file=sys.stderr)
        return 2
    finally:
        bench.close()
    return 0


def run_process(argv: list[str]) -> Outcome:
    """Run a command as a separate process."""
    done = subprocess.run(
        [sys.executable, "-m", "lostmotion", *argv],
        capture_output=True,
        timeout=PATIENCE_S,
        check=False,
    )
    return Outcome(done.returncode, done.stderr.decode("utf-8", "replace"), [])


def snapshot(folder: Path) -> dict[str, str]:
    """Names and contents of everything in a folder."""
    found = {}
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder)).encode("utf-8", "surrogateescape").hex()
        if path.is_file() and not path.is_symlink():
            with contextlib.suppress(OSError):
                found[name] = hashlib.sha256(path.read_bytes()).hexdigest()
                continue
        found[name] = "other"
    return found


def finite(value: Any) -> bool:
    """Whether all numbers of an answer are finite (JSON itself allows nothing else)."""
    if isinstance(value, dict):
        return all(finite(inner) for inner in value.values())
    if isinstance(value, list):
        return all(finite(inner) for inner in value)
    return not isinstance(value, float) or math.isfinite(value)


def refuse_constant(name: str) -> Any:
    raise ValueError(f"{name} in an answer")


def read_answer(text: str) -> dict[str, Any]:
    """Read strict JSON: no NaN, no Infinity."""
    answer: dict[str, Any] = json.loads(text, parse_constant=refuse_constant)
    return answer


def judge_prediction(answer: dict[str, Any]) -> str:
    total = answer["total_arcmin"]
    if None in total:
        return "no number in the total"
    for i, whole in enumerate(total):
        parts = [part[i] for part in answer["parts_arcmin"].values()]
        largest = max(1e-9, *(abs(part) for part in parts))
        if abs(sum(parts) - whole) > 1e-9 * largest:
            return f"parts {parts} do not add up to {whole}"
    slack = 1e-9 * max(1e-9, *(abs(value) for value in total))
    if any(b < a - slack for a, b in itertools.pairwise(total)):
        return "the torsion curve falls"
    return ""


def judge_clearances(answer: dict[str, Any]) -> str:
    for forward, backward, overlap in zip(
        answer["forward_arcmin"], answer["backward_arcmin"], answer["overlap"], strict=True
    ):
        if overlap != (forward is not None or backward is not None):
            return "overlap does not agree with the clearances"
    return ""


def judge_comparison(answer: dict[str, Any]) -> str:
    for name in ("rms_arcsec", "heldout_rms_arcsec", "noise_floor_arcsec"):
        if not answer[name] >= 0:
            return f"{name} is {answer[name]}"
    # Far below 0 if the recordings have another unit and every fitted value is at its bound.
    if not answer["explained_share"] <= 1:
        return f"explained_share is {answer['explained_share']}"
    return ""


JUDGES: dict[str, Callable[[dict[str, Any]], str]] = {
    "predict": judge_prediction,
    "clearances": judge_clearances,
    "compare": judge_comparison,
}


def same(answer: dict[str, Any], sound: dict[str, Any]) -> bool:
    """Whether two answers are equal except for file names."""

    def bare(value: dict[str, Any]) -> str:
        kept = {key: inner for key, inner in value.items() if key not in ("findings", "folder")}
        return re.sub(r"/[^\"]*/(case\d+|sound)/", "", json.dumps(kept, sort_keys=True))

    return bare(answer) == bare(sound)


def judge(
    case: Case,
    command: str,
    outcome: Outcome,
    before: dict[str, str],
    folder: Path,
    sound: dict[str, Any],
) -> str:
    """Describe the fault of an outcome; empty if there is none."""
    if outcome.trace or "Traceback" in outcome.error:
        return (outcome.trace or outcome.error).strip()
    if outcome.warnings:
        return outcome.warnings[0]
    if outcome.status == 2:
        lines = outcome.error.splitlines()
        if len(lines) != 1:
            return f"{len(lines)} lines on standard error: {outcome.error[:300]!r}"
        clear = (": found " in lines[0] and ", expected " in lines[0]) or "--help" in lines[0]
        if not lines[0].startswith("lostmotion") or not clear:
            return f"not a clear line: {lines[0][:300]}"
        if len(lines[0]) > 2000:
            return f"a line of {len(lines[0])} characters: {lines[0][:200]}"
        if not lines[0].isprintable():
            return f"a line that cannot be printed: {lines[0][:200]!r}"
        if snapshot(folder) != before:
            return "status 2, but files were written"
        return "harmless, but refused: " + lines[0] if case.harmless else ""
    if command == "design" and outcome.status in (1, 130):
        # No design is feasible, or the search that the spec requires takes too long.
        return (
            "" if outcome.error.startswith("lostmotion: ") or outcome.status == 130 else "no line"
        )
    if outcome.status != 0:
        return f"status {outcome.status}: {outcome.error[:300]}"
    if outcome.error:
        return f"status 0 with an error: {outcome.error[:300]}"
    file = folder / "answer.json"
    if not file.is_file():
        return "" if any(word.startswith("--json=") for word in case.argv) else "no answer"
    try:
        answer = read_answer(file.read_text())
        if not finite(answer):
            return "a number that is not finite"
        complaint = JUDGES[command](answer) if command in JUDGES else ""
    except (ValueError, KeyError, TypeError) as error:
        return f"an answer that cannot be understood: {error!r}"
    if complaint:
        return complaint
    return "harmless, but another answer" if case.harmless and not same(answer, sound) else ""


@cache
def sound_answer(command: str, kind: str) -> dict[str, Any]:
    """Answer for the undamaged files."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "sound"
        folder.mkdir()
        kitchen = Kitchen(random.Random(0), folder)
        words: list[str] = [command]
        files: list[str] = []
        kinds = command_files(command)
        for at, file in enumerate(kinds):
            name = name_of(file, kind) if kinds.index(file) == at else f"more_{NAMES[file]}"
            files.append(str(kitchen.file(name, sound_file(file, kind, at))))
        words += written(command, files)
        if command in OUTPUTS:
            words += ["-o", str(folder / OUTPUTS[command])]
        outcome = run_here([*words, "--json", str(folder / "answer.json")], PATIENCE_S)
        assert outcome.status == 0, (words, outcome)
        return read_answer((folder / "answer.json").read_text())


class Bench:
    """Runs cases, each in a separate temporary folder."""

    def __init__(self, seed: int, root: Path) -> None:
        self.seed = seed
        self.root = root

    def run(
        self, number: int, *, process: bool = False, keep: bool = False
    ) -> tuple[Case, str, Any]:
        """Run one case; return it, its fault and its status."""
        folder = self.root / f"case{number}"
        folder.mkdir()
        try:
            case, command, kind = make_case(self.seed, number, folder)
            sound = sound_answer(command, kind)
            before = snapshot(folder)
            runnable = all("\0" not in word for word in case.argv)
            here = os.getcwd()
            os.chdir(folder)
            try:
                alone = process and runnable and command not in ("design", "workbench")
                outcome = (run_process if alone else run_here)(case.argv)
            finally:
                os.chdir(here)
            return case, judge(case, command, outcome, before, folder, sound), outcome
        finally:
            if not keep:
                shutil.rmtree(folder, ignore_errors=True)


def failures(
    seed: int, numbers: Iterator[int] | range, root: Path, process_every: int = 0
) -> Iterator[tuple[int, Case, str, Outcome]]:
    """Run cases and yield each with its fault, which is empty if there is none."""
    bench = Bench(seed, root)
    for number in numbers:
        process = bool(process_every) and number % process_every == 0
        case, wrong, outcome = bench.run(number, process=process)
        yield number, case, wrong, outcome


def main() -> int:
    """Run cases and print the failures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=10_000)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", type=int, help="run this case and keep its files")
    parser.add_argument("--process-every", type=int, default=50, help="0: none as a process")
    parser.add_argument("--show", type=int, default=40, help="kinds of failures to show")
    arguments = parser.parse_args()
    root = Path(tempfile.mkdtemp(prefix="damaged-"))
    if arguments.only is not None:
        case, wrong, outcome = Bench(arguments.seed, root).run(arguments.only, keep=True)
        print(f"{case}\n{outcome}\n{wrong or 'all is well'}\nfiles: {root}")
        return int(bool(wrong))
    begin = time.monotonic()
    statuses: Counter[str] = Counter()
    kinds: dict[str, list[tuple[int, Case, str]]] = {}
    numbers = range(arguments.first, arguments.first + arguments.cases)
    for number, case, wrong, outcome in failures(
        arguments.seed, numbers, root, arguments.process_every
    ):
        statuses[f"{case.argv[0]} {outcome.status}"] += 1
        if wrong:
            where = re.findall(r'File ".*/(\w+\.py)", line (\d+)', wrong)
            last = re.sub(r"/\S+|\d+", "*", wrong.splitlines()[-1])[:120]
            kind = f"{last} {':'.join(where[-1]) if where else ''}"
            kinds.setdefault(kind, []).append((number, case, wrong))
    shutil.rmtree(root)
    for kind, cases in sorted(kinds.items(), key=lambda item: -len(item[1]))[: arguments.show]:
        number, case, wrong = cases[0]
        print(f"\n{len(cases)} x {kind}\n  case {number}: {case.argv[0]}, {case.damage[:200]}")
        print("  also", [n for n, _, _ in cases[1:6]])
    failed = sum(len(cases) for cases in kinds.values())
    left_out = sorted(set(commands()) - set(testable()))
    print(f"\nstatuses: {dict(sorted(statuses.items()))}\nnot run: {', '.join(left_out)}")
    print(f"{arguments.cases} cases, {failed} failed, {time.monotonic() - begin:.0f} s")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
