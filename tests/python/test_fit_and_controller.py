"""The controller computes in float32 every effect that `fit` adds to a drive."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from lostmotion.core import core
from lostmotion.discover.fitted_model import FittedModel, fit_model
from lostmotion.discover.stepwise_fit import EstimatedValues
from lostmotion.drives import PLAY_ENVELOPE, PLAY_KNEE, format_toml, read_drive
from lostmotion.effects.conditions import RATE_WINDOW, Conditions
from lostmotion.effects.library import library
from lostmotion.errors import InputError
from lostmotion.export import build, make_controller
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.drive_file import restore
from lostmotion.fit.hysteresis import PLAYS
from lostmotion.fit.terms import Term
from lostmotion.recordings import Campaign, read_campaign
from lostmotion.replay import OUTPUTS, conditions, replay
from lostmotion.units import ARCSEC

RATIO = 100
RATED_NM = 40.0
SAMPLES = 3000
PERIOD_S = 4e-3

SWING = 200
"""Samples of a first swing beyond all later ones, which erases the start state of the friction."""

# The fit computes a rate from a line through seven samples, the controller from the last step. In a
# uniform motion, away from its ends, both are the same.
INNER = slice(SWING, -2 * RATE_WINDOW)

ROUNDINGS = 20
"""Rounding errors of the conditions, the parameters and the arithmetic, relative to the largest
angle."""

DRIVE = f"""
[drive]
name = "joint"
ratio = {RATIO}
rated_torque_Nm = {RATED_NM}
[catalogue]
T1_Nm = 7
T2_Nm = 25
K1_Nm_per_rad = 16e3
K2_Nm_per_rad = 25e3
K3_Nm_per_rad = 29e3
"""


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Campaign:
    """A loaded joint in uniform motion that warms up; the torque goes to 1.5 times rated."""
    time = np.arange(SAMPLES) * PERIOD_S
    torque = 38.0 * np.sin(7.0 * time) * np.sin(1.3 * time) + 20.0 * np.sin(23.0 * time)
    torque[:SWING] = 60.0 * np.sin(np.linspace(0.0, 2.0 * np.pi, SWING))
    columns = {
        "time_s": time,
        "torque_Nm": torque,
        "input_angle_rad": 2.0 + 8.0 * time,
        "output_angle_rad": 0.02 + 0.08 * time + 0.05 * time**2,
        "lost_motion_rad": torque / 2e4,
        "temperature_C": 22.0 + 2.0 * time,
        "cycles": 1e5 + 1e5 * time,
        "tilt_moment_Nm": 20.0 * np.cos(3.0 * time),
        "axial_force_N": 90.0 * np.sin(2.0 * time),
    }
    file = tmp_path_factory.mktemp("log") / "log.csv"
    rows = np.column_stack(list(columns.values()))
    np.savetxt(file, rows, delimiter=",", header=",".join(columns), comments="", fmt="%.17g")
    return read_campaign([file], ratio=RATIO)


PLACES = ("inside", "both", "inside+load")
"""Form of the hysteresis (`lostmotion.friction`)."""

OUTSIDE = 0.04
"""Compliance of each play outside, relative to the least of the torsion curve."""


def put_friction_outside(base: BaselineModel) -> None:
    """Friction also in series with the spring, limited so that the model has an inverse."""
    base.hysteresis.outside = np.full(PLAYS, OUTSIDE * float(base.curve.slopes.min()))


def let_friction_grow(base: BaselineModel) -> None:
    """Friction that grows with the load, in addition to that of constant width."""
    base.hysteresis.allow_load()
    grows = base.hysteresis.growth > 0
    base.hysteresis.shares[grows] = 0.25 / np.count_nonzero(grows)


def fitted(campaign: Campaign, name: str, size: float) -> BaselineModel:
    """A baseline model as from a fit, with one effect of a multiple of its typical size."""
    base = BaselineModel(Conditions(campaign), RATED_NM)
    stretches = np.arange(base.curve.slopes.size)
    base.curve.slopes = 11.0 - 0.25 * stretches
    base.hysteresis.shares = 0.02 + 0.01 * np.arange(PLAYS)
    base.hysteresis.envelope_Nm = 0.25 * base.hysteresis.knee_Nm
    effect = library()[name]
    values = effect.typical.copy()
    for i, value in enumerate(effect.values):
        if value.role == "linear":
            values[i] = size * (value.typical or 1e-5)
    if name == "ratcheting":
        values[0] = 45.0
    base.terms = [Term(effect, values, [])]
    return base


def rounding(angle: npt.NDArray[np.float64]) -> float:
    """Permitted error of an angle in float32."""
    return float(ROUNDINGS * np.finfo(np.float32).epsneg * np.max(np.abs(angle)))


def fitted_file(base: BaselineModel, folder: Path) -> Path:
    """Write the drive file of a fitted baseline model."""
    numbers = {
        "slope_{}_rad_per_Nm": base.curve.slopes * ARCSEC,
        "play_share_{}": base.hysteresis.shares,
        "knot_{}_Nm": base.curve.knots_Nm,
        "play_radius_{}_Nm": base.hysteresis.radius_Nm,
    }
    if base.hysteresis.widening is not None:
        numbers["play_widening_{}"] = base.hysteresis.widening
    if base.hysteresis.outside is not None:
        numbers["play_outside_{}_rad_per_Nm"] = base.hysteresis.outside * ARCSEC
    named = {
        name.format(i + 1): value
        for name, values in numbers.items()
        for i, value in enumerate(values)
    }
    named |= {PLAY_ENVELOPE: base.hysteresis.envelope_Nm, PLAY_KNEE: base.hysteresis.knee_Nm}
    count = len(named)
    rung = {"effects": [], "rms_arcsec": 1.0, "rms_heldout_arcsec": 1.0}
    model = FittedModel(
        base,
        [rung],
        1.0,
        1.0,
        EstimatedValues(list(named), np.array(list(named.values())), np.zeros((count, count)), []),
    )
    (folder / "joint.toml").write_text(DRIVE)
    document = model.document(read_drive(folder / "joint.toml"))
    (folder / "fitted.toml").write_text(format_toml(document))
    return folder / "fitted.toml"


def exported(base: BaselineModel, folder: Path) -> npt.NDArray[np.float64]:
    """Lost motion in arc seconds that the controller computes from the fitted drive file."""
    controller = make_controller(read_drive(fitted_file(base, folder)), profile="full")
    tape = replay(build(controller), base.conditions.campaign).tapes[0]
    model_rad = tape.values[:, OUTPUTS.index("lost_motion_rad")]
    return np.asarray(model_rad, dtype=np.float64) / ARCSEC


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("name", sorted(library()))
def test_the_controller_computes_what_the_fit_predicts(
    campaign: Campaign, tmp_path: Path, name: str, place: str
) -> None:
    without = fitted(campaign, name, 0.0)
    without.terms = []
    base = fitted(campaign, name, 3.0)
    if place == "both":
        put_friction_outside(without)
        put_friction_outside(base)
    if place == "inside+load":
        let_friction_grow(without)
        let_friction_grow(base)
    predicted = base.at().angle
    # The effect is visible far above the rounding.
    assert np.max(np.abs((predicted - without.at().angle)[INNER])) > 1000 * rounding(predicted)
    difference = exported(base, tmp_path) - predicted
    assert np.max(np.abs(difference[INNER])) < rounding(predicted)


def test_all_effects_at_once(campaign: Campaign, tmp_path: Path) -> None:
    base = fitted(campaign, "wear", 1.0)
    base.terms = [fitted(campaign, name, 1.0).terms[0] for name in sorted(library())]
    predicted = base.at().angle
    difference = (exported(base, tmp_path) - predicted)[INNER]
    assert np.max(np.abs(difference)) < rounding(predicted)


@pytest.mark.parametrize("place", PLACES)
def test_replay_gives_the_bits_of_the_model_in_float32(
    campaign: Campaign, tmp_path: Path, place: str
) -> None:
    base = fitted(campaign, "wear", 1.0)
    base.terms = [fitted(campaign, name, 1.0).terms[0] for name in sorted(library())]
    if place == "both":
        put_friction_outside(base)
    parameters = build(make_controller(read_drive(fitted_file(base, tmp_path)), profile="full"))
    c = core(32)
    columns = {name: c.array(values) for name, values in conditions(campaign.runs[0]).items()}
    # The first row has no row before it; the compensator assumes the usual period.
    assert columns["elapsed_s"][0] == 0
    columns["elapsed_s"][0] = parameters.limits.period_s
    recording = c.ffi.new("lm_recording *")
    recording.count = SAMPLES
    kept = {name: c.pointer(values) for name, values in columns.items()}
    for name, pointer in kept.items():
        setattr(recording, name, pointer)
    memory = c.ffi.new("lm_memory *")
    c.lib.lm_start_model(memory, columns["torque_Nm"][0])
    angle = c.zeros(SAMPLES)
    c.lib.lm_run_model(parameters, memory, recording, c.pointer(angle, write=True))
    tape = replay(parameters, campaign).tapes[0]
    controller = np.ascontiguousarray(tape.values[:, OUTPUTS.index("lost_motion_rad")])
    assert np.ptp(angle) > 1e-4
    np.testing.assert_array_equal(controller.view(np.uint32), angle.view(np.uint32))


def test_friction_outside_survives_its_file_and_is_refused_where_it_is_too_much(
    campaign: Campaign, tmp_path: Path
) -> None:
    base = fitted(campaign, "wear", 1.0)
    put_friction_outside(base)
    drive = read_drive(fitted_file(base, tmp_path))
    assert drive.fit is not None
    assert drive.fit["friction"] == "both"
    again = BaselineModel(Conditions(campaign), RATED_NM)
    restore(drive, again, library())
    assert again.hysteresis.outside is not None
    assert base.hysteresis.outside is not None
    np.testing.assert_allclose(again.hysteresis.outside, base.hysteresis.outside, rtol=1e-12)
    assert (again.hysteresis.envelope_Nm, again.hysteresis.knee_Nm) == (
        base.hysteresis.envelope_Nm,
        base.hysteresis.knee_Nm,
    )
    made = make_controller(drive, profile="full")
    assert (len(made.outside), len(made.inside)) == (PLAYS, PLAYS)
    with pytest.raises(InputError, match="found 16, expected at most 8 in the profile"):
        make_controller(drive)
    base.hysteresis.outside *= 10
    with pytest.raises(InputError, match="the loop is too wide"):
        build(make_controller(read_drive(fitted_file(base, tmp_path)), profile="full"))


@pytest.mark.parametrize("place", PLACES)
def test_runs_that_were_not_fitted_decide_where_friction_sits(
    campaign: Campaign, tmp_path: Path, place: str
) -> None:
    base = fitted(campaign, "wear", 0.0)
    base.terms = []
    if place == "both":
        base.hysteresis.shares = np.full(PLAYS, 0.02)
        base.hysteresis.outside = np.full(PLAYS, 0.3)
    if place == "inside+load":
        let_friction_grow(base)
    noise = 0.5 * np.random.default_rng(4).standard_normal(SAMPLES)
    columns = {
        "run": np.arange(SAMPLES) // 500,
        "time_s": campaign.runs[0].time_s,
        "torque_Nm": campaign.column("torque"),
        "lost_motion_arcsec": base.at().angle + noise,
    }
    file = tmp_path / "runs.csv"
    rows = np.column_stack(list(columns.values()))
    np.savetxt(file, rows, delimiter=",", header=",".join(columns), comments="", fmt="%.9g")
    (tmp_path / "joint.toml").write_text(DRIVE)
    drive = read_drive(tmp_path / "joint.toml")
    data = read_campaign([file], ratio=RATIO)
    model = fit_model(drive, data, [])
    assert model.document(drive)["fit"]["friction"] == place
    assert model.ladder[-1]["rms_heldout_arcsec"] < 0.6
    kept = fit_model(drive, data, [], friction="inside")
    assert kept.document(drive)["fit"]["friction"] == "inside"
