"""The drive on the rig: its components, and its rotation under a torque (mechanics.c)."""

from __future__ import annotations

import ctypes
import hashlib
import os
import subprocess
import tempfile
from dataclasses import dataclass, field, fields, replace
from functools import cache
from pathlib import Path

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
ARCSEC = np.pi / 180 / 3600

SOURCE = Path(__file__).with_name("mechanics.c")
SLIPS_MAX = 16
FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fPIC", "-shared")
DOUBLES = ctypes.POINTER(ctypes.c_double)


class _Drive(ctypes.Structure):
    _fields_ = (
        ("pairs", ctypes.c_int),
        ("slips", ctypes.c_int),
        ("gap_rad", DOUBLES * 2),
        ("stiffness_sum", DOUBLES * 2),
        ("offset_sum", DOUBLES * 2),
        ("slip_stiffness_Nm_per_rad", DOUBLES),
        ("slip_limit_Nm", DOUBLES),
        *(
            (name, ctypes.c_double)
            for name in (
                "rated_torque_Nm",
                "radial_rad",
                "radial_exponent",
                "radial_preload",
                "torsion_rad",
                "knee_Nm",
                "load_friction",
                "joint_rad",
                "joint_torque_Nm",
                "hardening",
                "asymmetry",
                "inertia_kgm2",
            )
        ),
    )


class _Samples(ctypes.Structure):
    _fields_ = tuple(
        (name, DOUBLES)
        for name in (
            "torque_Nm",
            "gap_rad",
            "compliance",
            "friction",
            "play_rad",
            "lobe_rad",
            "step_s",
        )
    )


class _Memory(ctypes.Structure):
    _fields_ = (
        ("angle_rad", ctypes.c_double),
        ("slip_Nm", ctypes.c_double * SLIPS_MAX),
        ("mesh_rad", ctypes.c_double),
    )


@cache
def compiled(name: str) -> ctypes.CDLL:
    """Compile a source of this folder with the system's compiler if it has changed, and load it."""
    path = SOURCE.with_name(name)
    source = path.read_bytes()
    folder = path.parents[2] / "build" / "rig"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        folder = Path(tempfile.mkdtemp(prefix="rig-"))
    library = folder / f"{path.stem}-{hashlib.sha256(source).hexdigest()[:16]}.so"
    if not library.exists():
        made = library.with_suffix(f".{os.getpid()}")
        subprocess.run(
            [os.environ.get("CC", "cc"), *FLAGS, "-o", str(made), str(path), "-lm"],
            check=True,
        )
        made.replace(library)
    return ctypes.CDLL(str(library))


@cache
def kernel() -> ctypes.CDLL:
    """Load the mechanics of the drive on the rig."""
    loaded = compiled(SOURCE.name)
    loaded.rig_turn.restype = ctypes.c_size_t
    loaded.rig_turn.argtypes = (
        ctypes.POINTER(_Drive),
        ctypes.POINTER(_Samples),
        ctypes.c_size_t,
        ctypes.POINTER(_Memory),
        DOUBLES,
        DOUBLES,
        DOUBLES,
    )
    return loaded


def pointer(array: Array) -> ctypes._Pointer[ctypes.c_double]:
    return array.ctypes.data_as(DOUBLES)


@dataclass(frozen=True)
class Drive:
    """The true drive; the users of its recordings get only its catalogue sheet."""

    name: str
    ratio: int
    rated_torque_Nm: float
    sheet: dict[str, float]
    """T1_Nm, T2_Nm and, once measured, the other values of a sheet."""
    pair_gap_rad: tuple[Array, Array]
    """Per side, by rising gap: mesh angle at which each tooth pair meets."""
    pair_stiffness_Nm_per_rad: tuple[Array, Array]
    radial_rad: float
    radial_exponent: float
    radial_preload: float
    torsion_rad: float
    gap_rad: float
    knee_Nm: float
    slip_limit_Nm: Array
    slip_angle_rad: Array
    """Angle by which each Maxwell element winds up before it slips."""
    load_friction: float = 0.0
    joint_rad: float = 0.0
    joint_torque_Nm: float = 1.0
    hardening: float = 0.0
    asymmetry: float = 0.0
    inertia_kgm2: float = 0.0

    def scaled(self, factors: dict[str, float]) -> Drive:
        """Return the drive with some of its `SCALES` multiplied."""
        drive = self
        for name, factor in factors.items():
            if name == "mesh":
                change = {
                    "pair_gap_rad": tuple(factor * side for side in self.pair_gap_rad),
                    "pair_stiffness_Nm_per_rad": tuple(
                        side / factor for side in self.pair_stiffness_Nm_per_rad
                    ),
                }
            elif name == "tooth_gaps":
                change = {"pair_gap_rad": tuple(factor * side for side in self.pair_gap_rad)}
            else:
                change = {name: factor * getattr(self, name)}
            drive = replace(drive, **change)
        return drive


