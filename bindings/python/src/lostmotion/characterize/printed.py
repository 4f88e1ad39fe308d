"""Standard figures as printed: names and significant digits."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from lostmotion.units import plain_number

NAMES = {
    "T1_Nm": "T1, N m",
    "K1_Nm_per_rad": "K1, N m/rad",
    "T2_Nm": "T2, N m",
    "K2_Nm_per_rad": "K2, N m/rad",
    "K3_Nm_per_rad": "K3, N m/rad",
    "lost_motion_3_percent_arcmin": "lost motion at 3 %, arcmin",
    "lost_motion_4_percent_arcmin": "lost motion at 4 %, arcmin",
    "hysteresis_loss_arcmin": "hysteresis loss, arcmin",
    "backlash_arcmin": "backlash, arcmin",
}
"""Printed names of the figures of an answer."""


def flat(answer: Mapping[str, Any]) -> dict[str, Any]:
    """Figures of an answer by the keys of `NAMES`."""
    known = {**answer["torsion_curve"], **answer}
    return {key: known[key] for key in NAMES}


def cells(found: Mapping[str, Any]) -> list[str]:
    """Format a figure with two digits of its standard error."""
    value, error = found["value"], found.get("standard_error")
    if value is None:
        return ["-", "-", "-"]
    if not error:
        return [plain_number(value, 4), "-", "-"]
    digits = max(0, 1 - int(np.floor(np.log10(error))))
    ends = found["interval_95"]
    span = "-"
    if ends is not None:
        low, high = ("-" if end is None else f"{end:.{digits}f}" for end in ends)
        span = f"above {low}" if high == "-" else f"{low} to {high}"
    return [f"{value:.{digits}f}", f"{error:.{digits}f}", span]
