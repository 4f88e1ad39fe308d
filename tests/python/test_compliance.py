"""Effects on the compliance: they move the friction of a loaded drive that turns."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from small_campaigns import RATED_NM, campaign

from lostmotion.core import core
from lostmotion.discover import diagnose
from lostmotion.discover.conclusion import HYSTERESIS_FORM
from lostmotion.drives import read_drive
from lostmotion.effects.conditions import Conditions
from lostmotion.effects.library import library
from lostmotion.fit.baseline import COMPLIANCE_MAX, BaselineModel
from lostmotion.fit.hysteresis import PLAYS
from lostmotion.fit.terms import Term
from lostmotion.recordings import read_campaign
from lostmotion.torsion_curve import run_plays

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rig.laboratory import Laboratory

MODULATION = library()["stiffness_modulation"]


def modulated(cosine: float, sine: float) -> BaselineModel:
    """A model with friction in parallel and in series, and a modulated compliance."""
    base = BaselineModel(Conditions(campaign(warm=False)), RATED_NM)
    base.hysteresis.shares = 0.02 + 0.01 * np.arange(PLAYS)
    base.hysteresis.outside = np.full(PLAYS, 0.02 * base.curve.mean_slope)
    base.terms = [Term(MODULATION, np.array([cosine, sine]), [0, 1])]
    return base


def test_derivatives_are_those_of_the_model() -> None:
    """Also of the friction, whose operators follow the torque times the compliance."""
    base = modulated(0.2, -0.1)
    columns, x = base.fixed_columns(base.at()), base.vector()[0]
    for place, name in enumerate(base.names()):
        if name.startswith("start"):
            continue
        step = 1e-3 * max(abs(x[place]), 0.01)
        ends = []
        for moved in (x[place] + step, x[place] - step):
            other = base.copy()
            other.set_vector(np.where(np.arange(x.size) == place, moved, x))
            ends.append(other.angle())
        change = (ends[0] - ends[1]) / (2 * step)
        # Operators have kinks, across which a larger step takes a mean.
        near = np.abs(change - columns[:, place]) <= 0.02 * np.abs(change).max()
        assert np.mean(near) > 0.95, name


def test_a_compliance_multiplies_the_elastic_angle_and_is_limited() -> None:
    base = modulated(0.0, 0.0)
    plain = base.at()
    assert np.all(plain.compliance == 1.0)
    base.terms[0].values = np.array([0.3, 0.0])
    base.hysteresis.shares[:] = 0.0
    base.hysteresis.outside = np.zeros(PLAYS)
    c, softer = base.conditions, base.at()
    cosine = np.cos(2.0 * c.columns["input_angle_rad"])
    curve = base.curve.angle(c.torque)
    np.testing.assert_allclose(softer.angle, (1.0 + 0.3 * cosine) * curve, rtol=1e-12)
    base.terms[0].values = np.array([-100.0, 0.0])
    assert set(np.round(base.at().compliance, 12)) <= {1.0 / COMPLIANCE_MAX, COMPLIANCE_MAX}


def test_friction_beside_a_softer_spring_follows_its_own_angle() -> None:
    """Brute force: sliders beside a spring whose compliance changes, on the angle itself."""
    stiffness, slider, limit = 100.0, np.array([150.0, 80.0]), np.array([2.0, 6.0])
    torque = 20.0 * np.sin(np.linspace(0.0, 9.0 * np.pi, 3000))
    compliance = np.repeat([1.0, 1.15, 0.9], 1000)
    anchors, true = np.zeros(2), np.empty(torque.size)
    for k, (load, softer) in enumerate(zip(torque, compliance, strict=True)):
        low, high = -1.0, 1.0
        for _ in range(60):
            angle = 0.5 * (low + high)
            friction = np.clip(slider * (angle - anchors), -limit, limit)
            if stiffness / softer * angle + friction.sum() < load:
                low = angle
            else:
                high = angle
        anchors, true[k] = angle - friction / slider, angle
    # The same drive without the change, as play operators on its torque: they slip one by one.
    beside = stiffness + np.array([slider.sum(), slider[1]])
    radius = np.array([limit[0] / slider[0] * beside[0], 0.0])
    radius[1] = radius[0] + (limit[1] / slider[1] - limit[0] / slider[0]) * beside[1]
    shares = np.array([stiffness / beside[1] - stiffness / beside[0], 1.0 - stiffness / beside[1]])
    errors, c = [], core(64)
    bank = c.ffi.new("lm_play_bank *", {"knee_Nm": 1.0})
    for factor in (compliance, np.ones(torque.size)):
        followed = np.empty(torque.size)
        c.lib.lm_find_followed(
            bank, *(c.pointer(c.array(one)) for one in (radius, np.zeros(2), shares)), 2,
            *(c.pointer(c.array(one)) for one in (torque, factor)), c.ffi.NULL, torque.size,
            c.pointer(c.zeros(2), write=True), c.pointer(followed, write=True),
        )  # fmt: skip
        wound = torque + run_plays(radius, followed) @ shares
        errors.append(np.sqrt(np.mean((compliance * wound / stiffness - true) ** 2)))
    assert errors[0] < 0.03 * errors[1]


@pytest.mark.parametrize(
    ("seed", "law", "protocol", "noises", "left"),
    [
        (55, "dahl", "turntable", 1.0, []),
        (55, "dead_zone", "arm", 1.0, []),
        (59, "maxwell", "turntable", 2.0, []),
        (101, "dahl", "turntable", 2.0, [HYSTERESIS_FORM]),
        (101, "dead_zone", "arm", 1.0, [HYSTERESIS_FORM]),
    ],
)
def test_friction_that_the_modulation_shakes_is_no_effect_of_its_own(
    seed: int, law: str, protocol: str, noises: float, left: list[str], tmp_path: Path
) -> None:
    """A turning drive: its friction follows the modulated angle, of whatever law it is."""
    Laboratory(seed, law, protocol).write(tmp_path, MODULATION.name, noises)
    drive = read_drive(tmp_path / "drive.toml")
    data = read_campaign(sorted(tmp_path.glob("*.csv.gz")), ratio=drive.ratio)
    found = diagnose(drive, data)
    assert (found.verdict, found.effects) == (
        "unexplained" if left else "missing-effect",
        [MODULATION.name],
    )
    assert [one["shape"] for one in found.unexplained["depends_on"]] == left
