"""One drive for three implementations: the library's struct as inputs of both NumPy versions."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import plain_numpy
import tuned_numpy

from lostmotion import structs
from lostmotion.core import Core
from lostmotion.drives import parse_drive
from lostmotion.structs import Design

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

DRIVES = Path(__file__).parents[1] / "data" / "drives"

SUPPORT = {"foundation_N_per_mm2": 2600.0, "ring_stiffness_N_mm2": 350000.0}
"""Foundation and ring as published for reference design A. Both NumPy versions have a foundation
that is equal under all teeth, so a drive without one gets this one in all three."""


def read_design(name: str) -> Design:
    """Read a designed drive of the tests, with its support stated."""
    document = tomllib.loads((DRIVES / f"{name}.toml").read_text(encoding="utf-8"))
    document["design"].setdefault("support", SUPPORT)
    design = parse_drive(document, name).design
    assert design is not None
    return design


def library_drive(name: str, core: Core) -> Any:
    """Read a designed drive into the library's struct, defaults filled in."""
    return structs.make_drive(read_design(name), 64 if core.bits == 64 else 32)


def generator_name(drive: Any) -> str:
    """Name of the wave generator's type."""
    return structs.GENERATORS[drive.generator.type]


def plain_design(drive: Any, core: Core) -> plain_numpy.Design:
    """Return a drive as plain_numpy takes it."""
    teeth, steel, support = drive.teeth, drive.material, drive.support
    if support.tooth_compliance_mm_per_N > 0 or drive.axial_sections > 1:
        raise ValueError("plain_numpy is planar and computes the compliance of the teeth")
    if support.foundation_N_per_mm2 == 0:
        raise ValueError("plain_numpy has one foundation under all teeth, which has to be stated")
    laws = (drive.radial_laws[i] for i in range(drive.radial_law_count))
    springs = (drive.torsion[i] for i in range(drive.torsion_count))
    return plain_numpy.Design(
        external=teeth.deformation == core.lib.LM_EXTERNAL,
        generator=generator_name(drive),
        beta=drive.generator.contact_half_angle_rad,
        deflection=drive.generator.deflection_mm,
        module=teeth.module_mm,
        flexspline_teeth=teeth.flexspline_teeth,
        rigid_teeth=teeth.rigid_teeth,
        alpha=teeth.pressure_angle_rad,
        flexspline_shift=teeth.flexspline_shift,
        rigid_shift=teeth.rigid_shift,
        addendum=teeth.rack_addendum,
        root_clearance=teeth.root_clearance,
        height=teeth.tooth_height,
        depth=teeth.engagement_depth,
        width=teeth.face_width_mm,
        rim=drive.flexspline.rim_thickness_mm,
        wall=drive.flexspline.wall_thickness_mm,
        rated_torque=drive.rated_torque_Nm,
        youngs=steel.youngs_modulus_MPa,
        shear=steel.shear_modulus_MPa,
        poisson=steel.poisson_ratio,
        bending_fatigue=steel.bending_fatigue_MPa,
        shear_fatigue=steel.shear_fatigue_MPa,
        bending_notch=steel.bending_notch_factor,
        shear_notch=steel.shear_notch_factor,
        mean_stress=steel.mean_stress_factor,
        tooth_stress=steel.tooth_stress_factor,
        foundation=support.foundation_N_per_mm2,
        ring_stiffness=support.ring_stiffness_N_mm2,
        ring_factor=support.ring_factor,
        engagement_limit=support.engagement_limit_rad,
        gap_limit=support.gap_limit_rad,
        radial_gap=core.lib.lm_mean_radial_gap(drive),
        gap_stiffness=drive.gap.ring_stiffness_N_per_mm,
        radial_laws=tuple(
            (law.coefficient_mm_per_Nn, law.exponent, law.share, law.preload_N) for law in laws
        ),
        torsion=tuple((spring.stiffness_Nm_per_rad, spring.ratio) for spring in springs),
    )


def tuned_design(drive: Any, core: Core) -> dict[str, Any]:
    """Return a drive as tuned_numpy takes it.

    The clearances are the same; the rest differs a little: tuned_numpy has plane stress in the
    teeth, another mean flank angle and radius, and counts gaps from zero to the gap limit.
    """
    plain = plain_design(drive, core)
    if any(exponent != 1 for _, exponent, _, _ in plain.radial_laws):
        raise ValueError("tuned_numpy gets springs for the radial chain")
    springs = tuple(
        {"kind": "spring", "stiffness_N_per_mm": 1 / (coefficient * share)}
        for coefficient, _, share, _ in plain.radial_laws
    )
    bare = plain.youngs * plain.width * plain.rim**3 / 12
    bare /= tuned_numpy.POINT_RING * plain_numpy.radii(plain)["neutral"] ** 3
    return {
        "module_mm": plain.module,
        "flexspline_teeth": plain.flexspline_teeth,
        "rigid_teeth": plain.rigid_teeth,
        "pressure_angle_deg": np.degrees(plain.alpha),
        "flexspline_shift": plain.flexspline_shift,
        "rigid_shift": plain.rigid_shift,
        "tooth_height": plain.height,
        "engagement_depth": plain.depth,
        "root_clearance": plain.root_clearance,
        "root_tip_clearance": 0.2,
        "face_width_mm": plain.width,
        "generator": plain.generator,
        "deflection_mm": plain.deflection,
        "contact_half_angle_deg": np.degrees(plain.beta),
        "rim_thickness_mm": plain.rim,
        "wall_thickness_mm": plain.wall,
        "wall_radius_mm": plain_numpy.radii(plain)["neutral"],
        "rated_torque_Nm": plain.rated_torque,
        "radial_gap_mm": plain.radial_gap,
        "ring_stiffening": plain.gap_stiffness / bare,
        "pair_compliance_mm_per_N": None,
        "foundation_N_per_mm2": plain.foundation,
        "ring_bending_N_mm2": plain.ring_stiffness,
        "radial_factor": plain.ring_factor,
        "radial_chain": springs,
        "torsion_chain": tuple(
            {"stiffness_Nm_per_rad": stiffness * ratio**2} for stiffness, ratio in plain.torsion
        ),
        "young_MPa": plain.youngs,
        "shear_MPa": plain.shear,
        "poisson": plain.poisson,
        "fatigue_bending_MPa": plain.bending_fatigue,
        "fatigue_shear_MPa": plain.shear_fatigue,
        "notch_bending": plain.bending_notch,
        "notch_shear": plain.shear_notch,
        "mean_stress_bending": plain.mean_stress,
        "mean_stress_shear": 0.1,
        "tooth_factor": plain.tooth_stress,
        "safety_factor_min": 1.5,
        "gap_min_arcmin": 0.0,
    }
