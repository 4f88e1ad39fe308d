"""The table of all dresses and faults: `python -m logs` from the folder tests."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

from .combined import combined_table
from .judge import COMMANDS, Verdict
from .table import names, verdict
from .two_encoders_judge import two_encoders_table
from .walled import hostile_table


def main() -> int:
    """Print the table; returns 1 if a line of it is wrong."""
    parser = argparse.ArgumentParser("python -m logs", description=__doc__)
    parser.add_argument("words", nargs="*", help="only what has one of these words in its name")
    parser.add_argument("--commands", default=",".join(COMMANDS), help="these, with commas")
    parser.add_argument("--wrong", action="store_true", help="print what is wrong only")
    parser.add_argument("--hostile", action="store_true", help="hostile files instead")
    parser.add_argument("--two-encoders", type=int, metavar="N", help="N generated logs instead")
    parser.add_argument("--combined", type=int, metavar="N", help="N faults in formats instead")
    parser.add_argument("--seed", type=int, default=1, help="of --combined")
    parser.add_argument("--alone", action="store_true", help="each command in a process of its own")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument(
        "--resume", type=Path, metavar="FILE", help="append to FILE, skip the logs that it lists"
    )
    arguments = parser.parse_args()
    wanted = [
        name
        for name in names()
        if not arguments.words or any(word.lower() in name.lower() for word in arguments.words)
    ]
    if arguments.hostile:
        return hostile_table(arguments.words)
    if arguments.two_encoders:
        return two_encoders_table(arguments.two_encoders)
    if arguments.combined:
        return combined_table(arguments.combined, arguments.seed)
    listed = arguments.resume.read_text() if arguments.resume and arguments.resume.exists() else ""
    wanted = [name for name in wanted if f" {name:78} " not in listed]
    count = wrong = 0
    for line in _verdicts(wanted, arguments):
        count += 1
        wrong += bool(line.wrong)
        if arguments.resume:
            with arguments.resume.open("a") as file:
                file.write(line.line() + "\n")
        if line.wrong or not arguments.wrong:
            print(line.line(), flush=True)
    print(f"{count} logs through {arguments.commands}: {wrong} wrong")
    return 1 if wrong else 0


def _verdicts(wanted: list[str], arguments: argparse.Namespace) -> Iterator[Verdict]:
    commands = tuple(arguments.commands.split(","))
    if arguments.jobs == 1:
        yield from (verdict(name, commands, arguments.alone) for name in wanted)
        return
    with ProcessPoolExecutor(arguments.jobs) as pool:
        waiting = [pool.submit(verdict, name, commands, arguments.alone) for name in wanted]
        for each in waiting:
            yield each.result()


if __name__ == "__main__":
    sys.exit(main())
