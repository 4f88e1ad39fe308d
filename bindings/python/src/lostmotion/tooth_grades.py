"""Tooth grades of ISO 1328-1:2013: run-out, and tool infeed for the tooth thickness.

The standard applies from modules of 0.5 mm and forbids extrapolation below; here its formula is
used for all modules. It has no tolerance of the thickness, which follows from run-out and infeed,
ISO/TR 10064-2. The run-out was compared with open implementations of the standard; no open source
was found for the infeed.
"""

from __future__ import annotations

import math

from lostmotion.tolerance_classes import field_um

GRADES = (4, 9)
"""Tooth grades whose infeed ISO/TR 10064-2 states."""

INFEED = {4: (1.26, 7), 5: (1.0, 8), 6: (1.26, 8), 7: (1.0, 9), 8: (1.26, 9), 9: (1.0, 10)}
"""Tolerance of the radial infeed b_r by tooth grade: a factor, and a grade of ISO 286 whose field
of the reference diameter it multiplies; ISO/TR 10064-2."""


def runout_um(diameter_mm: float, module_mm: float, grade: int) -> float:
    """Run-out tolerance ``F_rT = 0.9 (0.002 d + 0.55 sqrt(d) + 0.7 m + 12) sqrt(2)^(A - 5)``."""
    pitch = 0.002 * diameter_mm + 0.55 * math.sqrt(diameter_mm) + 0.7 * module_mm + 12.0
    return rounded(0.9 * pitch * math.sqrt(2.0) ** (grade - 5))


def rounded(value_um: float) -> float:
    """Round as the standard does: to 1 um above 10 um, to 0.5 um from 5 um, to 0.1 um below."""
    step = 1.0 if value_um > 10.0 else 0.5 if value_um >= 5.0 else 0.1
    return round(round(value_um / step) * step, 1)


def infeed_um(diameter_mm: float, grade: int) -> float:
    """Tolerance b_r of the radial infeed.

    With the run-out it gives the tolerance of the thickness, ``T_s = 2 tan(alpha) sqrt(F_r^2 +
    b_r^2)``.
    """
    factor, it_grade = INFEED[grade]
    return factor * field_um(diameter_mm, it_grade)
