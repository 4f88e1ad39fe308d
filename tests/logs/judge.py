"""Commands run on a log, and their results compared with those of the clean copy."""

from __future__ import annotations

import contextlib
import io
import json
import re
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from lostmotion import cli
from lostmotion.drives import read_drive

from .clean import DRIVE, HIDDEN, Sheet, clean
from .dress import EITHER, REFUSED, SAME

WITHIN = 0.02
"""Permitted relative difference of the rms of a rung from that of the clean copy, or from that of
the clean copy without the rows that the fault made unusable."""
COMMANDS = ("check", "compare", "diagnose", "fit")
BAD_INPUT = 2


@dataclass
class Outcome:
    """Outcome of a command."""

    status: int
    answer: dict[str, Any] = field(default_factory=dict)
    error: str = ""
    trace: str = ""
    warned: list[str] = field(default_factory=list)
    wrote: bool = False
    seconds: float = 0.0


def words_of(
    command: str,
    data: Sequence[Path],
    maps: Sequence[str],
    out: Path,
    drive: Path = DRIVE,
    add: Sequence[str] = (HIDDEN,),
) -> list[str]:
    """Return the words of a command line."""
    words = [command, *([] if command == "check" else [str(drive)]), *map(str, data)]
    for each in maps:
        words += ["--map", each]
    if command == "check":
        words += ["--ratio", str(read_drive(drive).ratio)]
    if command == "fit":
        for each in add:
            words += ["--add", each]
        words += ["-o", str(out / "fitted.toml")]
    return [*words, "--json", str(out / "answer.json"), "--quiet"]


def run(
    command: str,
    data: Sequence[Path],
    maps: Sequence[str] = (),
    alone: bool = False,
    drive: Path = DRIVE,
    add: Sequence[str] = (HIDDEN,),
) -> Outcome:
    """Run a command in this process, or in a separate one."""
    with tempfile.TemporaryDirectory() as name:
        out = Path(name)
        words = words_of(command, data, maps, out, drive, add)
        begin = time.process_time()
        outcome = _run_alone(words) if alone else _run_here(words)
        outcome.seconds = time.process_time() - begin
        outcome.wrote = any(out.iterdir())
        with contextlib.suppress(FileNotFoundError):
            outcome.answer = json.loads((out / "answer.json").read_text())
    return outcome


def _run_alone(words: list[str]) -> Outcome:
    done = subprocess.run(
        [sys.executable, "-m", "lostmotion", *words], capture_output=True, text=True, check=False
    )
    trace = done.stderr if "Traceback" in done.stderr else ""
    return Outcome(done.returncode, error=done.stderr, trace=trace)


def _run_here(words: list[str]) -> Outcome:
    error = io.StringIO()
    outcome = Outcome(-1)
    with (
        contextlib.redirect_stdout(io.StringIO()),
        contextlib.redirect_stderr(error),
        warnings.catch_warnings(record=True) as caught,
    ):
        warnings.simplefilter("always")
        try:
            outcome.status = cli.main(words)
        except Exception:
            outcome.trace = traceback.format_exc()
    outcome.error = error.getvalue()
    outcome.warned = [f"{w.category.__name__}: {w.message}" for w in caught]
    return outcome


def numbers(command: str, answer: dict[str, Any]) -> tuple[dict[str, float], tuple[Any, ...]]:
    """Return the parts of an answer that must agree within 2 %, and those that must be equal."""
    if command == "compare":
        return {"rms": answer["rms_arcsec"]}, ()
    if command == "diagnose":
        ladder = {f"rung {i}": rung["rms_arcsec"] for i, rung in enumerate(answer["ladder"])}
        return ladder, (answer["verdict"], *answer["effects"])
    if command == "fit":
        return {f"rung {i}": rung["rms_arcsec"] for i, rung in enumerate(answer["ladder"])}, ()
    return {}, ()


def campaign_file(folder: Path, sheet: Sheet) -> Path:
    """Write a sheet in the format of the interface."""
    file = folder / "campaign.csv"
    file.write_text(sheet.text())
    return file


@cache
def right_answer(command: str, sheet: Sheet | None = None) -> dict[str, Any]:
    """Return the answer of a command to the clean copy, or to a copy without some rows."""
    with tempfile.TemporaryDirectory() as name:
        outcome = run(command, [campaign_file(Path(name), sheet or clean())])
    assert outcome.status == 0, outcome
    return outcome.answer


def clean_findings() -> set[str]:
    """Findings of the clean copy, which do not concern the format."""
    return {str(finding) for finding in right_answer("check")["findings"]}


