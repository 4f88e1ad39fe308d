"""Controller parameters from a drive file: knots, operators, effects, limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.core import core, value_ranges
from lostmotion.drives import (
    PLAY_ENVELOPE,
    PLAY_KNEE,
    PLAY_OUTSIDE,
    PLAY_RADIUS,
    PLAY_SHARE,
    PLAY_WIDENING,
    Drive,
    effect_values,
)
from lostmotion.errors import InputError
from lostmotion.keys import Key, read_keys
from lostmotion.model import (
    design_model,
    fit_values,
    fitted_torsion_curve,
    make_torsion_curve,
    reversal_torque,
)
from lostmotion.units import ARCMIN, ARCSEC

if TYPE_CHECKING:
    from lostmotion.effects.effect import Effect
from lostmotion.controller.effects import build_macros, known_effects

Profile = Literal["standard", "full", "gap"]


PROFILES: tuple[Profile, ...] = ("standard", "full", "gap")
"""Builds of the run-time code."""


_LIB = core().lib


KNOTS_MAX: dict[Profile, int] = {
    "gap": 0,
    "standard": _LIB.LM_CURVE_POINTS_STANDARD,
    "full": _LIB.LM_CURVE_POINTS_FULL,
}
PLAYS_MAX: dict[Profile, int] = {
    "gap": 1,
    "standard": _LIB.LM_PLAYS_STANDARD,
    "full": _LIB.LM_PLAYS_FULL,
}
"""Sizes of the profiles."""


TORQUE_LIMIT_SHARE = 2.0
"""Torque limit relative to the rated torque: about the momentary peak that manufacturers permit."""


CORRECTION_SHARE = 1.25
"""Largest correction relative to the deflection at the torque limit."""


RESPONSE_TICKS = 16
"""Least time constant of the limiter, in ticks (parameters.h)."""


RESONANCE_HZ = 25.0
"""Default of the lowest resonance of a joint with its load: a size 20 drive of 25 kN m/rad with an
arm of 1 kg m^2; robot joints have 8 to 50 Hz.
"""


RESPONSE_PER_HZ = 2.5
"""Ratio of the response to the resonance, 1/s per Hz: 0.4 of the resonance's angular frequency. The
response to a measured torque then falls off above a quarter of the resonance.
"""


RINGING_SHARE = 0.2
"""A correction that oscillates faster than this share of the resonance rings: commanded motion does
not reverse so often; a limit cycle is at the resonance or, with friction, somewhat below.
"""


NOISE_ACCELERATION_SHARE = 1 / 3
"""Largest share of the acceleration limit for torque noise, rms: three times the rms occurs once in
400 samples.
"""


CREEP_RAD_PER_S = 2.5e-4
"""Largest speed at which a fade moves an axis at rest: 0.25 mm/s at a lever of 1 m, 52 arcsec/s."""


CROSSING_S = 0.05
"""Time in which the correction may cross its whole range, unless a velocity is stated."""


NOISE_RAD = 2 * ARCSEC
"""Default noise: that of a 20-bit output encoder."""


DEAD_BAND_SHARE = 0.05
"""Dead band of the gap profile relative to the gap: motion after a reversal within which the
correction crosses the gap. Chosen in tests/plant/gap.c: no scenario is more than an arc second, the
encoder's step, worse than an immediate switch; wider bands cross later.
"""


MISFIT_SHARE = 0.04
"""Error relative to the largest correction above which the watch reports a misfit, and above which
a harmful correction is faded out: about 8 % of the deflection at rated torque, because the largest
correction is 1.25 times that at twice the torque. Chosen on simulated duty (tests/plant/duty.c): at
2 % torque noise near zero load causes false alarms, at 5 % parameters of another drive are detected
later.
"""


PLAYS_SHARE_MAX = 0.9
"""Largest share of the least compliance for the operators of a data sheet: with all of it, the
drive would be rigid after a reversal.
"""


FLANK_WIDENINGS = (0.1, 0.2, 0.4)
"""Widening of the operators for the loop of flank friction, which grows with the torque."""


SETTINGS = (
    Key("torque_limit", "Nm", above=0),
    Key("period", "s", above=0, high=1),
    Key("correction", "rad", above=0, high=1),
    Key("velocity", "rad_per_s", above=0),
    Key("acceleration", "rad_per_s2", above=0),
    Key("jerk", "rad_per_s3", above=0),
    Key("response", "per_s", above=0),
    Key("window", "s", above=0),
    Key("fade", "s", above=0),
    Key("noise", "rad", low=0),
    Key("misfit", "rad", low=0),
    Key("creep", "rad_per_s", low=0),
    Key("ringing", "Hz", low=0),
    Key("resonance", "Hz", above=0),
    Key("torque_noise", "Nm", low=0),
    Key("vibration", "Nm", low=0),
    Key("dead_band", "rad", above=0),
)
"""What ``--set`` may state."""


@dataclass(frozen=True)
class Play:
    """One play operator; its weight is a compliance in series, a share in parallel."""

    radius_Nm: float
    widening: float
    weight: float


@dataclass(frozen=True)
class Envelope:
    """The envelope that the operators follow: excess over the torque, and knee."""

    most_Nm: float = 0.0
    knee_Nm: float = 1.0


@dataclass(frozen=True)
class Limits:
    """Limits of the correction (`lm_limits`), in SI units."""

    period_s: float
    correction_rad: float
    velocity_rad_s: float
    acceleration_rad_s2: float
    jerk_rad_s3: float
    response_per_s: float


@dataclass(frozen=True)
class Watch:
    """Criteria for fading and ringing (`lm_watch`), in SI units."""

    window_s: float
    fade_s: float
    noise_rad: float
    misfit_rad: float
    creep_rad_s: float = CREEP_RAD_PER_S
    ringing_Hz: float = RINGING_SHARE * RESONANCE_HZ


Ends = tuple[float, float]


@dataclass(frozen=True)
class Validity:
    """Fitted ranges (`lm_validity`); both ends 0: not stated."""

    torque_Nm: float = 0.0
    temperature_C: Ends = (0.0, 0.0)
    cycles: Ends = (0.0, 0.0)
    input_velocity_rad_s: Ends = (0.0, 0.0)


@dataclass(frozen=True)
class Controller:
    """Parameters of one drive for the run-time code.

    Attributes
    ----------
    torque_limit_Nm : float
        Torque beyond it is clipped; in the gap profile the largest commanded angle, rad.
    torque_Nm, angle_rad : ndarray
        Knots of the torsion curve; none in the gap profile.
    outside, inside : list of Play
        Operators in series and in parallel with the spring.
    effects : list of (name, values)
        In the order torque, width, angle.
    notes : list of str
        Assumptions, one sentence each.
    own : mapping
        The user's own effects by name, where some are among `effects`.
    envelope : Envelope
        What the operators follow.
    valid : Validity
        The ranges that were fitted.
    dead_band_rad : float
        Dead band of the gap profile: motion of the command after a reversal within which the
        correction crosses the gap.
    """

    torque_limit_Nm: float
    torque_Nm: FloatArray
    angle_rad: FloatArray
    limits: Limits
    watch: Watch
    outside: Sequence[Play] = ()
    inside: Sequence[Play] = ()
    effects: Sequence[tuple[str, Sequence[float]]] = ()
    notes: Sequence[str] = field(default_factory=list)
    own: Mapping[str, Effect] = field(default_factory=dict)
    envelope: Envelope = Envelope()
    valid: Validity = Validity()
    dead_band_rad: float = 0.0

    @property
    def plays(self) -> list[Play]:
        """All operators as the library has them, outside ones first."""
        if self.dead_band_rad > 0:
            half = self.outside[0].radius_Nm
            return [Play(self.dead_band_rad / 2, 0.0, 2 * half / self.dead_band_rad)]
        return [*self.outside, *self.inside]


def read_settings(texts: Sequence[str], option: str = "--set") -> dict[str, float]:
    """Read ``KEY_UNIT=VALUE`` words of a command line.

    Raises
    ------
    InputError
        Unknown keys, wrong units, no numbers.
    """
    table: dict[str, Any] = {}
    for text in texts:
        name, equals, value = text.partition("=")
        try:
            table[name.strip()] = float(value)
        except ValueError:
            expected = "KEY_UNIT=NUMBER, keys " + ", ".join(key.written for key in SETTINGS)
            found = f"'{text}'" if equals else f"'{text}' without ="
            raise InputError(option, "", found, expected) from None
    return {name: value.value for name, value in read_keys(option, "", table, SETTINGS).items()}


def make_controller(
    drive: Drive,
    settings: Mapping[str, float] | None = None,
    *,
    profile: Profile = "standard",
    knots: int | None = None,
    own: Mapping[str, Effect] | None = None,
) -> Controller:
    """Make the controller parameters of a drive.

    Parameters
    ----------
    drive : Drive
    settings : mapping, optional
        From `read_settings`; missing settings get defaults in proportion to the drive.
    profile : {"standard", "full", "gap"}
        Build of the run-time code for which the parameters are.
    knots : int, optional
        Knots of the curve; by default as many as the profile holds.
    own : mapping, optional
        The user's own effects by name.

    Raises
    ------
    InputError
        If the drive needs more than the profile holds, or has impossible values.
    """
    given = dict(settings or {})
    if profile == "gap":
        return _gap_controller(drive, given)
    limit = given.get("torque_limit", TORQUE_LIMIT_SHARE * drive.rated_torque_Nm)
    most = KNOTS_MAX[profile] if knots is None else knots
    if not 2 <= most <= KNOTS_MAX[profile]:
        raise InputError("--knots", "", str(knots), f"2 to {KNOTS_MAX[profile]}")
    notes: list[str] = []
    torque, angle = _torsion_curve(drive, limit, most, notes)
    least = float(np.min(np.diff(angle) / np.diff(torque)))
    outside, inside = _friction(drive, least, notes)
    vibration = given.get("vibration", 0.0)
    if vibration > 0:
        outside, inside = _shaken(outside, vibration), _shaken(inside, vibration)
        notes.append(
            f"Friction as under a vibration of +-{vibration:.3g} N m that the torque input does "
            "not contain."
        )
    effects = _effects(drive, own or {})
    used = {name: own[name] for name, _ in effects if own and name in own}
    _fits(drive.file, "plays", len(outside) + len(inside), PLAYS_MAX[profile], profile)
    envelope = _fitted_envelope(drive)
    if profile == "standard" and effects:
        macros = build_macros(effects, used)
        notes.append(f"The standard build contains no effects: compile with {macros}.")
    if "dead_band" in given:
        raise InputError(
            "--set",
            "dead_band_rad",
            "this setting",
            "--profile gap: the other profiles have no dead band",
        )
    largest = float(np.max(np.abs(np.interp([-limit, limit], torque, angle))))
    limits, watch = _defaults(given, drive, CORRECTION_SHARE * largest, torque, angle)
    return Controller(
        limit,
        torque,
        angle,
        limits,
        watch,
        outside,
        inside,
        effects,
        notes,
        used,
        envelope,
        _fitted_validity(drive),
    )


def _fits(file: str, key: str, count: int, most: int, profile: Profile) -> None:
    if count > most:
        expected = f"at most {most} in the profile {profile}"
        raise InputError(file, key, str(count), expected)


def _torsion_curve(
    drive: Drive, limit_Nm: float, most: int, notes: list[str]
) -> tuple[FloatArray, FloatArray]:
    """Knots of the torsion curve up to the torque limit, reduced if there are too many."""
    torsion_curve = fitted_torsion_curve(drive, limit_Nm) or make_torsion_curve(drive, limit_Nm)
    if torsion_curve.torque_Nm.size <= most:
        return torsion_curve.torque_Nm, torsion_curve.angle_rad
    c = core(64)
    torque, angle = c.array(torsion_curve.torque_Nm), c.array(torsion_curve.angle_rad)
    chosen = c.ffi.new("int[]", most)
    error = c.ffi.new("lm_real *")
    knots = (c.pointer(torque), c.pointer(angle), torque.size)
    c.call(c.lib.lm_choose_knots, *knots, most, chosen, error)
    notes.append(
        f"{most} of {torque.size} points of the torsion curve are kept; linear interpolation "
        f"deviates by at most {error[0] / ARCSEC:.2g} arcsec."
    )
    index = np.array([chosen[i] for i in range(most)])
    return torque[index], angle[index]


def _fitted_plays(drive: Drive, pattern: str) -> list[Play]:
    """The operators of a fit by the pattern of their weights, without those of zero weight."""
    radii = fit_values(drive, PLAY_RADIUS)
    weights = fit_values(drive, pattern)
    widening = fit_values(drive, PLAY_WIDENING)
    if not widening.size:
        widening = np.zeros(radii.size)
    rows = zip(radii, widening, weights, strict=False)
    return [Play(float(r), float(eta), float(weight)) for r, eta, weight in rows if weight > 0]


def _fitted_envelope(drive: Drive) -> Envelope:
    """Envelope of the operators of a fit."""
    values = (drive.fit or {}).get("values", {})
    if PLAY_ENVELOPE not in values:
        return Envelope()
    return Envelope(float(values[PLAY_ENVELOPE]), float(values[PLAY_KNEE]))


def _fitted_validity(drive: Drive) -> Validity:
    """Fitted ranges of the conditions."""
    ranges = (drive.fit or {}).get("ranges", {})

    def ends(key: str) -> Ends:
        low, high = ranges.get(key, (0.0, 0.0))
        return float(low), float(high)

    return Validity(
        max(map(abs, ends("torque_Nm"))),
        ends("temperature_C"),
        ends("cycles"),
        ends("input_velocity_rad_per_s"),
    )


def _friction(
    drive: Drive, least_rad_per_Nm: float, notes: list[str]
) -> tuple[list[Play], list[Play]]:
    """Operators in series and in parallel, for a torsion curve of this least compliance."""
    outside = _fitted_plays(drive, PLAY_OUTSIDE)
    inside = _fitted_plays(drive, PLAY_SHARE)
    if outside or inside:
        return outside, inside
    if drive.catalogue is not None:
        bank = drive.catalogue.plays(drive.rated_torque_Nm)
        if bank is None:
            notes.append("The data sheet states no hysteresis: the model has none.")
            return [], []
        radius, widening, weight = bank
        total, room = float(np.sum(weight)), PLAYS_SHARE_MAX * least_rad_per_Nm
        swing = 2.0 * float(drive.catalogue.angle(drive.rated_torque_Nm))
        if 2.0 * float(np.dot(weight, radius)) >= swing:
            raise InputError(
                drive.file,
                "catalogue.hysteresis_arcmin",
                f"{2.0 * float(np.dot(weight, radius)) / ARCMIN:.3g} arcmin",
                f"less than the swing between both rated torques, {swing / ARCMIN:.3g} arcmin: "
                "the loop is too wide for the drive",
            )
        if total > room:
            weight = room / total * weight
            width = 2.0 * float(np.dot(weight, radius)) / ARCMIN
            notes.append(
                "The hysteresis of the data sheet, an upper limit, is more than its stiffnesses "
                f"allow: that of the model is {width:.2g} arcmin wide."
            )
        else:
            notes.append("The hysteresis of the model is that of the data sheet, an upper limit.")
        rows = zip(radius, widening, weight, strict=True)
        return [Play(*(float(value) for value in row)) for row in rows], []
    width = _flank_half_width(drive)
    if width <= 0:
        notes.append("The design has no flank friction: the model has no hysteresis.")
        return [], []
    notes.append(
        "The hysteresis of the model is that of the flanks, in proportion to the torque; "
        "bearings and seals add to it."
    )
    share = width / len(FLANK_WIDENINGS)
    return [Play(0.0, widening, share / widening) for widening in FLANK_WIDENINGS], []


def _flank_half_width(drive: Drive) -> float:
    """Half width of the loop due to flank friction, relative to the torque, rad/(N m)."""
    found = design_model(drive).torsion_curve(np.array([drive.rated_torque_Nm]))
    return float(found.friction_half_width_rad[0]) / drive.rated_torque_Nm


def _shaken(plays: Sequence[Play], vibration_Nm: float) -> list[Play]:
    """Operators as they respond to a torque without a vibration that the actual torque has.

    Under a torque T plus an oscillation of amplitude A that decays, the state of an operator of
    radius r ends within r - A of T: the operator of radius r - A has the same response to T.
    """
    return [replace(play, radius_Nm=max(play.radius_Nm - vibration_Nm, 0.0)) for play in plays]


def _effects(drive: Drive, own: Mapping[str, Effect]) -> list[tuple[str, list[float]]]:
    """Effects of the drive file with their values in the library's order and units."""
    c = core(64)
    known = known_effects(c, own)
    found = []
    for index, table in enumerate(drive.effects):
        if table["name"] not in known:
            place = f"effect[{index}].name"
            expected = "an effect of the library, or your own by --effects FILE"
            raise InputError(drive.file, place, table["name"], expected)
        effect = known[table["name"]]
        ranges = own[table["name"]].ranges() if table["name"] in own else value_ranges(c, effect)
        values = effect_values(drive.file, f"effect[{index}]", table, ranges)
        found.append((effect, table["name"], values))
    found.sort(key=lambda entry: int(entry[0].kind))
    return [(name, values) for _, name, values in found]


