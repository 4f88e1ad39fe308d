"""The drives on the rig, and the data in their catalogues."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .mechanics import ARCSEC, Drive, quasi_static


@dataclass(frozen=True)
class Size:
    """A catalogue row: torques in N m, stiffnesses in 1000 N m/rad."""

    size: int
    ratio: int
    rated_torque_Nm: float
    corners_Nm: tuple[float, float]
    stiffness: tuple[float, float, float]


SIZES = (
    Size(14, 100, 7.8, (2.0, 6.9), (4.7, 6.1, 7.1)),
    Size(17, 80, 22.0, (3.9, 12.0), (10.0, 14.0, 16.0)),
    Size(20, 100, 40.0, (7.0, 25.0), (16.0, 25.0, 29.0)),
    Size(25, 120, 67.0, (14.0, 48.0), (31.0, 50.0, 57.0)),
    Size(32, 160, 137.0, (29.0, 108.0), (67.0, 110.0, 120.0)),
    Size(40, 100, 265.0, (54.0, 196.0), (130.0, 200.0, 230.0)),
    Size(25, 50, 39.0, (14.0, 48.0), (25.0, 34.0, 44.0)),
    Size(32, 80, 118.0, (29.0, 108.0), (67.0, 110.0, 120.0)),
)
"""Corners and stiffnesses are those of the catalogue of strain-wave component sets (sizes 14 to 40,
ratios 50 and above); rated torques those of its rating table at 2000 revolutions a minute."""

PAIRS = 32
SLIPS = 8


def build_drive(size: Size, chance: np.random.Generator) -> Drive:
    """One specimen: random shares and shapes, deflection at rated torque near the sheet's."""
    rated = size.rated_torque_Nm
    first, second = size.corners_Nm
    specimen = chance.uniform(0.9, 1.1)
    stiffness = 1e3 * specimen * np.array(size.stiffness)
    total_rad = (
        min(first, rated) / stiffness[0]
        + (min(second, rated) - first) / stiffness[1]
        + max(rated - second, 0.0) / stiffness[2]
    )
    # The low stiffness below the first corner is mostly due to the gap.
    gap_rad = chance.uniform(0.6, 0.85) * first * (1 / stiffness[0] - 1 / stiffness[1])
    rest_rad = total_rad - gap_rad
    shares = np.array(
        [chance.uniform(0.30, 0.40), chance.uniform(0.10, 0.20), chance.uniform(0.42, 0.52)]
    )
    mesh_rad, radial_rad, torsion_rad = rest_rad * shares / shares.sum()

    # Both sides have the same pairs on average: they differ by the scatter of the teeth.
    spread = chance.uniform(1.4, 2.0)
    widest_rad = chance.uniform(1.2, 1.6) * mesh_rad
    place = np.arange(PAIRS) / (PAIRS - 1)
    gaps, stiffnesses = [], []
    for _ in range(2):
        gap = widest_rad * np.abs(place + chance.normal(0, 0.1 / PAIRS, PAIRS)) ** spread
        gap[0] = 0.0
        pair = 1 + chance.normal(0, 0.03, PAIRS)
        gap.sort()
        gaps.append(gap)
        stiffnesses.append(pair * rated / np.sum(pair * np.clip(mesh_rad - gap, 0, None)))

    # Maxwell elements: the ones that slip first are the strongest.
    wind_up_rad = np.geomspace(2.0, chance.uniform(25, 40), SLIPS) * ARCSEC
    weight = chance.uniform(0.6, 1.0) ** np.arange(SLIPS) * chance.uniform(0.8, 1.2, SLIPS)
    slip_Nm = chance.uniform(0.018, 0.032) * rated * weight / weight.sum()
    return Drive(
        name=f"size {size.size} ratio {size.ratio}",
        ratio=size.ratio,
        rated_torque_Nm=rated,
        sheet={"T1_Nm": first, "T2_Nm": second},
        pair_gap_rad=(gaps[0], gaps[1]),
        pair_stiffness_Nm_per_rad=(stiffnesses[0], stiffnesses[1]),
        radial_rad=radial_rad,
        radial_exponent=chance.uniform(0.62, 0.85),
        radial_preload=chance.uniform(0.05, 0.12),
        torsion_rad=torsion_rad,
        gap_rad=gap_rad,
        knee_Nm=chance.uniform(0.015, 0.035) * rated,
        slip_limit_Nm=slip_Nm,
        slip_angle_rad=wind_up_rad,
        joint_torque_Nm=0.06 * rated,
    )


def print_sheet(drive: Drive, chance: np.random.Generator, error: float, bias: float) -> Drive:
    """Fill in the sheet from the loop that a maker would measure, with `error` rms and `bias`."""
    first, second = drive.sheet["T1_Nm"], drive.sheet["T2_Nm"]
    third = max(drive.rated_torque_Nm, 1.2 * second)
    ramp = np.linspace(0, third, 400)
    loop = np.concatenate([ramp, ramp[::-1], -ramp, -ramp[::-1], ramp, ramp[::-1]])
    angle = quasi_static(drive, loop).angle_rad.reshape(6, 400)
    load, unload, back, forth = angle[4], angle[5][::-1], angle[2], angle[3][::-1]
    centre = np.mean([load, unload, -back, -forth], axis=0)
    at_first, at_second, at_third = np.interp([first, second, third], ramp, centre)
    stiffness = (
        np.array(
            [
                first / at_first,
                (second - first) / (at_second - at_first),
                (third - second) / (at_third - at_second),
            ]
        )
        * (1 + bias)
        * (1 + error * chance.standard_normal(3))
    )
    # A sheet states hysteresis and lost motion in steps of half an arc minute.
    arcmin = 60 * ARCSEC
    hysteresis = np.ceil((unload[0] - load[0]) / arcmin * 2) / 2
    lost_motion = (
        np.ceil(2 * np.interp(0.04 * drive.rated_torque_Nm, ramp, centre) / arcmin * 2) / 2
    )
    sheet = dict(drive.sheet)
    for name, value in zip(("K1", "K2", "K3"), stiffness, strict=True):
        sheet[f"{name}_Nm_per_rad"] = float(f"{value:.3g}")
    sheet["hysteresis_arcmin"] = float(hysteresis)
    sheet["lost_motion_arcmin"] = float(lost_motion)
    return replace(drive, sheet=sheet)