def differs(
    command: str, answer: dict[str, Any], less: Sheet | None = None, within: float = WITHIN
) -> str:
    """Describe the difference of an answer from the correct one; empty if there is none.

    `less` is a copy without the rows that a fault made unusable: an answer between those of both
    copies is also correct.
    """
    found, same = numbers(command, answer)
    wanted, wanted_same = numbers(command, right_answer(command))
    fewer = numbers(command, right_answer(command, less))[0] if less else wanted
    if same != wanted_same:
        return f"{' '.join(map(str, same))}, not {' '.join(map(str, wanted_same))}"
    for name, value in wanted.items():
        low, high = sorted((value, fewer[name]))
        if name not in found or not (1 - within) * low <= found[name] <= (1 + within) * high:
            return f"{name} {found.get(name, float('nan')):.4g}, not {value:.4g}"
    return ""


def refused_well(outcome: Outcome, says: Sequence[str] = ()) -> str:
    """Describe the fault of a refusal: it must be one clear line, and no file may be written."""
    if outcome.status != BAD_INPUT:
        return f"status {outcome.status}, not {BAD_INPUT}"
    if outcome.error.count("\n") != 1 or not outcome.error.startswith("lostmotion: "):
        return f"{outcome.error.count(chr(10))} lines on standard error"
    if outcome.wrote:
        return "a refusal that wrote a file"
    missing = [word for word in says if word.lower() not in outcome.error.lower()]
    return f"the refusal does not say {', '.join(missing)}" if missing else ""


@dataclass
class Verdict:
    """A line of the table."""

    name: str
    expected: str
    got: str
    wrong: str
    said: str = ""

    def line(self) -> str:
        """Write it."""
        mark = "WRONG" if self.wrong else "ok"
        said = f"  [{self.said}]" if self.said else ""
        return f"{mark:5} {self.name:78} {self.got:8} {self.wrong}{said}"


def judge(
    name: str,
    data: Sequence[Path],
    maps: Sequence[str] = (),
    expected: str = SAME,
    says: Sequence[str] = (),
    commands: Sequence[str] = COMMANDS,
    less: Sheet | None = None,
    finding: Sequence[str] = (),
    alone: bool = False,
) -> Verdict:
    """Run the commands on a log and check their answers.

    `finding` are words that one finding of `check` must contain, each in one of the spellings
    separated by a bar.
    """
    wrong: list[str] = []
    got: list[str] = []
    said = ""
    for command in commands:
        outcome = run(command, data, maps, alone)
        if outcome.trace or outcome.warned:
            last = (outcome.trace.strip().splitlines() or outcome.warned)[-1]
            wrong.append(f"{command}: {last}")
        elif outcome.status == 0 and expected != REFUSED:
            got.append(SAME)
            difference = differs(command, outcome.answer, less)
            if command == "check":
                difference = _findings_wrong(outcome.answer["findings"], finding)
            if outcome.error:
                difference = difference or f"says {outcome.error.strip()}"
            if difference:
                got[-1] = "other"
                wrong.append(f"{command}: {difference}")
        else:
            got.append("refused" if outcome.status == BAD_INPUT else f"status {outcome.status}")
            said = outcome.error.strip()
            bad = refused_well(outcome, says if expected == REFUSED else ())
            if expected == SAME:
                bad = bad or "refused"
            if bad:
                wrong.append(f"{command}: {bad}")
    if expected == EITHER and len(set(got) - {"other"}) > 1 and not _only_check_goes(commands, got):
        wrong.append(f"not of one mind: {', '.join(got)}")
    first = "; ".join(dict.fromkeys(wrong))
    return Verdict(name, expected, got[-1] if got else "-", first, said)


def _only_check_goes(commands: Sequence[str], got: Sequence[str]) -> bool:
    """`check` has no drive file, so it cannot detect contradictions to it."""
    return commands[0] == "check" and got[0] == SAME and len(set(got[1:])) == 1


def _findings_wrong(findings: Sequence[Any], wanted: Sequence[str]) -> str:
    new = [
        json.dumps(finding, ensure_ascii=False)
        for finding in findings
        if str(finding) not in clean_findings()
    ]
    if wanted and not any(
        all(any(_names(text, w) for w in word.split("|")) for word in wanted) for text in new
    ):
        return f"no finding names {' and '.join(wanted)}: " + ("; ".join(new) or "none")
    return ""


def _names(text: str, word: str) -> bool:
    """Whether a finding contains a word; a number as a whole."""
    return re.search(rf"(?<!\d){re.escape(word)}(?!\d)", text, re.IGNORECASE) is not None