def _gap_controller(drive: Drive, given: dict[str, float]) -> Controller:
    """Return one play operator as wide as the lost motion that the drive's data state."""
    notes = ["One play operator as wide as the lost motion at 4 % of the rated torque; no curve."]
    at = reversal_torque(drive)
    if drive.catalogue is not None and drive.catalogue.lost_motion_rad is not None:
        width = drive.catalogue.lost_motion_rad
    elif drive.catalogue is not None:
        width = drive.catalogue.reversal_lost_motion(at)
    else:
        width = design_model(drive).reversal_lost_motion(at)
    for key in ("torque_limit", "vibration"):
        if key in given:
            raise InputError(
                "--set", f"{key}_Nm", "this setting", "none: the gap profile has no torque"
            )
    if width <= 0:
        raise InputError(
            drive.file, "lost motion", "none", "a lost motion for the gap profile to compensate"
        )
    dead_band = given.get("dead_band", DEAD_BAND_SHARE * width)
    empty = np.zeros(0)
    limits, watch = _defaults(given, drive, CORRECTION_SHARE * width, empty, empty)
    play = Play(width / 2, 0.0, 1.0)
    return Controller(
        GAP_ANGLE_RAD, empty, empty, limits, watch, [play], notes=notes, dead_band_rad=dead_band
    )


