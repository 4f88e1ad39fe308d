"""What `fit` adds to a drive is what its controller computes: every effect, in float32."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from lostmotion.discover.backbone import PLAYS, Base, Term
from lostmotion.discover.conditions import RATE_WINDOW, Conditions
from lostmotion.discover.effects import library
from lostmotion.discover.ladder import FittedModel
from lostmotion.drives import format_toml, read_drive
from lostmotion.export import build, make_controller
from lostmotion.recordings import Campaign, read_campaign
from lostmotion.replay import OUTPUTS, replay
from lostmotion.units import ARCSEC

RATIO = 100
RATED_NM = 40.0
SAMPLES = 3000
PERIOD_S = 4e-3

SWING = 200
"""Samples in which one swing beyond all later ones wipes out where the friction stood at first."""

# A rate is a line through seven samples for the fit and the last step for the controller. In a
# uniform motion, away from its ends, both are the same.
INNER = slice(SWING, -2 * RATE_WINDOW)

ROUNDINGS = 20
"""Of a float, of the largest angle: those of the conditions, the parameters and the arithmetic."""

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


def fitted(campaign: Campaign, name: str, size: float) -> Base:
    """A base as a fit leaves it, with one effect of some multiple of its typical size."""
    base = Base(Conditions(campaign), RATED_NM)
    stretches = np.arange(base.slopes.size)
    base.slopes = 11.0 - 0.25 * stretches
    base.shares = 0.02 + 0.01 * np.arange(PLAYS)
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
    """What float32 may miss an angle by."""
    return float(ROUNDINGS * np.finfo(np.float32).epsneg * np.max(np.abs(angle)))


def exported(base: Base, folder: Path) -> npt.NDArray[np.float64]:
    """Lost motion in arc seconds that the controller computes, by way of the fitted drive file."""
    numbers = {
        "slope_{}_rad_per_Nm": base.slopes * ARCSEC,
        "play_share_{}": base.shares,
        "knot_{}_Nm": base.knots_Nm,
        "play_radius_{}_Nm": base.radius_Nm,
    }
    named = {
        name.format(i + 1): value
        for name, values in numbers.items()
        for i, value in enumerate(values)
    }
    count = len(named)
    rung = {"effects": [], "rms_arcsec": 1.0, "rms_heldout_arcsec": 1.0}
    model = FittedModel(
        base,
        [rung],
        1.0,
        list(named),
        np.array(list(named.values())),
        np.zeros(count),
        np.zeros((count, count)),
        [],
    )
    (folder / "joint.toml").write_text(DRIVE)
    document = model.document(read_drive(folder / "joint.toml"))
    (folder / "fitted.toml").write_text(format_toml(document))
    controller = make_controller(read_drive(folder / "fitted.toml"), profile="full")
    tape = replay(build(controller), base.conditions.campaign).tapes[0]
    model_rad = tape.values[:, OUTPUTS.index("lost_motion_rad")]
    return np.asarray(model_rad, dtype=np.float64) / ARCSEC


@pytest.mark.parametrize("name", sorted(library()))
def test_the_controller_computes_what_the_fit_predicts(
    campaign: Campaign, tmp_path: Path, name: str
) -> None:
    without = fitted(campaign, name, 0.0)
    without.terms = []
    base = fitted(campaign, name, 3.0)
    predicted = base.at().angle
    # The effect is there to be seen, far above the rounding.
    assert np.max(np.abs((predicted - without.at().angle)[INNER])) > 1000 * rounding(predicted)
    difference = exported(base, tmp_path) - predicted
    assert np.max(np.abs(difference[INNER])) < rounding(predicted)


def test_all_effects_at_once(campaign: Campaign, tmp_path: Path) -> None:
    base = fitted(campaign, "wear", 1.0)
    base.terms = [fitted(campaign, name, 1.0).terms[0] for name in sorted(library())]
    predicted = base.at().angle
    difference = (exported(base, tmp_path) - predicted)[INNER]
    assert np.max(np.abs(difference)) < rounding(predicted)
