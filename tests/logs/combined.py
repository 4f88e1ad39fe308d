"""Combined logs: a fault of one cell or section, written in the format of a program."""

from __future__ import annotations

import csv
import io
import random
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from .clean import Sheet, clean
from .dress import DRESSES, SAME
from .judge import Verdict, judge
from .table import dresses, fault, faults

QUICK = ("check", "compare")

RENUMBERED = "no column of runs"
"""Words in the names of dresses that number the runs anew, so that no finding names the run."""


def combined_table(count: int, seed: int = 1) -> int:
    """Print the table of random combinations; returns 1 if a line of it is wrong."""
    wrong = 0
    for line in combinations(count, seed):
        wrong += bool(line.wrong)
        print(line.line(), flush=True)
    print(f"{count} combined logs through {','.join(QUICK)}: {wrong} wrong")
    return 1 if wrong else 0


def combinations(count: int, seed: int) -> Iterator[Verdict]:
    """Yield verdicts on random combinations that the writers of the formats can write."""
    chance = random.Random(seed)
    plain = [name for name in dresses() if DRESSES[name].expected == SAME]
    single = [name for name in faults() if ": " in name and fault(name).expected == SAME]
    done = 0
    while done < count:
        line = combined(chance.choice(plain), chance.choice(single))
        if line is not None:
            done += 1
            yield line


def combined(dress: str, damage: str, commands: Sequence[str] = QUICK) -> Verdict | None:
    """Write a fault in a format, run the commands on it, and check their answers.

    None if the format cannot contain the fault, such as a torn line, text in another unit, or a
    cell that it does not write. A finding may name the line in place of the run, and the column as
    the file does.
    """
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as beside:
        try:
            written = files(dress, Path(folder), sheet_of(fault(damage).text))
        except (ValueError, OverflowError):
            return None
        files(dress, Path(beside), clean())
        lines = changed_lines(Path(beside), Path(folder))
        if not lines:
            return None
        spellings = [
            "|".join([word, *other])
            for word, other in zip(
                fault(damage).finding[: 1 if RENUMBERED in dress else 2],
                (names_in_file(dress, fault(damage).finding), lines),
                strict=False,
            )
        ]
        line = judge(
            f"{dress} + {damage}",
            written,
            DRESSES[dress].maps,
            commands=commands,
            less=fault(damage).less,
            finding=spellings,
        )
        line.wrong = line.wrong.replace(f"{folder}/", "")
        line.said = line.said.replace(f"{folder}/", "")
    return line


def names_in_file(dress: str, finding: Sequence[str]) -> list[str]:
    """Names that a format has for the column of a finding."""
    maps = [text.partition("=") for text in DRESSES[dress].maps]
    wanted = finding[0].split("|") if finding else []
    return [name for name, _, to in maps if any(one in to for one in wanted)]


def files(dress: str, folder: Path, sheet: Sheet) -> list[Path]:
    """Write a sheet in a format, whose files may be several."""
    written = DRESSES[dress].write(folder, sheet)
    return written if isinstance(written, list) else [written]


def changed_lines(before: Path, after: Path) -> list[str]:
    """Names of the lines that a fault has changed in a folder, and of files that only one has."""
    old, new = (
        {
            file.relative_to(log): file.read_bytes().split(b"\n")
            for file in log.rglob("*")
            if file.is_file()
        }
        for log in (before, after)
    )
    names = sorted(path.name for path in old.keys() ^ new.keys())
    for path in old.keys() & new.keys():
        if old[path] != new[path]:
            known = set(old[path])
            lines = [at for at, text in enumerate(new[path], start=1) if text not in known]
            names += [f"line {at}" for at in lines] or [path.name]
    return names


def sheet_of(text: str) -> Sheet:
    """Read the file of a fault as a sheet."""
    names, *rows = csv.reader(io.StringIO(text))
    return Sheet(tuple(names), tuple(zip(*rows, strict=True)))
