"""The commands ``lostmotion predict`` and ``lostmotion clearances``."""

from __future__ import annotations

import argparse
import math
from typing import Any

import numpy as np

from lostmotion.allocation import cheapest_tolerances
from lostmotion.drives import MOST_TORQUE_NM, read_drive
from lostmotion.errors import InputError, one_line
from lostmotion.model import ADVICE, Check, check_meanings
from lostmotion.options import read_number, whole_number
from lostmotion.predict import BEYOND, clearances, predict, show_default
from lostmotion.terminal import deliver, fixed, show_list, show_table

DEFAULT_TORQUES = 33
"""Default torques of a prediction: from minus to plus the rated torque."""

TORQUES_MAX = 100_001
"""Largest number of torques of a prediction."""

TARGET_MAX_ARCMIN = 600.0
"""Largest target of the lost motion: ten degrees."""

PHASE_MAX_DEG = 360.0
"""Largest tooth phase; it repeats with every tooth."""

ANGLE_MAX_DEG = 90.0
"""Teeth of one lobe are within this angle of the deformation axis."""


def torque_range(text: str | None, rated_Nm: float) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Read ``MIN:MAX:N``; without it, plus and minus the rated torque."""
    if text is None:
        return np.linspace(-rated_Nm, rated_Nm, DEFAULT_TORQUES)
    expected = f"MIN:MAX:N in Nm, MIN below MAX, N from 2 to {TORQUES_MAX}; or T:T:1"
    parts = text.split(":")
    if len(parts) != 3:
        raise InputError("--torque", "", f"'{text}'", expected)
    low, high = (read_number("--torque", part, MOST_TORQUE_NM) for part in parts[:2])
    spaced = np.linspace(low, high, whole_number("--torque", parts[2], 1, TORQUES_MAX))
    if (spaced.size == 1) != (low == high) or not np.all(np.diff(spaced) > 0):
        raise InputError("--torque", "", f"'{text}'", expected)
    return spaced


def run_predict(arguments: argparse.Namespace) -> None:
    """``lostmotion predict``."""
    if len(arguments.drive) > 1 or arguments.table is not None or arguments.sweep is not None:
        from lostmotion.commands.side_by_side import run_table

        run_table(arguments)
        return
    drive = read_drive(arguments.drive[0])
    if arguments.sensitivity and drive.design is None:
        expected = "[design]: --sensitivity is to its dimensions"
        raise InputError(drive.file, "design", "no such table", expected)
    phase = math.radians(read_number("--phase-deg", arguments.phase_deg, PHASE_MAX_DEG))
    answer = predict(drive, torque_range(arguments.torque, drive.rated_torque_Nm), phase)
    if arguments.target is not None:
        target = read_number("--target", arguments.target, TARGET_MAX_ARCMIN)
        answer["allocation"] = cheapest_tolerances(drive, target, arguments.target_level)
    if arguments.report is not None:
        from lostmotion.report import drive_section, write_report

        lead = "Behaviour of the drive, predicted from its drive file."
        section = drive_section(drive, phase)
        write_report(
            arguments.report, "Predicted lost motion", lead, [section], arguments.command_line
        )
    deliver(answer, arguments, lambda: show_prediction(answer, arguments.sensitivity))


def run_clearances(arguments: argparse.Namespace) -> None:
    """``lostmotion clearances``."""
    drive = read_drive(arguments.drive)
    phase = math.radians(read_number("--phase-deg", arguments.phase_deg, PHASE_MAX_DEG))
    angles = None
    if arguments.angles_deg is not None:
        texts = arguments.angles_deg.split(",")
        angles = np.radians([read_number("--angles-deg", text, ANGLE_MAX_DEG) for text in texts])
    answer = clearances(drive, phase, angles)
    deliver(answer, arguments, lambda: show_clearances(answer))


def show_sensitivity(rows: list[dict[str, Any]]) -> None:
    """Print the sensitivity to each dimension, and the range in which it holds."""
    head = ["dimension", "value", "lost motion arcmin", "holds from", "to", "tangent Nm/rad"]
    keys = ("lost_motion_arcmin", "holds_from", "holds_to", "stiffness_Nm_per_rad", "stress")
    digits = {"value": 5, "holds_from": 5, "holds_to": 5}
    print("\nchange per unit of a dimension (per module, per mm):\n")

    def written(row: dict[str, Any], key: str) -> str:
        return "-" if row[key] is None else f"{row[key]:.{digits.get(key, 4)}g}"

    show_table(
        [*head, "1 / safety"],
        [[r["key"], *(written(r, key) for key in ("value", *keys))] for r in rows],
    )
    if any(r["holds_from"] is not None or r["holds_to"] is not None for r in rows):
        print(
            '\nOutside "holds from" and "to" the lost motion has another slope, because other '
            "teeth or another part of the face touch: use --sweep there."
        )


def show_prediction(answer: dict[str, Any], sensitivity: bool = False) -> None:
    """Print a prediction as a table."""
    print(f"{one_line(answer['drive'])} ({answer['kind']}): one-sided deflection in arcmin\n")
    parts = answer["parts_arcmin"]
    fitted = answer.get("fitted_arcmin")
    head = [
        "torque Nm",
        *(["fitted"] if fitted else []),
        "total",
        *(part.replace("_", " ") for part in parts),
        "teeth/lobe",
    ]
    rows = [
        [
            fixed(torque, 2),
            *([fixed(fitted[i])] if fitted else []),
            fixed(answer["total_arcmin"][i]),
            *(fixed(parts[part][i]) for part in parts),
            fixed(answer["engaged_teeth_per_lobe"][i], 0),
        ]
        for i, torque in enumerate(answer["torque_Nm"])
    ]
    show_table(head, rows)
    print(
        f"\nreversal lost motion at +-{answer['reversal_torque_Nm']:.3g} Nm: "
        f"{answer['reversal_lost_motion_arcmin']:.3f} arcmin"
    )
    print(
        f"stiffness, secant from {answer['reversal_torque_Nm']:.3g} to "
        f"{answer['rated_torque_Nm']:.3g} Nm: {answer['secant_stiffness_Nm_per_rad']:.5g} Nm/rad"
    )
    beyond = [t for t in answer["torque_Nm"] if abs(t) > answer.get("ratcheting_torque_Nm", abs(t))]
    if beyond:
        print(f"{len(beyond)} torques: {BEYOND.format(answer['ratcheting_torque_Nm'])}")
    tolerance = answer["tolerance_um"]
    if answer["defaults"].get("design.tolerance") == "none":
        print("no tolerances are stated: the radial gap is nominal")
    elif tolerance["worst_max"] is not None:
        lost = answer["tolerance_lost_motion_arcmin"]
        whole = answer["reversal_lost_motion_by_tolerance_arcmin"]
        for kind in ("worst", "probable"):
            print(
                f"radial gap from tolerances, {kind}: {tolerance[f'{kind}_min']:.1f} to "
                f"{tolerance[f'{kind}_max']:.1f} um, alone {lost[f'{kind}_min']:.3f} to "
                f"{lost[f'{kind}_max']:.3f} arcmin in one direction; reversal lost motion with it "
                f"up to {whole[kind]:.3f} arcmin"
            )
        show_budget(answer["tolerance_budget"])
    if "allocation" in answer:
        show_allocation(answer["allocation"])
    failed = [Check(**check) for check in answer.get("checks", []) if check["margin"] < 0]
    meanings = check_meanings() if failed else {}
    for check in failed:
        kind = "recommendation not met" if check.name in ADVICE else "check failed"
        unit, value, limit, margin = check.shown()
        size = f"{value:.4g} {unit}".rstrip()
        print(
            f"{kind}: {check.name} {size}, limit {limit:.4g}, margin {margin:.4g} "
            f"({meanings[check.name]})"
        )
    for hint in answer.get("hints", []):
        print(f"hint: {hint}")
    if sensitivity:
        show_sensitivity(answer["sensitivity"])
    defaults = (f"{key} = {show_default(value)}" for key, value in answer["defaults"].items())
    show_list("default values", defaults)
    show_list("assumed", answer["assumptions"])


def show_budget(budget: list[dict[str, Any]]) -> None:
    """Print the share of each tolerance in the limits."""
    if not budget:
        return
    head = ["tolerance", "zone", "influence", "lower um", "upper um", "worst %", "probable %"]
    rows = [
        [
            one_line(link["name"]),
            link["zone"],
            fixed(link["influence"]),
            fixed(link["lower_um"], 1),
            fixed(link["upper_um"], 1),
            fixed(link["worst_percent"], 0),
            fixed(link["probable_percent"], 0),
        ]
        for link in budget
    ]
    print()
    show_table(head, rows)
    print()


def show_allocation(found: dict[str, Any]) -> None:
    """Print the cheapest grades that meet a target."""
    print(
        f"\ncheapest grades for a reversal lost motion of {found['target_arcmin']:.3f} arcmin, "
        f"{found['level']}: {found['then_arcmin']:.3f} arcmin (now {found['now_arcmin']:.3f}), "
        f"cost {found['cost_then']:.3f} (now {found['cost_now']:.3f})\n"
    )
    head = ["feature", "now", "cheapest", "field now um", "field um", "cost now", "cost"]
    keys = ("field_now_um", "field_um", "cost_now", "cost")
    rows = [
        [one_line(f["name"]), f["now"], f["cheapest"], *(fixed(f[key], 2) for key in keys)]
        for f in found["features"]
    ]
    show_table(head, rows)


def show_clearances(answer: dict[str, Any]) -> None:
    """Print clearances as a table."""
    name = one_line(answer["drive"])
    print(f"{name}: side clearance in arcmin (negative: interference)\n")
    rows = [
        [
            str(answer["section"][i]),
            fixed(angle, 2),
            fixed(answer["forward_arcmin"][i]),
            fixed(answer["backward_arcmin"][i]),
            fixed(answer["contact_radius_mm"][i]),
        ]
        for i, angle in enumerate(answer["angle_deg"])
        if answer["overlap"][i]
    ]
    show_table(["section", "angle deg", "forward", "backward", "contact radius mm"], rows)
    apart = answer["overlap"].count(False)
    if apart:
        print(f"\n{apart} teeth without overlap are not listed")
