"""The command ``lostmotion drawing``."""

from __future__ import annotations

import argparse
from pathlib import Path

from lostmotion.drawing.files import write_drawing
from lostmotion.drawing.measures import drawing_table
from lostmotion.drives import read_drive
from lostmotion.errors import InputError
from lostmotion.model import design_model
from lostmotion.terminal import deliver


def run_drawing(arguments: argparse.Namespace) -> None:
    """``lostmotion drawing``."""
    drive = read_drive(arguments.drive)
    model = design_model(drive)
    folder = Path(arguments.output)
    if folder.exists():
        raise InputError(folder, "", "a folder that exists", "a new one, by -o FOLDER")
    files = write_drawing(model, drive.name, folder, arguments.command_line, arguments.csv_only)
    answer = {
        "schema": "lostmotion.drawing/1",
        "files": [str(file) for file in files],
        "table": {
            row.key: {
                "unit": row.unit,
                "flexspline": None if row.flexspline != row.flexspline else row.flexspline,
                "rigid": None if row.rigid != row.rigid else row.rigid,
            }
            for row in drawing_table(model)
        },
    }
    deliver(answer, arguments, lambda: print("\n".join(answer["files"])))
