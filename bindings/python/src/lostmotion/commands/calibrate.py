"""The command ``lostmotion calibrate``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from lostmotion.calibrate import CONSTANTS, DEFAULT, Calibration, calibrate
from lostmotion.drives import format_toml, read_drive
from lostmotion.errors import InputError, did_you_mean
from lostmotion.files import write_whole
from lostmotion.terminal import deliver, show_table


def run_calibrate(arguments: argparse.Namespace) -> None:
    """``lostmotion calibrate``."""
    names = constant_names(arguments.constants)
    drawing, source = read_drive(arguments.drive), read_drive(arguments.source)
    output = Path(arguments.output)
    if output.exists():
        raise InputError(output, "", "a file that exists", "a new name, by -o FILE")
    found = calibrate(drawing, source, names)
    lost = [one.name for one in found.constants if not one.identified]
    if lost:
        raise InputError(
            source.file,
            "",
            f"a curve that does not identify {', '.join(lost)}",
            "fewer --constants, or a curve up to a higher torque",
        )
    answer = calibration_answer(found, source.name)
    heading = "".join(f"# {line}\n" for line in sentences(answer))
    write_whole(output, f"{heading}\n{format_toml(found.drive.document)}")
    answer["file"] = str(output)
    deliver(answer, arguments, lambda: show_calibration(answer))


def constant_names(text: str | None) -> tuple[str, ...]:
    """Read ``--constants``."""
    if text is None:
        return DEFAULT
    names = tuple(dict.fromkeys(text.split(",")))
    for name in names:
        if name not in CONSTANTS:
            expected = f"of {', '.join(CONSTANTS)}{did_you_mean(name, list(CONSTANTS))}"
            raise InputError("--constants", "", f"'{name}'", expected)
    return names


def calibration_answer(found: Calibration, source: str) -> dict[str, Any]:
    """Return the answer."""
    return {
        "schema": "lostmotion.calibration/1",
        "drive": found.drive.name,
        "source": source,
        "constants": [
            {"name": f"support.{one.name}", "value": one.value, "low": one.low, "high": one.high}
            for one in found.constants
        ],
        "reach_Nm": float(found.torque_Nm[-1]),
        "misfit_before_percent": found.misfit_percent(found.before_rad),
        "misfit_after_percent": found.misfit_percent(found.after_rad),
    }


def sentences(answer: dict[str, Any]) -> list[str]:
    """Describe the source of the constants, for the head of the file."""
    return [
        f"Calibrated to {answer['source']} up to {answer['reach_Nm']:.4g} Nm (lostmotion "
        "calibrate).",
        *(
            f"{one['name']} {one['value']:.4g}, 95 % interval of the misfit {one['low']:.4g} to "
            f"{one['high']:.4g}"
            for one in answer["constants"]
        ),
        f"misfit, rms, of the angle at {answer['reach_Nm']:.4g} Nm: "
        f"{answer['misfit_before_percent']:.1f} % before, "
        f"{answer['misfit_after_percent']:.1f} % after",
    ]


def show_calibration(answer: dict[str, Any]) -> None:
    """Print the calibrated constants."""
    rows = [
        [one["name"], *(f"{one[key]:.4g}" for key in ("value", "low", "high"))]
        for one in answer["constants"]
    ]
    show_table(["constant", "value", "95 % low", "high"], rows)
    print(f"\n{sentences(answer)[-1]}\n{answer['file']}")
