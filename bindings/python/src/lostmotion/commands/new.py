"""The command ``lostmotion new``."""

from __future__ import annotations

import argparse
from pathlib import Path

from lostmotion.design.textbook import annotated_drive_file, parse_words, textbook_drive
from lostmotion.errors import InputError
from lostmotion.files import write_whole
from lostmotion.model import Check
from lostmotion.terminal import deliver


def run_new(arguments: argparse.Namespace) -> None:
    """``lostmotion new``."""
    size, ratio, generator, name, torque_Nm = parse_words(arguments.words)
    stem = name or f"size_{size:g}_ratio_{ratio}"
    file = Path(arguments.output or f"{stem}.toml")
    if file.exists():
        raise InputError(file, "", "a file that exists", "a new name, by -o FILE")
    document, broken = textbook_drive(size, ratio, generator, stem, torque_Nm)
    said = [broken_check(check) for check in broken]
    made = f"'{stem}': a cup of size {size:g}, ratio {ratio}, wave generator {generator}"
    heading = "\n".join(
        [
            f"Size {size:g}, ratio {ratio}, {generator}: textbook proportions "
            "(lostmotion new), to be changed.",
            "A key after # is not set: the value shown is its default.",
            "lostmotion predict prints the torsion curve and the checks of this drive.",
            *said,
        ]
    )
    write_whole(file, annotated_drive_file(document, heading))
    answer = {
        "schema": "lostmotion.new/1",
        "file": str(file),
        "drive": document["drive"],
        "broken_checks": [check.name for check in broken],
    }
    deliver(answer, arguments, lambda: print("\n".join([str(file), made, *said])))


def broken_check(check: Check) -> str:
    """State that a check failed, in the unit for display."""
    unit, value, limit, _ = check.shown()
    return f"check failed: {check.name} {value:.4g} {unit}".rstrip() + f", limit {limit:.4g}"
