"""Quantities of a gear drawing: diameters, span and pin measure, tolerances."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from lostmotion.model import DesignModel
from lostmotion.report.gear_profiles import GearProfile, gear_profiles
from lostmotion.report.mesh import make_mesh
from lostmotion.zero_crossing import zero_between

PIN_STEP_MM = 0.01
"""Measuring pins are sold in steps of a hundredth."""

MODULE_DIGITS = 8
"""Decimals of the module, which is multiplied by the number of teeth: all that `new` writes."""


@dataclass(frozen=True)
class Row:
    """One line of a drawing table."""

    key: str
    meaning: str
    unit: str
    flexspline: float
    rigid: float
    digits: int = 4


def involute(angle_rad: float) -> float:
    """Return tan a - a."""
    return math.tan(angle_rad) - angle_rad


def angle_of_involute(value: float) -> float:
    """Angle whose involute this is; the value must be positive."""
    return zero_between(lambda a: involute(a) - value, 0.0, 1.5, 1e-14)


@dataclass(frozen=True)
class PinMeasure:
    """Measure over (external) or between (internal gear) two pins; even tooth numbers."""

    diameter_mm: float
    measure_mm: float
    contact_radius_mm: float


def pin_measure(model: DesignModel, profile: GearProfile) -> PinMeasure:
    """Measure with the pins that touch the flanks in the middle between form and tip circle."""
    teeth = model.drive.teeth
    alpha, m = float(teeth.pressure_angle_rad), float(teeth.module_mm)
    base = m * profile.teeth / 2.0 * math.cos(alpha)
    half = base_half_angle(model, profile)
    if not profile.internal:
        half = math.pi / profile.teeth - half  # of the space
    side = -1.0 if profile.internal else 1.0
    contact = (profile.form_radius_mm + profile.tip_mm) / 2.0
    tangent = math.sqrt(contact**2 - base**2)

    def centre(pin: float) -> float:
        return math.atan((tangent + side * pin / 2.0) / base)

    def missing(pin: float) -> float:
        return involute(centre(pin)) - side * (pin / (2.0 * base) - half)

    pin = zero_between(missing, 0.0, 2.0 * tangent if profile.internal else 20.0 * m, 1e-12)
    pin = math.ceil(pin / PIN_STEP_MM - 1e-9) * PIN_STEP_MM
    at = angle_of_involute(side * (pin / (2.0 * base) - half))
    reach = base / math.cos(at)
    touched = math.hypot(base, base * math.tan(at) - side * pin / 2.0)
    return PinMeasure(pin, 2.0 * reach + side * pin, touched)


def base_half_angle(model: DesignModel, profile: GearProfile) -> float:
    """Half angle on the base circle of a tooth (external) or space (internal)."""
    teeth = model.drive.teeth
    shift = teeth.flexspline_shift if profile.name == "flexspline" else teeth.rigid_shift
    alpha = float(teeth.pressure_angle_rad)
    return (
        math.pi / (2 * profile.teeth)
        + 2.0 * float(shift) * math.tan(alpha) / profile.teeth
        + involute(alpha)
    )


def span_measure(model: DesignModel, profile: GearProfile) -> tuple[int, float] | None:
    """Base tangent length over k teeth of an external gear; None if no k touches the flanks."""
    if profile.internal:
        return None
    best: tuple[float, int, float] | None = None
    teeth = model.drive.teeth
    alpha, m = float(teeth.pressure_angle_rad), float(teeth.module_mm)
    base = m * profile.teeth / 2.0 * math.cos(alpha)
    half = base_half_angle(model, profile)
    middle = (profile.form_radius_mm + profile.tip_mm) / 2.0
    for k in range(2, profile.teeth // 2):
        width = base * (2.0 * half + (k - 1) * 2.0 * math.pi / profile.teeth)
        touched = math.hypot(base, width / 2.0)
        apart = abs(touched - middle)
        inside = profile.form_radius_mm <= touched <= profile.tip_mm
        if inside and (best is None or apart < best[0]):
            best = (apart, k, width)
    return None if best is None else (best[1], best[2])


def drawing_table(model: DesignModel) -> list[Row]:
    """Rows of the table: undeformed flexspline and rigid gear; NaN if a gear has no value."""
    drive = model.drive
    teeth = drive.teeth
    gears = gear_profiles(model)
    # both measures, base circle and pressure angle require involutes
    mesh = make_mesh(model).mesh
    involute_flank = model.core.lib.LM_FLANK_INVOLUTE
    involutes = [kind == involute_flank for kind in (mesh.flank.kind, mesh.rigid_kind)]
    each = list(zip(gears, involutes, strict=True))
    spans = [span_measure(model, gear) if has else None for gear, has in each]
    pins = [pin_measure(model, gear) if has else None for gear, has in each]
    m, alpha = float(teeth.module_mm), float(teeth.pressure_angle_rad)
    base = [m * gear.teeth * math.cos(alpha) if has else None for gear, has in each]
    angle = [math.degrees(alpha) if has else None for has in involutes]

    def row(key: str, meaning: str, unit: str, values: list[Any], digits: int = 4) -> Row:
        first, second = (math.nan if v is None else float(v) for v in values)
        return Row(key, meaning, unit, first, second, digits)

    return [
        row("z", "number of teeth", "", [g.teeth for g in gears], 0),
        row("m", "module", "mm", [m, m], MODULE_DIGITS),
        row("alpha", "pressure angle of the basic rack", "deg", angle),
        row("x", "profile shift", "modules", [teeth.flexspline_shift, teeth.rigid_shift]),
        row("d", "reference diameter", "mm", [m * g.teeth for g in gears]),
        row("d_b", "base diameter", "mm", base),
        row("d_a", "tip diameter", "mm", [2 * g.tip_mm for g in gears]),
        row("d_f", "root diameter", "mm", [2 * g.root_mm for g in gears]),
        row("d_Ff", "form diameter of the root", "mm", [2 * g.form_radius_mm for g in gears]),
        row("rho_f", "radius of the root fillet", "mm", [g.fillet_radius_mm for g in gears]),
        row("h", "tooth depth", "mm", [abs(g.tip_mm - g.root_mm) for g in gears]),
        row("b", "face width", "mm", [teeth.face_width_mm] * 2),
        row("k", "teeth spanned", "", [s and s[0] for s in spans], 0),
        row("W_k", "span measure over k teeth", "mm", [s and s[1] for s in spans]),
        row("D_M", "diameter of the measuring pins", "mm", [p and p.diameter_mm for p in pins], 2),
        row("M_d", "measure over or between two pins", "mm", [p and p.measure_mm for p in pins]),
        row("s", "rim thickness", "mm", [drive.flexspline.rim_thickness_mm, None]),
        row("w_0", "deflection by the wave generator", "mm", [drive.generator.deflection_mm, None]),
    ]


def shown(value: float, digits: int) -> str:
    """Write a number of the table."""
    return "-" if np.isnan(value) else f"{value:.{digits}f}"
