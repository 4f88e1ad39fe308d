"""A drive of textbook proportions: start of a design, and a drive file with every key.

Internal teeth deformed outwards: Ivanov's recommendations, x1 = 3 + 0.01 z1, w0/m = 0.89 + 8e-5 z1,
x2 = x1 - 1 + (w0/m)(1 + 5e-5 z1 w0/m), engagement depth 4 w0/m - 2.48 - (4.6 - 4 w0/m) 1e-4 z1.
A ring wave generator about internal teeth: x = 3 and 3.05, w0/m = 0.95, depth 1.2, the published
reference of that kind. Values not given in the books are those of `USUAL`.

The books use a planar model. In a cup the deflection grows towards the open end, so teeth with
clearance in the middle interfere at the edges of the face: `textbook_drive` reduces the engagement
depth, increases the shift and reduces the rim thickness until the checks pass at both edges, as far
as possible.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from lostmotion.core import core
from lostmotion.drives import LEAST_TORQUE_NM, MOST_RATED_NM, parse_drive
from lostmotion.errors import InputError
from lostmotion.model import ADVICE, Check, DesignModel, design_model
from lostmotion.structs import FIELDS, GENERATORS, DesignKey, field_path

USUAL = {
    "teeth.pressure_angle_deg": 20.0,
    "teeth.tooth_height": 1.75,
    "generator.contact_half_angle_deg": 30.0,
}
"""Values of the usual drive of size 20."""

DIAMETER_PER_SIZE_MM = 2.5
"""Pitch diameter over catalogue size: 50 mm at size 20."""

TORQUE_PER_D3 = 40 / 50**3
"""Rated torque in N m over the cube of the pitch diameter in mm: 40 N m at size 20, 50 mm."""

RATIO_EXPONENT = 0.7
"""Exponent of the ratio in the rated torque, below ratio 100: catalogues state 15, 25, 34, 40 N m
at ratios 30, 50, 80, 100 for size 20. Above 100 the torque is constant.
"""

WIDTH_PER_D = 0.2
"""Face width over pitch diameter of usual drives."""

SECTIONS = int(core().lib.LM_FACE_SECTIONS)
"""Axial sections of a cup: the middle of the face and both edges."""

CLOSEST_ROLLERS = 20.0
"""Half angle between the rollers at which four of them bend the rim least for its deflection, deg.

