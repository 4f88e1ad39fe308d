"""Drives whose friction follows one of the published laws (laws.c), one operator outside them."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass, fields, replace

import numpy as np

from .mechanics import ARCSEC, DOUBLES, Array, compiled, pointer

ELEMENTS_MAX = 8

LAWS = ("maxwell", "dahl", "lugre", "bouc_wen", "load", "outside", "dead_zone")
"""Maxwell slip in parallel, Dahl, LuGre, Bouc-Wen; limits that grow with the load, R = r + eta |T|;
one play operator of constant width in series, beside a weak Maxwell slip; a dead zone with Bouc-Wen
friction in parallel."""

_KERNEL_LAWS = {"dahl": 1, "lugre": 2, "bouc_wen": 3, "dead_zone": 3}

SCALED = (
    "compliance_rad_per_Nm",
    "hardening",
    "gap_rad",
    "knee_Nm",
    "limit_Nm",
    "angle_rad",
    "load_share",
    "outside_rad_per_Nm",
    "outside_Nm",
)
"""Parameters that an ideal refit of such a drive may rescale: all of its law."""


class _Drive(ctypes.Structure):
    _fields_ = (
        ("law", ctypes.c_int),
        ("elements", ctypes.c_int),
        *(
            (name, ctypes.c_double)
            for name in (
                "rated_torque_Nm",
                "compliance_rad_per_Nm",
                "hardening",
                "asymmetry",
                "knee_Nm",
                "load_share",
                "stribeck",
                "stribeck_rad_per_s",
                "viscous_Nms_per_rad",
            )
        ),
        ("limit_Nm", ctypes.c_double * ELEMENTS_MAX),
        ("angle_rad", ctypes.c_double * ELEMENTS_MAX),
    )


class _Samples(ctypes.Structure):
    _fields_ = tuple(
        (name, DOUBLES) for name in ("torque_Nm", "gap_rad", "compliance", "friction", "step_s")
    )


class _Memory(ctypes.Structure):
    _fields_ = (
        ("angle_rad", ctypes.c_double),
        ("force_Nm", ctypes.c_double * ELEMENTS_MAX),
    )


@dataclass(frozen=True)
class LawDrive:
    """The true drive."""

    law: str
    name: str
    ratio: int
    rated_torque_Nm: float
    compliance_rad_per_Nm: float
    hardening: float
    gap_rad: float
    knee_Nm: float
    limit_Nm: Array
    angle_rad: Array
    load_share: float = 0.0
    stribeck: float = 0.0
    stribeck_rad_per_s: float = 1.0
    viscous_Nms_per_rad: float = 0.0
    outside_rad_per_Nm: float = 0.0
    outside_Nm: float = 0.0
    asymmetry: float = 0.0

    def scaled(self, name: str, factor: float) -> LawDrive:
        """The drive with one of `SCALED` times a factor."""
        return replace(self, **{name: getattr(self, name) * factor})

    @property
    def free(self) -> list[str]:
        """Those of `SCALED` that the drive has."""
        return [name for name in SCALED if np.any(getattr(self, name))]


@dataclass
class LawSamples:
    """Loads and conditions of the drive at each sample."""

    torque_Nm: Array
    gap_rad: Array
    compliance: Array
    friction: Array
    step_s: Array

    def part(self, rows: slice) -> LawSamples:
        """Some of the samples."""
        return LawSamples(*(getattr(self, item.name)[rows] for item in fields(self)))


class LawMemory:
    """Memory of the drive, with that of the friction outside."""

    def __init__(self) -> None:
        self.inside = _Memory()
        self.outside_Nm = 0.0


def make_law_drive(law: str, chance: np.random.Generator) -> LawDrive:
    """One specimen of a drive of about size 20, ratio 100."""
    rated = 40.0
    elements = 6 if law in ("maxwell", "load") else 1
    share = chance.uniform(0.02, 0.04) * {"load": 0.4, "outside": 0.3}.get(law, 1.0)
    weight = chance.uniform(0.6, 1.4, elements)
    angle = (
        np.geomspace(3.0, 30.0, elements) if elements > 1 else np.array([chance.uniform(8.0, 16.0)])
    )
    dead = law == "dead_zone"
    return LawDrive(
        law=law,
        name=f"{law} drive",
        ratio=100,
        rated_torque_Nm=rated,
        compliance_rad_per_Nm=chance.uniform(0.9, 1.1) / 22_000.0,
        hardening=chance.uniform(0.2, 0.4),
        gap_rad=(chance.uniform(18.0, 30.0) if dead else chance.uniform(8.0, 20.0)) * ARCSEC,
        knee_Nm=(2e-4 if dead else chance.uniform(0.02, 0.04)) * rated,
        limit_Nm=share * rated * weight / weight.sum(),
        angle_rad=angle * ARCSEC,
        load_share=chance.uniform(0.05, 0.10) if law == "load" else 0.0,
        stribeck=chance.uniform(0.1, 0.3) if law == "lugre" else 0.0,
        stribeck_rad_per_s=2e-4,
        viscous_Nms_per_rad=chance.uniform(5.0, 20.0) if law == "lugre" else 0.0,
        outside_rad_per_Nm=chance.uniform(0.2, 0.4) / 22_000.0 if law == "outside" else 0.0,
        outside_Nm=chance.uniform(0.05, 0.10) * rated if law == "outside" else 0.0,
    )


def sheet_of(drive: LawDrive, chance: np.random.Generator) -> dict[str, float]:
    """The maker's catalogue: three stiffnesses with an error of 3 % each."""
    corners = np.array([0.0, 7.0, 25.0, drive.rated_torque_Nm])
    zero = replace(drive, limit_Nm=1e-9 * drive.limit_Nm, load_share=0.0, outside_rad_per_Nm=0.0)
    one = np.ones(4)
    at = LawSamples(corners, drive.gap_rad * one, one, one, 0 * one)
    angle, _ = turn_law(zero, at, LawMemory())
    slope = np.diff(corners) / np.diff(angle) * (1 + 0.03 * chance.standard_normal(3))
    return {
        "T1_Nm": 7.0,
        "T2_Nm": 25.0,
        **{f"K{i + 1}_Nm_per_rad": float(f"{k:.3g}") for i, k in enumerate(slope)},
    }


