"""Drive file of a design, from the struct of the optimizer."""

from __future__ import annotations

from typing import Any

from lostmotion.structs import DISTRIBUTIONS, FIELDS, ZONES, DesignKey

EXACT = 1e17
"""Below this a file states a whole number without an exponent."""


def drive_document(drive: Any) -> dict[str, Any]:
    """Tables of the drive file that the optimizer writes of an `lm_drive`."""
    design = _table(drive, FIELDS[""])
    flanks = (drive.teeth.flexspline_flank, drive.teeth.rigid_flank)
    for section, keys in FIELDS.items():
        if section and (section != "flank" or any(flanks)):
            design[section] = _table(getattr(drive, section), keys)
    chains = {
        "radial_chain": [_law(drive.radial_laws[i]) for i in range(drive.radial_law_count)],
        "torsion_chain": [_spring(drive.torsion[i]) for i in range(drive.torsion_count)],
        "tolerance": [_link(drive.tolerances[i]) for i in range(drive.tolerance_count)],
    }
    design |= {name: entries for name, entries in chains.items() if entries}
    ratio, torque = _number(drive.ratio), _number(drive.rated_torque_Nm)
    return {
        "drive": {"name": "", "ratio": ratio, "rated_torque_Nm": torque},
        "design": design,
    }


def _number(value: float) -> float:
    """Value as it is read from a file, where a whole number is an integer."""
    return int(value) if value.is_integer() and abs(value) < EXACT else value


def _table(owner: Any, keys: tuple[DesignKey, ...]) -> dict[str, Any]:
    """Members of a struct by their keys."""
    table: dict[str, Any] = {}
    for key in keys:
        value = getattr(owner, key.written)
        if key.kind == "real":
            table[key.written] = _number(value)
        elif key.kind == "choice":
            table[key.written] = key.choices[value]
        else:
            table[key.written] = bool(value) if key.kind == "switch" else value
    return table


def _law(law: Any) -> dict[str, Any]:
    return {
        "kind": "power",
        "deflection_mm": _number(law.coefficient_mm_per_Nn),
        "force_N": 1,
        "exponent": _number(law.exponent),
        "share": _number(law.share),
        "preload_N": _number(law.preload_N),
    }


def _spring(spring: Any) -> dict[str, Any]:
    return {
        "kind": "stiffness",
        "stiffness_Nm_per_rad": _number(spring.stiffness_Nm_per_rad),
        "ratio": _number(spring.ratio),
    }


def _link(link: Any) -> dict[str, Any]:
    return {
        "kind": "link",
        "zone": ZONES[link.zone],
        "influence": _number(link.influence),
        "lower_mm": _number(link.lower_mm),
        "upper_mm": _number(link.upper_mm),
        "distribution": DISTRIBUTIONS[link.distribution],
    }