SCALES = (
    "mesh",
    "tooth_gaps",
    "radial_rad",
    "torsion_rad",
    "gap_rad",
    "knee_Nm",
    "slip_limit_Nm",
    "slip_angle_rad",
)
"""Parameters that a refit of a drive without hidden effects may rescale.

Mesh, radial parts, torsion and gap are scaled by their angle, in which the lost motion is almost
linear.
"""


@dataclass
class Samples:
    """Loads and conditions of the drive at each sample, in the order of `_Samples`."""

    torque_Nm: Array
    gap_rad: Array
    compliance: Array
    friction: Array
    play_rad: Array
    lobe_rad: Array
    step_s: Array


@dataclass
class Turned:
    """Motion of the drive: output angle, its elastic share without the gap, elastic torque."""

    angle_rad: Array
    elastic_angle_rad: Array
    elastic_torque_Nm: Array


@dataclass
class Memory:
    """Memory of the drive from one part of the samples to the next."""

    state: _Memory = field(default_factory=_Memory)


def turn(drive: Drive, samples: Samples, memory: Memory | None = None) -> Turned:
    """Turn the drive through the samples; without a memory it starts as assembled."""
    count = len(samples.torque_Nm)
    kept: list[Array] = []

    def held(values: Array) -> ctypes._Pointer[ctypes.c_double]:
        kept.append(np.ascontiguousarray(values, dtype=np.float64))
        return pointer(kept[-1])

    c_drive = _Drive()
    for name, _ in _Drive._fields_[7:]:
        setattr(c_drive, name, getattr(drive, name))
    c_drive.pairs = len(drive.pair_gap_rad[0])
    c_drive.slips = len(drive.slip_limit_Nm)
    for side in (0, 1):
        gap, stiffness = drive.pair_gap_rad[side], drive.pair_stiffness_Nm_per_rad[side]
        c_drive.gap_rad[side] = held(gap)
        c_drive.stiffness_sum[side] = held(np.cumsum(stiffness))
        c_drive.offset_sum[side] = held(np.cumsum(stiffness * gap))
    c_drive.slip_stiffness_Nm_per_rad = held(drive.slip_limit_Nm / drive.slip_angle_rad)
    c_drive.slip_limit_Nm = held(drive.slip_limit_Nm)
    c_samples = _Samples()
    for item in fields(samples):
        values = getattr(samples, item.name)
        if len(values) != count:
            raise ValueError(f"{item.name}: {len(values)} samples, torque has {count}")
        setattr(c_samples, item.name, held(values))
    answers = [np.empty(count) for _ in range(3)]
    memory = memory if memory is not None else Memory()
    done = kernel().rig_turn(
        c_drive, c_samples, count, memory.state, *(pointer(answer) for answer in answers)
    )
    if done < count:
        raise ArithmeticError(f"{drive.name}: no balance of torques at sample {done}")
    return Turned(*answers)


def quasi_static(drive: Drive, torque_Nm: Array, memory: Memory | None = None) -> Turned:
    """Turn the drive through torques without other loads."""
    one = np.ones(len(torque_Nm))
    return turn(
        drive,
        Samples(
            torque_Nm=torque_Nm,
            gap_rad=drive.gap_rad * one,
            compliance=one,
            friction=one,
            play_rad=0 * one,
            lobe_rad=0 * one,
            step_s=0 * one,
        ),
        memory,
    )