def turn_law(drive: LawDrive, samples: LawSamples, memory: LawMemory) -> tuple[Array, Array]:
    """Output angle and elastic torque over the samples; the memory continues."""
    count = len(samples.torque_Nm)
    c_drive = _Drive(law=_KERNEL_LAWS.get(drive.law, 0), elements=len(drive.limit_Nm))
    for name, kind in _Drive._fields_[2:]:
        if kind is ctypes.c_double:
            setattr(c_drive, name, getattr(drive, name))
    for name in ("limit_Nm", "angle_rad"):
        for i, value in enumerate(getattr(drive, name)):
            getattr(c_drive, name)[i] = value
    kept = [np.ascontiguousarray(getattr(samples, name)) for name, _ in _Samples._fields_]
    c_samples = _Samples(*(pointer(values) for values in kept))
    angle, elastic = np.empty(count), np.empty(count)
    compiled("laws.c").law_turn(
        ctypes.byref(c_drive),
        ctypes.byref(c_samples),
        ctypes.c_size_t(count),
        ctypes.byref(memory.inside),
        pointer(angle),
        pointer(elastic),
    )
    if drive.outside_rad_per_Nm:
        half = drive.outside_Nm * samples.friction
        torque = samples.torque_Nm
        for n in range(count):
            z = min(max(memory.outside_Nm, torque[n] - half[n]), torque[n] + half[n])
            memory.outside_Nm = z
            angle[n] += drive.outside_rad_per_Nm * (z - torque[n])
    return angle, elastic
