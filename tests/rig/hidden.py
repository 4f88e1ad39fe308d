"""Hidden effects of a campaign: effects of the library, and others.

Each is a few lines of mechanics or measurement: `before` changes the loads on the drive, `after`
the readings. Magnitudes are in natural units; bench.py finds the one that leaves a required
residual. None of the formulas is from the library; if physics permits several shapes (wear over
cycles, friction over temperature or speed), the rig chooses its own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from scipy.signal import lfilter

from .mechanics import ARCSEC, Array, Drive, Samples, Turned
from .plans import ROOM_C, Plan

PERCENT = 0.01
RATCHET_SHARE = 2.5
"""Torque over rated at which teeth jump."""


@dataclass
class Bench:
    """A drive on the rig, before it is turned."""

    plan: Plan
    drive: Drive
    samples: Samples
    warmer_K: Array
    """Temperature of the drive above that of the room."""


@dataclass
class Event:
    """Something that happens at one moment of one run."""

    run: int
    time_s: float
    size_arcsec: float


@dataclass
class Readings:
    """Readings of the rig without noise."""

    turned: Turned
    lost_motion_rad: Array
    torque_Nm: Array
    events: list[Event] = field(default_factory=list)


Before = Callable[[Bench, float, Array], None]
After = Callable[[Bench, Readings, float, Array], None]


@dataclass(frozen=True)
class Hidden:
    """A hidden effect: its formula, and how large it may be."""

    name: str
    unit: str
    typical: float
    """Magnitude at which its signature is computed."""
    limit: float
    """Largest magnitude that a drive or a rig would plausibly have."""
    about: str
    before: Before | None = None
    after: After | None = None
    outside: bool = False
    """Not an effect of the library: the right answer is `unexplained`."""
    depends_on: tuple[str, ...] = ()
    """For causes outside the library: columns on which the residual depends."""
    columns: tuple[str, ...] = ()
    """Columns that it depends on; written if it is hidden, unless dropped on purpose."""
    phases: int = 0
    """Number of free phases of its signature."""
    per_rated: bool = False
    """Typical and limit are per N m of rated torque."""
    quick: bool = False
    """Depends on samples that are close together: use all samples."""
    spike: bool = False
    """Needs an overload; its size is not scaled to a residual."""

    def scale(self, drive: Drive) -> float:
        """Return the factor of typical and limit for a drive."""
        return drive.rated_torque_Nm if self.per_rated else 1.0


def _sign(value: Array, width: float) -> Array:
    """Smooth sign function."""
    return value / np.hypot(value, width)


def lagged(values: Array, step_s: Array, time_constant_s: float) -> Array:
    """First-order lag within each run of even steps, settled at its start."""
    lagged = values.copy()
    if not time_constant_s > 0:
        return lagged
    starts = [*np.flatnonzero(step_s == 0.0), len(values)]
    for a, b in pairwise(starts):
        # The input is linear between samples; this recursion is exact for that.
        share = step_s[a + 1] / time_constant_s
        keep = np.exp(-share)
        new = 1 - (1 - keep) / share
        old = (1 - keep) / share - keep
        start = np.array([old * values[a] + keep * values[a]])
        lagged[a + 1 : b] = lfilter([new, old], [1, -keep], values[a + 1 : b], zi=start)[0]
    return lagged


# --- shape of the drive --------------------------------------------------------------------------


def _kinematic_error(b: Bench, r: Readings, m: float, phase: Array) -> None:
    angle = b.plan.input_angle_rad
    shape = np.cos(2 * angle + phase[0]) + 0.12 * np.cos(4 * angle + phase[1])
    r.lost_motion_rad += m * ARCSEC * shape


def _kinematic_sideband(b: Bench, r: Readings, m: float, phase: Array) -> None:
    lobe = 2 * b.plan.input_angle_rad
    tooth = 2 * b.plan.input_angle_rad / b.drive.ratio
    shape = np.cos(lobe + tooth + phase[0]) + 0.3 * np.cos(lobe - tooth + phase[1])
    r.lost_motion_rad += m * ARCSEC * shape


def _stiffness_modulation(b: Bench, m: float, phase: Array) -> None:
    b.samples.compliance *= 1 + m * PERCENT * np.cos(2 * b.plan.input_angle_rad + phase[0])


def _lobe_eccentricity(b: Bench, m: float, phase: Array) -> None:
    b.samples.lobe_rad += m * ARCSEC * np.cos(b.plan.input_angle_rad + phase[0])


def _output_eccentricity(b: Bench, r: Readings, m: float, phase: Array) -> None:
    angle = b.plan.input_angle_rad / b.drive.ratio + phase[0]
    off = m * ARCSEC
    r.lost_motion_rad += np.arctan2(off * np.sin(angle), 1 + off * np.cos(angle))


def _free_play(b: Bench, m: float, phase: Array) -> None:
    b.samples.play_rad += m * ARCSEC


def _input_coupling_play(b: Bench, r: Readings, m: float, phase: Array) -> None:
    drag = 0.01 * _sign(b.plan.speed_rad_per_s, 0.1)
    r.lost_motion_rad += m / 2 * ARCSEC * _sign(b.plan.torque - drag, 0.004)


def _soft_windup(b: Bench, m: float, phase: Array) -> None:
    b.drive = replace(b.drive, joint_rad=b.drive.joint_rad + m * ARCSEC)


def _stiffening(b: Bench, m: float, phase: Array) -> None:
    b.drive = replace(b.drive, hardening=b.drive.hardening + m)


def _asymmetric_stiffness(b: Bench, m: float, phase: Array) -> None:
    b.drive = replace(b.drive, asymmetry=b.drive.asymmetry + m * PERCENT)


# --- temperature, cycles, time -------------------------------------------------------------------


def _thermal_gap(b: Bench, m: float, phase: Array) -> None:
    b.samples.gap_rad += m * ARCSEC * b.warmer_K
    np.clip(b.samples.gap_rad, 0.0, None, out=b.samples.gap_rad)


def _thermal_stiffness(b: Bench, m: float, phase: Array) -> None:
    b.samples.compliance /= 1 - m * PERCENT * b.warmer_K


def _thermal_drift(b: Bench, r: Readings, m: float, phase: Array) -> None:
    r.lost_motion_rad += m * ARCSEC * b.warmer_K


def _thermal_friction(b: Bench, m: float, phase: Array) -> None:
    # Vogel's law of an oil, relative to room temperature: the stated slope is valid there.
    pole_K = ROOM_C + 95.0
    b.samples.friction *= np.exp(-m * PERCENT * b.warmer_K * pole_K / (pole_K + b.warmer_K))


def _wear(b: Bench, m: float, phase: Array) -> None:
    # The wave generator's bearing wears, quickly during running-in.
    run_in = 3e4
    b.samples.gap_rad += m * ARCSEC * np.log1p(b.plan.cycles / run_in) / np.log1p(1e5 / run_in)


def _creep(b: Bench, r: Readings, m: float, phase: Array) -> None:
    elastic = r.turned.elastic_angle_rad
    for time_constant_s in (3.0, 25.0, 200.0):
        starts = np.flatnonzero(b.plan.step_s == 0.0)
        # A run begins recovered: the effect of its load counts from the first sample on.
        before = elastic.copy()
        before[starts] = 0.0
        r.lost_motion_rad += m / 3 * PERCENT * lagged(before, b.plan.step_s, time_constant_s)


# --- friction ------------------------------------------------------------------------------------


def _viscous_friction(b: Bench, m: float, phase: Array) -> None:
    b.samples.torque_Nm -= m * PERCENT * b.drive.rated_torque_Nm * b.plan.speed_rad_per_s / 100.0


def _stribeck_friction(b: Bench, m: float, phase: Array) -> None:
    speed = b.plan.speed_rad_per_s
    fallen = _sign(speed, 0.1) / (1 + (np.abs(speed) / 15.0) ** 1.5)
    b.samples.torque_Nm -= m * PERCENT * b.drive.rated_torque_Nm * fallen


def _load_dependent_friction(b: Bench, m: float, phase: Array) -> None:
    b.drive = replace(b.drive, load_friction=b.drive.load_friction + m * PERCENT)


# --- bench and sensors ---------------------------------------------------------------------------


def _torque_offset(b: Bench, r: Readings, m: float, phase: Array) -> None:
    r.torque_Nm += m * PERCENT * b.drive.rated_torque_Nm


def _torque_scale(b: Bench, r: Readings, m: float, phase: Array) -> None:
    r.torque_Nm *= 1 + m * PERCENT


def _input_lock_compliance(b: Bench, r: Readings, m: float, phase: Array) -> None:
    r.lost_motion_rad += m * ARCSEC * np.where(b.plan.turning, 0.0, b.plan.torque)


def _output_tilt(b: Bench, r: Readings, m: float, phase: Array) -> None:
    # The bearing is a little softer near zero moment, where fewer rollers carry.
    moment = b.plan.tilt_moment
    r.lost_motion_rad += m * ARCSEC * (0.95 * moment + 0.05 * _sign(moment, 0.1))


def _axial_shift(b: Bench, m: float, phase: Array) -> None:
    b.samples.gap_rad += m * ARCSEC * b.plan.axial_force
    np.clip(b.samples.gap_rad, 0.0, None, out=b.samples.gap_rad)


def _inertia(b: Bench, m: float, phase: Array) -> None:
    b.drive = replace(b.drive, inertia_kgm2=b.drive.inertia_kgm2 + m)
    starts = [*np.flatnonzero(b.plan.step_s == 0.0), len(b.plan.step_s)]
    for a, e in pairwise(starts):
        speed, time = b.plan.speed_rad_per_s[a:e], b.plan.time_s[a:e]
        b.samples.torque_Nm[a:e] -= m * np.gradient(speed, time) / b.drive.ratio


def _sensor_lag(b: Bench, r: Readings, m: float, phase: Array) -> None:
    r.torque_Nm[:] = lagged(r.torque_Nm, b.plan.step_s, m * 1e-3)


def _ratcheting(b: Bench, r: Readings, m: float, phase: Array) -> None:
    tooth_rad = np.pi / (b.drive.ratio + 1)
    over = np.flatnonzero(b.plan.torque > RATCHET_SHARE)
    if len(over):
        _jump(b, r, int(over[0]), round(m) * tooth_rad)


# --- causes that no library names ----------------------------------------------------------------


def _jump(b: Bench, r: Readings, sample: int, size_rad: float) -> None:
    r.lost_motion_rad[sample:] += size_rad
    r.events.append(
        Event(int(b.plan.run[sample]) + 1, float(b.plan.time_s[sample]), size_rad / ARCSEC)
    )


def _torque_ripple(b: Bench, r: Readings, m: float, phase: Array) -> None:
    r.lost_motion_rad += m * ARCSEC * np.sin(2 * np.pi * 3.0 * b.plan.torque + phase[0])


def _output_third_harmonic(b: Bench, r: Readings, m: float, phase: Array) -> None:
    angle = b.plan.input_angle_rad / b.drive.ratio
    r.lost_motion_rad += m * ARCSEC * np.sin(3 * angle + phase[0])


def _run_drift(b: Bench, m: float, phase: Array) -> None:
    b.samples.compliance *= 1 + m * PERCENT * (b.plan.run / max(b.plan.runs - 1, 1) - 0.5)


def _slip(b: Bench, r: Readings, m: float, phase: Array) -> None:
    share = phase / (2 * np.pi)
    places = [
        rows
        for rows, kind in zip(b.plan.slices(), b.plan.kinds, strict=True)
        if kind in ("loop", "hold", "turning")
    ]
    rows = places[int(share[0] * len(places))]
    _jump(b, r, rows.start + int((0.25 + 0.5 * share[1]) * (rows.stop - rows.start)), m * ARCSEC)


def _speed_step(b: Bench, m: float, phase: Array) -> None:
    for rows in b.plan.slices():
        rate = np.median(np.abs(np.diff(b.plan.torque[rows])) / b.plan.step_s[rows][1:])
        if rate > 0.3:
            b.samples.compliance[rows] *= 1 + m * PERCENT


def _warm_up(b: Bench, r: Readings, m: float, phase: Array) -> None:
    r.lost_motion_rad += m * ARCSEC * (1 - np.exp(-b.plan.time_s / 40.0))


_WARM = ("temperature_C",)
_CYCLES = ("cycles",)
_TILT = ("tilt_moment_Nm",)
_AXIAL = ("axial_force_N",)
_MINE = (
    Hidden(
        "kinematic_error", "arcsec", 5, 60,
        "twice a turn of the wave generator, with an eighth of that at four times",
        after=_kinematic_error, phases=2,
    ),
    Hidden(
        "kinematic_sideband", "arcsec", 5, 60,
        "lobes over the flexspline's teeth: orders 2(1+1/u), and 0.3 of it at 2(1-1/u)",
        after=_kinematic_sideband, phases=2,
    ),
    Hidden(
        "stiffness_modulation", "percent", 2, 20,
        "compliance of mesh, radial parts and torsion varies twice a turn of the wave generator",
        before=_stiffness_modulation, phases=1,
    ),
    Hidden(
        "lobe_eccentricity", "arcsec", 20, 120,
        "two lobes, each with half of the tooth pairs, one leading and one lagging once a turn",
        before=_lobe_eccentricity, phases=1,
    ),
    Hidden(
        "output_eccentricity", "arcsec", 5, 120,
        "scale of the output encoder off its centre: arctangent of the displaced circle",
        after=_output_eccentricity, phases=1,
    ),
    Hidden(
        "free_play", "arcsec a side", 15, 90,
        "dead zone of all tooth pairs, inside the friction", before=_free_play,
    ),
    Hidden(
        "input_coupling_play", "arcsec in all", 10, 60,
        "coupling falls from side to side with the input's torque (load less drag of rotation), "
        "outside the friction",
        after=_input_coupling_play,
    ),
    Hidden(
        "thermal_gap", "arcsec per K", 0.3, 2,
        "radial gap linear in temperature, never negative", before=_thermal_gap, columns=_WARM,
    ),
    Hidden(
        "thermal_stiffness", "percent per K", 0.1, 1,
        "stiffness linear in temperature", before=_thermal_stiffness, columns=_WARM,
    ),
    Hidden(
        "thermal_drift", "arcsec per K", 0.5, 3,
        "zero of the output angle linear in temperature", after=_thermal_drift, columns=_WARM,
    ),
    Hidden(
        "thermal_friction", "percent per K", 1, 8,
        "slip limits by Vogel's law of an oil", before=_thermal_friction, columns=_WARM,
    ),
    Hidden(
        "wear", "arcsec a side at 1e5 cycles", 10, 60,
        "radial gap grows with the cycles, logarithmic run-in", before=_wear, columns=_CYCLES,
    ),
    Hidden(
        "creep", "percent", 2, 15,
        "three Kelvin elements (3, 25, 200 s) in series, rested at each run's start", after=_creep,
    ),
    Hidden(
        "viscous_friction", "percent of rated at 100 rad/s", 2, 20,
        "drag torque proportional to the wave generator's speed, in parallel with the spring",
        before=_viscous_friction,
    ),
    Hidden(
        "stribeck_friction", "percent of rated", 2, 20,
        "drag torque that falls with speed, 1/(1+(w/15)^1.5), in parallel with the spring",
        before=_stribeck_friction,
    ),
    Hidden(
        "load_dependent_friction", "percent at rated torque", 20, 400,
        "slip limits grow with the elastic torque", before=_load_dependent_friction,
    ),
    Hidden(
        "soft_windup", "arcsec", 15, 120,
        "joint that opens exponentially over 6 % of the rated torque, inside the friction",
        before=_soft_windup,
    ),
    Hidden(
        "stiffening", "rated over corner torque", 1, 20,
        "torsion spring by an inverse hyperbolic sine", before=_stiffening,
    ),
    Hidden(
        "asymmetric_stiffness", "percent", 3, 30,
        "compliance of the negative side over the positive one", before=_asymmetric_stiffness,
    ),
    Hidden(
        "torque_offset", "percent of rated", 0.3, 5,
        "zero of the torque sensor", after=_torque_offset,
    ),
    Hidden(
        "torque_scale", "percent", 2, 10, "gain of the torque sensor", after=_torque_scale,
    ),
    Hidden(
        "input_lock_compliance", "arcsec at rated torque", 20, 200,
        "lock of the input winds up where its encoder does not see it; not when turning",
        after=_input_lock_compliance,
    ),
    Hidden(
        "output_tilt", "arcsec at a moment of the rated torque", 15, 200,
        "tilt of the output bearing, a little softer near zero moment",
        after=_output_tilt, columns=_TILT,
    ),
    Hidden(
        "axial_shift", "arcsec at a force of rated torque over 0.1 m", 10, 60,
        "axial force shifts the wave generator in its cone and changes the radial gap",
        before=_axial_shift, columns=_AXIAL,
    ),
    Hidden(
        "inertia", "kg m2", 0.02, 0.5,
        "mass between torque sensor and drive, stepped with the balance (backward Euler)",
        before=_inertia, per_rated=True, quick=True,
    ),
    Hidden(
        "sensor_lag", "ms", 5, 100, "first-order lag of the torque channel",
        after=_sensor_lag, quick=True,
    ),
    Hidden(
        "ratcheting", "teeth", 1, 2,
        "jump by whole teeth of the rigid gear when 2.5 times the rated torque is passed",
        after=_ratcheting, spike=True,
    ),
)  # fmt: skip
_OTHERS = (
    Hidden(
        "outside_torque_ripple", "arcsec", 3, 60, "angle ripples thrice over the rated torque",
        after=_torque_ripple, outside=True, depends_on=("torque",), phases=1,
    ),
    Hidden(
        "outside_output_third_harmonic", "arcsec", 3, 60, "thrice a turn of the output",
        after=_output_third_harmonic, outside=True, depends_on=("output_angle",), phases=1,
    ),
    Hidden(
        "outside_run_drift", "percent", 2, 30,
        "compliance changes from run to run, linear in the run's number",
        before=_run_drift, outside=True, depends_on=("run",),
    ),
    Hidden(
        "outside_slip", "arcsec", 10, 200, "output slips on its mount at one moment of one run",
        after=_slip, outside=True, depends_on=("event",),
    ),
    Hidden(
        "outside_speed_step", "percent", 3, 30,
        "compliance steps up where torque changes faster than 0.3 of rated a second",
        before=_speed_step, outside=True, depends_on=("torque_rate", "speed"),
    ),
    Hidden(
        "outside_warm_up", "arcsec", 5, 60,
        "zero settles over 40 s after the start of each recording",
        after=_warm_up, outside=True, depends_on=("time",),
    ),
)  # fmt: skip

EFFECTS = {hidden.name: hidden for hidden in _MINE}
OUTSIDE = {hidden.name: hidden for hidden in _OTHERS}
HIDDEN = EFFECTS | OUTSIDE