GAP_ANGLE_RAD = 1000.0
"""Largest commanded angle of the gap profile: 159 turns of the output."""


def _defaults(
    given: Mapping[str, float],
    drive: Drive,
    correction_rad: float,
    torque_Nm: FloatArray,
    angle_rad: FloatArray,
) -> tuple[Limits, Watch]:
    """Limits and watch: given settings, others derived from the drive and its resonance."""
    period = given.get("period", 1e-3)
    fastest = 1.0 / (RESPONSE_TICKS * period)
    correction = given.get("correction", correction_rad)
    velocity = given.get("velocity", correction / CROSSING_S)
    resonance = given.get("resonance", RESONANCE_HZ)
    # The gap profile has no torque input, so there is no loop that could oscillate at a resonance.
    response = min(RESPONSE_PER_HZ * resonance, fastest) if torque_Nm.size else fastest
    noise_Nm = given.get("torque_noise", 0.0)
    if noise_Nm > 0 and torque_Nm.size:
        # White noise of the torque causes an acceleration of 64 response^2 slope noise
        # (compensator.h); the limit of the acceleration is 2 response velocity.
        rise = np.ptp(np.interp([-3 * noise_Nm, 3 * noise_Nm], torque_Nm, angle_rad)) / 6
        response = min(response, NOISE_ACCELERATION_SHARE * velocity / (32 * float(rise)))
    response = given.get("response", response)
    if response > fastest * (1 + 1e-6):
        raise InputError("--set", "response_per_s", f"{response:.6g}", f"at most {fastest:.6g}")
    # With these the stages of the limiter do not narrow each other (compensator.c).
    acceleration = given.get("acceleration", 2.0 * response * velocity)
    jerk = given.get("jerk", 8.0 * response * acceleration)
    # The noise floor may exceed the leave-one-run-out error: the difference is model error, not
    # measurement noise.
    fit = drive.fit or {}
    floor_arcsec = float(fit.get("noise_floor_arcsec", 0.0))
    fitted = min(floor_arcsec, float(fit.get("heldout_rms_arcsec", floor_arcsec))) * ARCSEC
    noise = given.get("noise", fitted or NOISE_RAD)
    misfit = given.get("misfit", max(3.0 * noise, MISFIT_SHARE * correction))
    watch = Watch(
        given.get("window", 1.0),
        given.get("fade", 2.0),
        noise,
        misfit,
        given.get("creep", CREEP_RAD_PER_S),
        given.get("ringing", RINGING_SHARE * resonance),
    )
    return Limits(period, correction, velocity, acceleration, jerk, response), watch
