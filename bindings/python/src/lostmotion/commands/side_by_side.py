"""``lostmotion predict`` for several drives, or for values of one dimension: a table."""

from __future__ import annotations

import argparse

from lostmotion.drives import read_drive
from lostmotion.errors import InputError, one_line
from lostmotion.files import write_whole
from lostmotion.side_by_side import SideBySide, read_sweep, sweep, tabulate
from lostmotion.terminal import deliver, show_table

SHOWN = {
    "reversal_lost_motion_arcmin": "lost motion arcmin",
    "worst_lost_motion_arcmin": "worst case",
    "stiffness_at_rated_Nm_per_rad": "tangent Nm/rad",
    "secant_stiffness_Nm_per_rad": "secant Nm/rad",
    "safety_factor": "safety",
    "checks_not_kept": "failed checks",
}
"""Columns of the printed table; the file and the JSON have all columns."""

ALONE = ("torque", "sensitivity", "target")
"""Options of a prediction that do not apply to a table."""


def run_table(arguments: argparse.Namespace) -> None:
    """Print and write the table of ``lostmotion predict``."""
    for option in ALONE:
        if getattr(arguments, option):
            expected = "one drive, without --sweep and --table"
            raise InputError(f"--{option}", "", "the option together with a table", expected)
    if float(arguments.phase_deg) != 0.0:
        raise InputError("--phase-deg", "", "the option together with a table", "tooth phase 0")
    if arguments.sweep is None:
        answer = tabulate(arguments.drive)
    else:
        if len(arguments.drive) > 1:
            found = f"{len(arguments.drive)} drive files"
            raise InputError("--sweep", "", found, "one, whose key takes several values")
        key, values = read_sweep(arguments.sweep)
        answer = sweep(read_drive(arguments.drive[0]), key, values)
    if arguments.table is not None:
        write_whole(arguments.table, answer.csv())
    if arguments.report is not None:
        from lostmotion.report import write_report
        from lostmotion.report.side_by_side import table_section

        title = f"Sweep of {answer['swept']}" if answer["swept"] else "Drives side by side"
        lead = "Predicted from the drive files, without measurements."
        section = table_section(answer)
        write_report(arguments.report, title, lead, [section], arguments.command_line)
    deliver(answer, arguments, lambda: show_rows(answer))
    if arguments.table is not None and not arguments.quiet and arguments.json != "-":
        print(f"written: {one_line(arguments.table)}")


def show_rows(answer: SideBySide) -> None:
    """Print the table."""
    swept = answer["swept"]
    first = swept or "drive"
    rows = []
    for row in answer["rows"]:
        cells = [cell(row[name]) for name in SHOWN]
        if row["refused"]:
            cells[-1] = f"refused: {one_line(row['refused'])}"
        rows.append([cell(row[first]), *cells])
    show_table([first, *SHOWN.values()], rows)


def cell(value: float | str | None) -> str:
    """Write a cell."""
    if value is None:
        return "-"
    return one_line(value) if isinstance(value, str) else f"{value:.5g}"
