"""Combined logs: a fault of one cell or section, written in the format of a program."""

from __future__ import annotations

import csv
import io
import random
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from .clean import Sheet
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

    None if the format cannot contain the fault, such as a torn line, or text in another unit.
    """
    with tempfile.TemporaryDirectory() as folder:
        try:
            written = DRESSES[dress].write(Path(folder), sheet_of(fault(damage).text))
        except (ValueError, OverflowError):
            return None
        line = judge(
            f"{dress} + {damage}",
            written if isinstance(written, list) else [written],
            DRESSES[dress].maps,
            commands=commands,
            less=fault(damage).less,
            finding=fault(damage).finding[: 1 if RENUMBERED in dress else 2],
        )
        line.wrong = line.wrong.replace(f"{folder}/", "")
        line.said = line.said.replace(f"{folder}/", "")
    return line


def sheet_of(text: str) -> Sheet:
    """Read the file of a fault as a sheet."""
    names, *rows = csv.reader(io.StringIO(text))
    return Sheet(tuple(names), tuple(zip(*rows, strict=True)))