A thin ring under four equal forces has 0.97 times the curvature of a cosine wave there, 1.14 times
at the usual 30 deg: largest of sum cos(n b) cos(n p) / (n^2 - 1) over p, over 3 sum
cos(n b) / (n^2 - 1)^2, n = 2, 4, ...
"""

DEPTH_LEAST = 0.3
"""Least engagement depth in modules: below it teeth ratchet before they carry load."""

RIM_LEAST = 0.005
"""Thinnest rim, in pitch diameters, of catalogue drives (0.25 mm at size 20)."""

USUAL_LENGTH, LONGEST = 0.45, 0.7
"""Cup from its bottom to the middle of the teeth, in pitch diameters: usual, and of long cups."""

SHIFT_MOST = 2.0
"""Largest increase of the shift, in modules."""

ROUNDS = 4
"""Depth and shift depend on each other weakly; they converge to 1e-3 modules in this number of
rounds.
"""

HALVINGS = 24
"""Bisections of an interval: 2 modules are reduced below 1e-6."""

DIGITS = 4
"""Decimals of a drawing in mm: 0.1 um."""


def textbook(teeth: float, external: bool, module_mm: float, ratio: float) -> dict[str, float]:
    """Textbook values, by dotted key of the search.

    Parameters
    ----------
    teeth : float
        Of the flexspline.
    external : bool
        Whether a ring deforms it inwards.
    module_mm, ratio : float
    """
    if external:
        x1, x2, kappa, depth = 3.0, 3.05, 0.95, 1.2
        # The ring deforms inwards: the second shift is that of the rigid gear.
    else:
        x1 = 3 + 0.01 * teeth
        kappa = 0.89 + 8e-5 * teeth
        x2 = x1 - 1 + kappa * (1 + 5e-5 * teeth * kappa)
        depth = 4 * kappa - 2.48 - (4.6 - 4 * kappa) * 1e-4 * teeth
    rim = (65 + 2.5 * abs(ratio) ** (2 / 3)) * 1e-4 * module_mm * teeth
    return {
        **USUAL,
        "teeth.flexspline_shift": x1,
        "teeth.rigid_shift": x2,
        "teeth.shift_difference": x2 - x1,
        "generator.deflection_modules": kappa,
        "generator.deflection_mm": kappa * module_mm,
        "teeth.engagement_depth": depth,
        "flexspline.rim_thickness_mm": rim,
        "flexspline.wall_thickness_mm": 0.6 * rim,
    }


def textbook_drive(
    size: float,
    ratio: int,
    generator: str = "discs",
    name: str = "",
    rated_torque_Nm: float | None = None,
) -> tuple[dict[str, Any], list[Check]]:
    """Return the document of a drive of textbook proportions, and the checks that fail.

    Parameters
    ----------
    size : float
        As in catalogues: the pitch diameter is 2.5 mm times it.
    ratio : int
        Input turns for one output turn; the flexspline is the output, or with a ring the rigid
        gear.
    generator : str
        One of `GENERATORS`.
    name : str
        Of the drive.
    rated_torque_Nm : float, optional
        Of a data sheet, for instance. By default the catalogue value for the cube of the diameter.

    Returns
    -------
    document : dict
        Tables of a drive file.
    broken : list of Check
        Checks that no change of engagement depth, shift and rim thickness satisfies.

    Raises
    ------
    InputError
        For a size or ratio that the library's ranges exclude.
    """
    external = generator == "ring"
    teeth = 2 * ratio + (2 if external else 0)
    diameter = DIAMETER_PER_SIZE_MM * size
    module = diameter / teeth
    book = textbook(teeth, external, module, ratio)
    table = {
        "deformation": "external" if external else "internal",
        "module_mm": round(module, 2 * DIGITS),
        "flexspline_teeth": teeth,
        "rigid_teeth": teeth + (-2 if external else 2),
        "pressure_angle_deg": book["teeth.pressure_angle_deg"],
        "flexspline_shift": round(book["teeth.flexspline_shift"], DIGITS),
        "rigid_shift": round(book["teeth.rigid_shift"], DIGITS),
        "tooth_height": book["teeth.tooth_height"],
        "engagement_depth": round(book["teeth.engagement_depth"], DIGITS),
        "face_width_mm": round(WIDTH_PER_D * diameter, 1),
    }
    wave: dict[str, Any] = {
        "type": generator,
        "deflection_mm": round(book["generator.deflection_mm"], DIGITS),
    }
    if generator in ("discs", "rollers", "ring"):
        wave["contact_half_angle_deg"] = book["generator.contact_half_angle_deg"]
    if rated_torque_Nm is None:
        usual = TORQUE_PER_D3 * diameter**3 * min(1.0, ratio / 100) ** RATIO_EXPONENT
        rated_torque_Nm = float(f"{usual:.3g}")
    document = {
        "drive": {"name": name, "ratio": ratio, "rated_torque_Nm": rated_torque_Nm},
        "design": {
            "axial_sections": SECTIONS,
            "teeth": table,
            "generator": wave,
            "flexspline": {
                "rim_thickness_mm": round(book["flexspline.rim_thickness_mm"], DIGITS),
            },
        },
    }
    _mend(document)
    return document, [
        check
        for check in design_model(parse_drive(document)).checks()
        if check.margin < 0 and check.name not in ADVICE
    ]


def _mend(document: dict[str, Any]) -> None:
    """Change depth, shift, rim, cup and rollers until form radius, gaps and fatigue pass."""
    design = document["design"]
    teeth, rim = design["teeth"], design["flexspline"]
    shift = "flexspline_shift" if teeth["deformation"] == "external" else "rigid_shift"
    depth, opened, thick = teeth["engagement_depth"], teeth[shift], rim["rim_thickness_mm"]
    diameter = teeth["module_mm"] * teeth["flexspline_teeth"]

    def margin(check: str, table: dict[str, Any], key: str) -> Callable[[float], float]:
        def at(value: float) -> float:
            table[key] = value
            found = DesignModel(parse_drive(document).design).checks()  # type: ignore[arg-type]
            return next(one.margin for one in found if one.name == check)

        return at

    for _ in range(ROUNDS):
        _nearest(margin("form_radius", teeth, "engagement_depth"), depth, DEPTH_LEAST)
        _nearest(margin("smallest_gap", teeth, shift), opened, opened + SHIFT_MOST)
    fatigue = margin("safety_factor", rim, "rim_thickness_mm")
    _nearest(fatigue, thick, RIM_LEAST * diameter)
    if fatigue(rim["rim_thickness_mm"]) < 0:
        # The edge of a longer cup opens less.
        shortest = USUAL_LENGTH * diameter
        _nearest(margin("safety_factor", rim, "length_mm"), shortest, LONGEST * diameter)
    wave = design["generator"]
    if wave["type"] == "rollers":
        spread = wave["contact_half_angle_deg"]
        _nearest(margin("safety_factor", wave, "contact_half_angle_deg"), spread, CLOSEST_ROLLERS)


def _nearest(margin: Callable[[float], float], start: float, end: float) -> None:
    """Return the value nearest to `start` that passes the check; `end` if none does."""
    if margin(start) >= 0:
        return
    kept, broken = end, start
    for _ in range(HALVINGS):
        middle = (kept + broken) / 2
        kept, broken = (middle, broken) if margin(middle) >= 0 else (kept, middle)
    step = 10.0**-DIGITS  # rounded towards the side that passes
    digits = round(kept / step + (0.5 if end > start else -0.5)) * step
    margin(round(digits, DIGITS))


def annotated_drive_file(document: dict[str, Any], heading: str) -> str:
    """Write a drive file with every key of a design, its range and its meaning.

    Keys that the document does not state are comments with their default values.
    """
    drive = parse_drive(document)
    taken = design_model(drive).defaults()
    design = document["design"]
    lines = [f"# {line}" if line else "#" for line in heading.splitlines()]
    lines += ["[drive]", *(f"{key} = {_toml(value)}" for key, value in document["drive"].items())]
    for section in ("", *(name for name in FIELDS if name)):
        table = design.get(section, {}) if section else design
        lines += ["", f"[design.{section}]" if section else "[design]"]
        for key in FIELDS[section]:
            lines.append(f"# {key.meaning} [{_allowed(key)}]")
            written = next((w for w in (key.written, f"{key.name}_deg") if w in table), None)
            if written is not None:
                lines.append(f"{written} = {_toml(table[written])}")
                continue
            value = taken.get(f"design.{field_path(section, key)}")
            lines.append(f"# {key.written} = {'' if value is None else _toml(value)}".rstrip(" ="))
    return "\n".join(lines) + "\n"


def _allowed(key: DesignKey) -> str:
    """Describe the permitted values of a key."""
    if key.kind == "choice":
        return "one of " + ", ".join(key.choices)
    return "true or false" if key.kind == "switch" else key.range


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return f'"{value}"'
    return f"{value:.10g}"


class Words(NamedTuple):
    """What ``lostmotion new`` was asked for."""

    size: float = 20.0
    ratio: int = 100
    generator: str = "discs"
    name: str = ""
    rated_torque_Nm: float | None = None


def parse_words(words: list[str]) -> Words:
    """Read ``size-20 ratio-100 torque-40 discs NAME``: each may be left out, in any order.

    Raises
    ------
    InputError
        For a repeated word, or a size, ratio or torque that is not a number in its range.
    """
    found: dict[str, str] = {}
    for word in words:
        kind, dash, value = word.partition("-")
        if word in GENERATORS:
            kind, value = "wave generator", word
        elif kind not in ("size", "ratio", "torque") or not dash:
            kind, value = "name", word
        if kind in found:
            raise InputError("new", kind, f"'{found[kind]}' and '{value}'", f"one {kind}")
        found[kind] = value
    asked = Words()
    try:
        size = float(found.get("size", asked.size))
        ratio = int(found.get("ratio", asked.ratio))
        torque = float(found["torque"]) if "torque" in found else None
    except ValueError:
        said = " ".join(words)
        expected = "numbers, as in size-20 ratio-100 torque-40 (N m)"
        raise InputError("new", "", f"'{said}'", expected) from None
    if not SIZES[0] <= size <= SIZES[1]:
        raise InputError("new", "size", f"{size:g}", f"{SIZES[0]} to {SIZES[1]}")
    if not RATIOS[0] <= ratio <= RATIOS[1]:
        raise InputError("new", "ratio", f"{ratio}", f"{RATIOS[0]} to {RATIOS[1]}")
    if torque is not None and not LEAST_TORQUE_NM <= torque <= MOST_RATED_NM:
        expected = f"{LEAST_TORQUE_NM:g} to {MOST_RATED_NM:g} N m"
        raise InputError("new", "torque", f"{torque:g}", expected)
    generator = found.get("wave generator", asked.generator)
    return Words(size, ratio, generator, found.get("name", asked.name), torque)


SIZES = (3, 200)
"""Sizes of a drive: pitch diameters of 7.5 to 500 mm."""

RATIOS = (30, 319)
"""Ratios that the numbers of teeth allow, including those of a ring."""
