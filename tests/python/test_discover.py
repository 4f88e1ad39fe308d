"""Discovery from recordings to the answer, on small campaigns made here."""

from __future__ import annotations

import dataclasses
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from conftest import needs_compiler
from lostmotion.backbone import run_plays
from lostmotion.candidates.forms import form_of
from lostmotion.cli import main
from lostmotion.discover import Value, diagnose, effect, library, selection
from lostmotion.discover.answer import plausible
from lostmotion.discover.fitted_model import fit_model
from lostmotion.discover.gates import size_of
from lostmotion.discover.linearise import plain_rms, settle
from lostmotion.discover.measurement_noise import estimate_noise
from lostmotion.discover.next_run import next_runs
from lostmotion.discover.outliers import clean_outliers
from lostmotion.discover.recording_check import check
from lostmotion.discover.refits import refitted, without_deviations
from lostmotion.discover.selection import taken_from_all, without_idle
from lostmotion.discover.terms import term_size
from lostmotion.drives import format_toml, parse_drive, read_drive, tomllib
from lostmotion.effects.conditions import Conditions
from lostmotion.effects.loading import load_python, load_shared_object
from lostmotion.effects.template import template
from lostmotion.errors import InputError
from lostmotion.fit.baseline import RUN_SCATTER, Base, Term
from lostmotion.fit.drive_file import make_base
from lostmotion.recordings import Campaign, Run
from lostmotion.report.discovery import verdict_sentence
from lostmotion.threads import in_parallel
from lostmotion.units import parse_unit

ARCSEC = np.pi / 180 / 3600
RATED_NM = 40.0
RATIO = 100.0
DRIVE = """
[drive]
name = "small"
ratio = 100
rated_torque_Nm = 40
[catalogue]
T1_Nm = 7
T2_Nm = 25
K1_Nm_per_rad = 16e3
K2_Nm_per_rad = 25e3
K3_Nm_per_rad = 29e3
"""
ROOT = Path(__file__).parents[2]


def torque_of(run, rows):
    """Triangles of three amplitudes."""
    t = np.arange(rows) * 0.1
    size = RATED_NM * (0.4, 0.7, 1.0)[run % 3]
    return size * 2 / np.pi * np.arcsin(np.sin(2 * np.pi * t / 25.0))


def campaign(seed=1, runs=12, rows=500, add=None, *, warm=True, noise=1.0, slip=None, zero=5.0):
    """Torque loops at several temperatures, with noise, friction and scatter from run to run."""
    rng = np.random.default_rng(seed)
    made = []
    swings = [torque_of(r, rows) for r in range(runs)]
    # What friction remembers goes on from run to run.
    remembered = run_plays(np.array([3.0]), np.concatenate(swings), 0.0)[:, 0].reshape(runs, rows)
    temperature = rng.permutation(np.linspace(10, 45, runs)) if warm else np.full(runs, 20.0)
    for r in range(runs):
        t = np.arange(rows) * 0.1
        torque = swings[r]
        stiff, wide = 1 + 0.003 * rng.normal(), 1 + 0.02 * rng.normal()
        wound = torque + 0.5 * wide * remembered[r]
        backbone = stiff * (wound * 7.0 + 25.0 * np.tanh(wound / 8.0))
        columns = {
            "time": t,
            "torque": torque,
            "temperature": temperature[r] + 0.02 * t,
            "input_angle": np.full(rows, 0.7 * r),
            "output_angle": np.full(rows, 0.007 * r),
        }
        y = backbone + noise * rng.normal(size=rows) + zero * rng.normal()
        if add is not None:
            y = y + add(columns, wound)
        if slip is not None and slip[0] == r:
            y = y + slip[2] * (t >= slip[1])
        if slip is not None and slip[0] < r and zero == 0.0:  # else the sensor is set again
            y = y + slip[2]
        columns["lost_motion"] = y * ARCSEC
        made.append(Run(r + 1, "made.csv", columns))
    return Campaign(made)


def gap(columns, wound):
    """A gap that opens with temperature: 1 arcsec a K in all."""
    return 0.3 * (columns["temperature"] - 20.0) * np.tanh(wound / 0.2)


def ripple(columns, wound):
    """What no drive has."""
    return 3.0 * np.cos(2 * np.pi * columns["torque"] / 5.0)


@pytest.fixture(scope="module")
def warm_gap():
    return diagnose(campaign(add=gap), ratio=RATIO, rated_torque_Nm=RATED_NM)


def answer_of(data, **more):
    return diagnose(data, ratio=RATIO, rated_torque_Nm=RATED_NM, **more).answer()


def read_by_encoders(data, *, turned=True):
    """The output's encoder, whose reading holds the lost motion and its noise."""
    made = []
    for run in data.runs:
        columns = dict(run.columns)
        columns["output_angle"] = columns["input_angle"] / RATIO + columns["lost_motion"]
        if not turned:
            del columns["input_angle"]
        made.append(Run(run.label, run.file, columns))
    return Campaign(made)


@pytest.mark.parametrize("turned", [True, False])
def test_the_noise_of_the_encoder_is_no_acceleration(turned):
    data = read_by_encoders(campaign(seed=3, warm=False), turned=turned)
    found = answer_of(data)
    assert (found["verdict"], found["effects"]) == ("complete", [])
    by_name = {c["name"]: c for c in found["candidates"]}
    assert not by_name["inertia"]["testable"]


def test_an_output_that_was_measured_apart_stays_as_it_was_read():
    data = campaign(seed=3, runs=6, rows=200, warm=False)
    for run in data.runs:
        del run.columns["input_angle"]
        run.columns["output_angle"] = 1e-3 * np.sin(run.columns["time"])
    np.testing.assert_array_equal(
        Conditions(data).columns["output_angle_rad"], data.column("output_angle")
    )


def test_nothing_is_missing_when_nothing_is():
    found = answer_of(campaign(seed=2))
    assert found["verdict"] == "complete"
    assert found["effects"] == []
    # 1 arcsec of noise and scatter of 0.3 % and 2 %
    assert 0.95 < found["noise_floor_arcsec"] < 1.6


def test_the_missing_effect_is_named_and_the_error_falls(warm_gap):
    found = warm_gap.answer()
    assert found["verdict"] == "missing-effect"
    assert found["effects"] == ["thermal_gap"]
    rms = [rung["rms_arcsec"] for rung in found["ladder"]]
    assert rms[1] < 0.6 * rms[0]
    assert rms[1] < 1.2 * found["noise_floor_arcsec"]
    first = found["candidates"][0]
    assert first["name"] == "thermal_gap"
    assert first["parameters"]["gap_rad_per_K"] == pytest.approx(0.3 * ARCSEC, rel=0.1)
    assert first["at_bound"] == ["gap_rad"]  # the gap never closes: any large one will do


def test_the_answer_has_every_key_of_the_interface(warm_gap):
    found = json.loads(json.dumps(warm_gap.answer(), allow_nan=False))
    assert found["schema"] == "lostmotion.diagnosis/1"
    wanted = {
        "verdict",
        "noise_floor_arcsec",
        "effects",
        "ladder",
        "candidates",
        "events",
        "smallest_detectable",
        "unexplained",
        "next_experiment",
    }
    assert wanted <= set(found)
    detectable = found["smallest_detectable"]
    assert detectable["thermal_stiffness"]["unit"] == "per K"
    assert detectable["thermal_stiffness"]["parameter"] == "share"
    slip = detectable["ratcheting"]
    assert (slip["parameter"], slip["unit"]) == ("teeth", "-")
    for one in detectable.values():
        assert one["value"] > 0
        assert one["unit"] == "-" or parse_unit(one["unit"].replace(" ", "_")) is not None
    for candidate in found["candidates"]:
        assert {
            "name",
            "heldout_rms_arcsec",
            "evidence",
            "parameters",
            "confused_with",
            "plausible",
            "testable",
        } <= set(candidate)
    assert {c["name"] for c in found["candidates"]} == set(library())


def test_the_same_recordings_give_the_same_answer(warm_gap):
    assert answer_of(campaign(add=gap)) == warm_gap.answer()


def turned_against(friction_Nm):
    """Runs in which the input turns there and back, at three speeds, against friction."""
    data = campaign(seed=5, warm=False)
    rng = np.random.default_rng(5)
    for r, run in enumerate(data.runs):
        t = run.columns["time"]
        speed = (2.0, 6.0, 10.0)[r % 3] * np.tanh(20.0 * np.cos(0.5 * t))
        wound = run.columns["torque"]
        slope = 7.0 + 25.0 / 8.0 / np.cosh(wound / 8.0) ** 2
        run.columns["input_angle"] = np.cumsum(speed) * 0.1
        run.columns["input_velocity"] = speed + 1e-3 * rng.normal(size=t.size)
        run.columns["lost_motion"] = (
            run.columns["lost_motion"] - slope * friction_Nm(speed) * ARCSEC
        )
    return data


@pytest.mark.parametrize(
    ("friction_Nm", "name"),
    [
        (lambda speed: 0.02 * speed, "viscous_friction"),
        (
            lambda speed: 0.4 * np.tanh(speed) * (1 + np.exp(-np.abs(speed / 6))),
            "stribeck_friction",
        ),
    ],
)
def test_friction_that_rises_with_speed_is_drag_and_what_falls_is_stribecks(friction_Nm, name):
    found = answer_of(turned_against(friction_Nm))
    assert (found["verdict"], found["effects"]) == ("missing-effect", [name])


def test_values_that_make_an_effect_another_are_told():
    stribeck = library()["stribeck_friction"]
    lost = [value.name for value in stribeck.values].index("breakaway_Nm")
    for coulomb, breakaway, told in ((0.6, -0.1, lost), (0.6, 0.1, None), (-0.6, -0.1, None)):
        values = stribeck.typical.copy()
        values[:2] = coulomb, breakaway
        assert stribeck.against_its_name(values) == told
        assert plausible(stribeck, values) == (told is None)
    assert library()["viscous_friction"].against_its_name(np.array([-1.0])) is None


def sliders_beside_a_spring(seed: int, runs: int = 18, rows: int = 800) -> Campaign:
    """Torque loops of a spring that stiffens with sliders beside it, which slip at a deflection.

    No characteristic of straight pieces with plays on the torque has exactly this form.
    """
    rng = np.random.default_rng(seed)
    arcsec = np.pi / 180 / 3600
    phase = np.linspace(0, 8, rows)
    amplitude = np.resize([40.0, 20.0, 8.0], runs)
    torque = np.outer(amplitude, 1 - np.abs((phase + 1) % 4 - 2))
    stiffness = 29e3 * (1 + 0.003 * rng.standard_normal(runs))
    friction = np.exp(0.02 * rng.standard_normal(runs))
    bend, sliders = 5.0 / 16e3, 20
    slips_at = np.geomspace(2, 60, sliders) * arcsec
    strength = rng.dirichlet(np.full(sliders, 3.0)) * 12 * arcsec * 16e3
    most = np.outer(friction, strength)

    def slide(force, way):
        return np.clip(force + np.outer(way, strength / slips_at), -most, most)

    force, at = np.zeros((runs, sliders)), np.zeros(runs)
    lost = np.empty((runs, rows))
    for n in range(rows):
        low, high = at - 2e-3, at + 2e-3
        for _ in range(40):
            middle = 0.5 * (low + high)
            spring = stiffness * (middle - 0.5 * bend * np.arctan(middle / bend))
            above = spring + slide(force, middle - at).sum(axis=1) > torque[:, n]
            low, high = np.where(above, low, middle), np.where(above, middle, high)
        force, at = slide(force, high - at), high
        lost[:, n] = at
    lost += 1.2 * arcsec * rng.standard_normal((runs, rows))
    time = np.arange(rows) * 0.05
    columns = [{"time": time, "torque": torque[i], "lost_motion": lost[i]} for i in range(runs)]
    return Campaign([Run(i, "made", columns[i]) for i in range(runs)])


@pytest.mark.parametrize("seed", [1, 2])
def test_friction_of_another_form_than_the_base_is_no_missing_effect(seed):
    found = diagnose(sliders_beside_a_spring(seed), ratio=100.0, rated_torque_Nm=40.0).answer()
    assert (found["verdict"], found["effects"], found["events"]) == ("complete", [], [])
    assert not [c for c in found["candidates"] if c.get("too_small")]


@pytest.mark.parametrize("name", ["load_dependent_friction", "creep"])
def test_what_takes_work_never_gives_it(name):
    takes = library()[name]
    (linear,) = takes.indices("linear")
    assert takes.values[linear].low == 0
    assert form_of(takes).possible(takes, np.array([0.1]))
    assert not form_of(takes).possible(takes, np.array([-0.1]))


@pytest.mark.parametrize(("off_Nm", "wide_Nm", "gap_arcsec"), [(1.5, 0.3, 9.0), (0.4, 0.1, 4.0)])
def test_a_sensor_off_by_more_than_the_gap_is_wide_is_no_uneven_spring(off_Nm, wide_Nm, gap_arcsec):
    """The tangent on a base that blurred the gap says less than that of its twin."""
    data = campaign(seed=3, add=lambda columns, wound: gap_arcsec * np.tanh(wound / wide_Nm))
    for run in data.runs:
        run.columns["torque"] = run.columns["torque"] + off_Nm
    found = answer_of(data)
    assert (found["verdict"], found["effects"]) == ("missing-effect", ["torque_offset"])
    (offset,) = (c for c in found["candidates"] if c["name"] == "torque_offset")
    assert offset["parameters"]["offset_Nm"] == pytest.approx(-off_Nm, rel=0.1)


def test_an_offset_is_no_larger_than_what_it_explains(monkeypatch):
    """Nor does it hide a weaker effect: its tangent goes on beyond the kink that it moves."""
    sizes = []
    fitted_size = selection.fitted_size

    def noted(stage, contender):
        sizes.append((contender.result.name, fitted_size(stage, contender)))
        return sizes[-1][1]

    monkeypatch.setattr(selection, "fitted_size", noted)
    data = campaign(seed=3, add=lambda at, wound: 9.0 * np.tanh(wound / 0.1) + 0.5 * gap(at, wound))
    for run in data.runs:
        run.columns["torque"] = run.columns["torque"] + 1.5
    found = answer_of(data)
    assert found["effects"] == ["torque_offset", "thermal_gap"]
    before, after = (rung["rms_arcsec"] for rung in found["ladder"][:2])
    size = next(size for name, size in sizes if name == "torque_offset")
    assert size == pytest.approx(np.sqrt(before**2 - after**2), rel=0.05)


def test_what_no_effect_explains_is_said_to_hang_on_torque():
    found = answer_of(campaign(seed=3, add=ripple))
    assert found["verdict"] == "unexplained"
    assert found["unexplained"]["depends_on"][0]["covariate"] == "torque"
    period = float(found["unexplained"]["depends_on"][0]["shape"].split()[2])
    assert period == pytest.approx(5.0, rel=0.01)


@pytest.mark.parametrize("zero", [5.0, 0.0], ids=["set to zero again", "stays"])
def test_a_slip_is_placed_in_its_run_and_second(zero):
    """And what later runs keep of it is no second cause."""
    diagnosis = diagnose(
        campaign(seed=4, slip=(6, 23.0, 8.0), zero=zero), ratio=RATIO, rated_torque_Nm=RATED_NM
    )
    found = diagnosis.answer()
    step = diagnosis.selection.settled[-1].base.additives[0]
    if zero == 0:
        assert step.coefficients == pytest.approx([8.0, 8.0], abs=1.0)
    assert np.array_equal(step.columns.sum(axis=1), np.arange(6000) >= 6 * 500 + 230)
    assert found["verdict"] == "unexplained"
    assert [one["covariate"] for one in found["unexplained"]["depends_on"]] == ["time"]
    event = found["events"][0]
    assert event["run"] == 7
    assert event["time_s"] == pytest.approx(23.0, abs=0.5)
    assert event["size_arcsec"] == pytest.approx(8.0, abs=1.0)


@pytest.mark.parametrize("lost_arcsec", [12.0, -30.0])
def test_counts_that_the_input_lost_are_placed_in_their_run_and_second(lost_arcsec):
    """The angle jumps with the lost motion, and no shape over the angle takes their place."""
    rng = np.random.default_rng(2)
    data = campaign(seed=6)
    for run in data.runs:
        angle = run.columns["input_angle"] + 2e-5 * rng.normal(size=500)
        run.columns["input_angle"] = angle
    lost = np.where(np.arange(500) >= 230, lost_arcsec * ARCSEC, 0.0)
    columns = data.runs[6].columns
    columns["input_angle"] = columns["input_angle"] - RATIO * lost
    columns["lost_motion"] = columns["lost_motion"] + lost
    found = answer_of(data)
    assert (found["verdict"], found["effects"]) == ("unexplained", [])
    assert [one["covariate"] for one in found["unexplained"]["depends_on"]] == ["time"]
    (event,) = found["events"]
    assert (event["run"], event["time_s"]) == (7, pytest.approx(23.0))
    assert event["size_arcsec"] == pytest.approx(lost_arcsec, rel=0.1)


def test_few_runs_give_no_names():
    found = answer_of(campaign(runs=5, add=gap))
    assert found["effects"] == []
    assert "runs" in found["next_experiment"]


def test_runs_of_a_few_samples_get_an_answer():
    found = answer_of(campaign(seed=3, runs=8, rows=20))
    assert (found["verdict"], found["effects"]) == ("complete", [])
    assert found["samples"] == 160


def test_a_lost_motion_that_stands_still_is_refused():
    still = campaign(runs=6, rows=200)
    for run in still.runs:
        run.columns["lost_motion"][:] = 1e-4
    with pytest.raises(InputError, match=r"lost_motion_rad: found a constant 0\.0001 rad"):
        answer_of(still)


def test_missing_columns_close_their_effects():
    data = campaign(seed=2)
    for run in data.runs:
        del run.columns["temperature"]
    found = answer_of(data)
    assert "no temperature_C" in found["not_testable"]["thermal_gap"]
    assert "no cycles" in found["not_testable"]["wear"]


def test_a_constant_column_is_not_visible():
    data = campaign(seed=2, warm=False)
    for run in data.runs:
        run.columns["temperature"][:] = 20.0
    assert "not visible" in answer_of(data)["not_testable"]["thermal_gap"]


def test_wild_samples_are_counted_and_do_not_name_anything():
    data = campaign(seed=5)
    rng = np.random.default_rng(0)
    for run in data.runs:
        run.columns["lost_motion"][rng.choice(np.arange(5, 495), 5, replace=False)] += 60 * ARCSEC
    base = Base(Conditions(data), RATED_NM)
    base.fit()
    assert clean_outliers(base) > 50
    assert answer_of(data)["verdict"] == "complete"


def test_what_is_measured_at_a_jump_of_the_load_is_no_outlier():
    data = campaign(seed=3)
    swing = data.runs[4]
    at = np.arange(60, 440, 40)
    swing.columns["torque"][at[0] :] += 8.0
    swing.columns["lost_motion"][at[0]] += 40.0 * ARCSEC
    swing.columns["lost_motion"][at[5]] += 40.0 * ARCSEC
    base = Base(Conditions(data), RATED_NM)
    base.fit()
    clean_outliers(base)
    first = int(base.conditions.starts[4])
    assert not base.outlier[first + at[0]]
    assert base.outlier[first + at[5]]


def test_wild_samples_that_crowd_in_one_run_are_left_as_they_are():
    data = campaign(seed=3)
    data.runs[4].columns["lost_motion"][20:480:20] += 40.0 * ARCSEC
    base = Base(Conditions(data), RATED_NM)
    base.fit()
    clean_outliers(base)
    assert not base.outlier[base.conditions.slices()[4]].any()


def test_independent_pieces_of_work_keep_their_order():
    assert in_parallel(lambda x: x * x, range(20)) == [x * x for x in range(20)]
    assert in_parallel(str, [1]) == ["1"]


def test_an_added_effect_never_makes_the_error_of_the_ladder_rise(warm_gap):
    """A fit that starts too far off, as deviations of single runs lead it, starts anew."""
    before = without_deviations(warm_gap.selection.settled[0].base)
    friction = library()["stribeck_friction"]
    grown = before.copy()
    grown.slopes *= 3.0
    grown.terms.append(Term(friction, np.array([-900.0, 800.0, 0.01, 0.1]), friction.free()))
    alone, led_back = without_deviations(grown), without_deviations(grown, before)
    assert [term.effect.name for term in led_back.terms] == ["stribeck_friction"]
    assert plain_rms(alone) > 1.001 * plain_rms(before)
    assert plain_rms(led_back) <= 1.0001 * plain_rms(before)


def test_a_lead_that_does_not_stand_hides_no_weaker_one(warm_gap, monkeypatch):
    """What a blurred tangent promises is refitted first; where it fails the next has its turn."""
    first = warm_gap.selection.steps[0]
    found = {result.name: result for result in first.results}
    blurred = dataclasses.replace(found["kinematic_error"], gain=1e4)
    leads = [
        selection.Lead(first.field, one, size_of(first.field, one))
        for one in (blurred, found["thermal_gap"])
    ]
    assert [lead.result.name for lead in selection.strongest(leads)] == ["kinematic_error"]
    monkeypatch.setattr(selection, "find_leads", lambda *_: leads)
    refit = selection.refit

    def flattering(stage, result, reference):
        """Give the gain that the tangent promised; the gates are those of the true refit."""
        contender = refit(stage, result, reference)
        if result.name == "kinematic_error":
            contender.gain = 1e4
        return contender

    monkeypatch.setattr(selection, "refit", flattering)
    least = 0.5 * size_of(first.field, blurred)
    step = selection.choose(first.field, [blurred, found["thermal_gap"]], least)
    tried = {c.result.name: c.passes for c in step.contenders}
    assert not tried["kinematic_error"]
    assert step.chosen.result.name == "thermal_gap"
    assert step.rivals == []


def test_what_unseen_runs_do_not_confirm_is_of_no_use_beside_an_effect(warm_gap):
    """A gain within the runs of a fit is not enough: their form may be spelled out by anything."""
    stage = warm_gap.selection.steps[0].field
    found = {result.name: result for result in warm_gap.selection.steps[0].results}
    opened, spelled = (
        selection.refit(stage, found[name]) for name in ("thermal_gap", "kinematic_error")
    )
    spelled.gain = 2.0 * opened.gain
    assert selection.simplest([opened, spelled]) is spelled
    fit, idle = selection.of_use(stage, [opened, spelled])
    assert (fit, idle) == ([opened], [spelled])
    fit, idle = selection.of_use(stage, [spelled])
    assert (fit, idle) == ([], [spelled])
    # A shape may be the same remainder without its name.
    nameless = [r for r in found.values() if not stage.candidates[r.name].named]
    shape = selection.refit(stage, nameless[-1])
    assert selection.held_out_fall(stage, shape) < 0.01
    assert selection.of_use(stage, [shape]) == ([shape], [])
    assert selection.of_use(stage, [spelled, shape]) == ([], [spelled, shape])
    # What an effect of the least size, a tenth of the noise, takes of the error (arcsec^2).
    assert selection.held_out_fall(stage, spelled) < 0.01 < selection.held_out_fall(stage, opened)


def test_an_effect_that_explains_nothing_more_is_dropped(warm_gap):
    """Beside the gap that is there an effect without a part in it does not stand."""
    settled = warm_gap.selection.settled[-1]
    base = settled.base.copy()
    offset = library()["torque_offset"]
    base.terms.insert(0, Term(offset, offset.typical * 0.0, [0]))
    both = refitted(base, settled.noise)
    kept = without_idle(both, 0, 100)
    assert [term.effect.name for term in kept.base.terms] == ["thermal_gap"]
    given = without_idle(both, 1, 100)
    assert [term.effect.name for term in given.base.terms] == ["torque_offset", "thermal_gap"]


@pytest.mark.parametrize(
    ("function", "found"),
    [(lambda p, at: 1 / 0, "ZeroDivisionError"), (lambda p, at: "x", "ValueError: could not")],
)
def test_an_effect_of_ones_own_that_fails_is_bad_input(function, found):
    own = effect(values=[], needs=["torque_Nm"], name="cable_pull")(function)
    with pytest.raises(InputError, match=f"effect cable_pull: found {found}"):
        own.function(np.zeros(0), {"torque_Nm": np.zeros(3)}, np.zeros(1))


@pytest.mark.parametrize(
    ("low", "high", "found"),
    [(1.0, 1.0, "1 to 1"), (2.0, -2.0, "2 to -2"), (np.nan, 1.0, "nan to 1")],
)
def test_an_effect_that_no_fit_can_move_is_refused(low, high, found):
    size = Value("size_rad", role="linear", typical=1.0, low=low, high=high)
    with pytest.raises(InputError, match=f"pull: size_rad: found {found}, expected low below high"):
        effect(values=[size], needs=["torque_Nm"], name="pull")(lambda p, at: at.torque_Nm)


def test_an_effect_in_python_is_found_like_one_of_the_library():
    @effect(
        values=[Value("pull_rad", "linear", 1e-5, -1e-2, 1e-2)],
        needs=["torque_Nm"],
    )
    def cable_pull(p, at):
        return p.pull_rad * np.cos(2 * np.pi * at.wound_Nm / 5.0)

    data = campaign(seed=3, add=lambda columns, wound: 3.0 * np.cos(2 * np.pi * wound / 5.0))
    found = answer_of(data, effects={**library(), "cable_pull": cable_pull})
    assert found["effects"] == ["cable_pull"]
    assert found["candidates"][0]["parameters"]["pull_rad"] == pytest.approx(3 * ARCSEC, rel=0.1)


def write_template(folder, *, in_c):
    for name, text in template("cable_pull", in_c=in_c).items():
        (folder / name).write_text(text)


def run_its_test(folder):
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "test_cable_pull.py",
    ]
    subprocess.run(command, cwd=folder, check=True)


def test_the_python_template_runs_and_passes_its_own_test(tmp_path, monkeypatch):
    write_template(tmp_path, in_c=False)
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    before = set(tmp_path.iterdir())
    assert set(load_python(tmp_path / "cable_pull.py")) == {"cable_pull"}
    assert set(tmp_path.iterdir()) == before
    assert not sys.dont_write_bytecode
    run_its_test(tmp_path)


@needs_compiler
def test_the_c_template_passes_its_own_test_and_is_made_as_its_head_says(tmp_path):
    write_template(tmp_path, in_c=True)
    run_its_test(tmp_path)
    head = (tmp_path / "cable_pull.c").read_text().partition("*/")[0]
    said = [line.removeprefix(" *").strip() for line in head.splitlines()]
    made = [line for line in said if line.startswith(("headers=", "flags=", "cc "))]
    assert len(made) == 3
    made[0] = made[0].replace("python", sys.executable, 1)
    subprocess.run("\n".join(made), cwd=tmp_path, check=True, shell=True)
    assert set(load_shared_object(tmp_path / "cable_pull.so")) == {"cable_pull"}


@needs_compiler
def test_the_c_template_compiles_and_is_loaded_without_rebuilding(tmp_path):
    source = tmp_path / "cable_pull.c"
    source.write_text(template("cable_pull", in_c=True)["cable_pull.c"])
    made = tmp_path / "cable_pull.so"
    command = ["cc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC"]
    command += [
        "-DLM_REAL_BITS=64",
        f"-I{ROOT / 'lib/include'}",
        str(source),
        "-o",
        str(made),
    ]
    subprocess.run(command, check=True)
    # A firmware in C++ may compile it as such, and finds it by its name in C.
    subprocess.run([*command[:1], "-x", "c++", *command[2:]], check=True)
    own = load_shared_object(made)["cable_pull"]
    conditions = Conditions(campaign(runs=2, rows=20))
    out = own.run(np.array([1e-6, 1.0]), conditions, conditions.torque, conditions.torque * 0)
    wanted = 1e-6 * (conditions.columns["temperature_C"] - 20) * np.clip(conditions.torque, -1, 1)
    np.testing.assert_allclose(out, wanted, atol=1e-18)


@pytest.mark.parametrize("name", ["Bad", "1st", "class", "a-b"])
def test_templates_refuse_names_that_are_no_identifiers(name):
    with pytest.raises(InputError, match="lower case"):
        template(name, in_c=False)


def test_templates_refuse_the_names_of_the_library():
    with pytest.raises(InputError, match="an effect of the library"):
        template("thermal_gap", in_c=False)


def test_a_fitted_file_reads_back_as_the_same_model():
    drive = parse_drive(tomllib.loads(DRIVE))
    data = campaign(add=gap)
    model = fit_model(drive, data, None, ["thermal_gap"], library())
    again = parse_drive(tomllib.loads(format_toml(model.document(drive))))
    base = make_base(again, data, None, library())
    base.start = model.base.start
    np.testing.assert_allclose(base.at().angle, model.base.at().angle, atol=1e-9)
    falls = [rung["rms_heldout_arcsec"] for rung in model.ladder]
    assert falls[1] < falls[0]
    place = model.names.index("thermal_gap.gap_rad_per_K")
    error = model.standard_errors[place]
    assert abs(model.values[place] - 0.3 * ARCSEC) < 5 * error + 0.03 * ARCSEC


def test_beside_an_effect_of_the_file_the_same_counts_as_beside_one_that_was_found():
    def uneven_gap(columns, wound):
        tenth = columns["input_angle"][0] == 0.7 * 9
        return gap(columns, wound) + 2.0 * tenth * np.tanh(wound / 0.2)

    data = campaign(runs=16, rows=400, add=uneven_gap)
    drive = parse_drive(tomllib.loads(DRIVE))
    plain = diagnose(data, drive)
    assert (plain.verdict, plain.effects) == ("missing-effect", ["thermal_gap"])
    model = fit_model(drive, data, None, ["thermal_gap"], library())
    fitted = diagnose(data, parse_drive(tomllib.loads(format_toml(model.document(drive)))))
    assert (fitted.verdict, fitted.effects) == ("complete", [])
    assert fitted.selection.given_arcsec == pytest.approx(
        plain.selection.steps[0].chosen.size, rel=0.1
    )
    assert plain.selection.given_arcsec == 0.0


def test_an_effect_without_its_column_cannot_be_added():
    drive = parse_drive(tomllib.loads(DRIVE))
    with pytest.raises(InputError, match="cycles"):
        fit_model(drive, campaign(), None, ["wear"], library())


def test_columns_that_change_together_are_told():
    data = campaign(seed=1)
    for r, run in enumerate(data.runs):
        run.columns["temperature"][:] = 20.0 + r
        run.columns["cycles"] = np.full(len(run), 1000.0 * r)
    pairs = [set(pair["columns"]) for pair in check(data, library())["aliased"]]
    assert {"temperature_C", "cycles"} in pairs


def test_angles_that_the_gear_binds_are_not_told_to_be_varied_alone():
    data = campaign(seed=1)
    for r, run in enumerate(data.runs):
        run.columns["input_angle"] = np.full(len(run), 0.3 * ((7 * r) % len(data.runs)))
        run.columns["output_angle"] = run.columns["input_angle"] / 100 + run.lost_motion_rad
    pairs = [set(pair["columns"]) for pair in check(data, library())["aliased"]]
    assert {"input_angle_rad", "output_angle_rad"} not in pairs
    # Against what can be chosen freely the angle is still looked at.
    for r, run in enumerate(data.runs):
        run.columns["temperature"][:] = 20.0 + (7 * r) % len(data.runs)
    pairs = [set(pair["columns"]) for pair in check(data, library())["aliased"]]
    assert {"input_angle_rad", "temperature_C"} in pairs


def test_effects_ask_for_columns_that_somebody_records():
    data = campaign()
    for run in data.runs:
        del run.columns["input_angle"], run.columns["output_angle"]
    blind = check(data, library())["not_testable"]
    assert blind["inertia"] == "not testable with these columns: no output_angle_rad"
    assert blind["viscous_friction"] == "not testable with these columns: no input_angle_rad"
    drive = parse_drive(tomllib.loads(DRIVE))
    with pytest.raises(InputError, match="output_angle_rad: found no such column"):
        fit_model(drive, data, None, ["inertia"], library())


def test_what_never_changes_is_called_what_it_is():
    data = campaign()
    for run in data.runs:
        run.columns["input_angle"][:] = run.columns["input_angle"][0]
    drive = parse_drive(tomllib.loads(DRIVE))
    with pytest.raises(InputError, match="speed of the input: found a constant"):
        fit_model(drive, data, None, ["viscous_friction"], library())


@pytest.mark.parametrize(("runs", "says"), [(1, "1 run can show"), (5, "5 runs can show")])
def test_few_runs_are_not_called_complete_without_saying_so(runs, says):
    answer = {"verdict": "complete", "effects": [], "runs": runs}
    assert says in verdict_sentence(answer)
    assert verdict_sentence({**answer, "runs": 6}) == "Nothing is missing beyond the noise."


@pytest.mark.parametrize("seed", [2, 8, 9])
def test_a_law_of_wear_through_two_runs_is_held_to_what_is_usual(seed):
    """Two runs with a scatter of half a noise put an exponent of 0.5 at 0.2 or 1, their bounds."""
    rng = np.random.default_rng(seed)
    data = campaign(seed=seed, warm=False, runs=15)
    for r, run in enumerate(data.runs):
        cycles = {12: 2e4, 13: 1e5, 14: 3e5}.get(r, 0.0)
        worn = 4 * (cycles / 3e5) ** 0.5 + (0.6 * rng.normal() if cycles else 0)
        run.columns["cycles"] = np.full(500, cycles)
        wear = worn * np.tanh(run.columns["torque"] / 0.2)
        run.columns["lost_motion"] = run.columns["lost_motion"] + wear * ARCSEC
    base = Base(Conditions(data), RATED_NM)
    base.first_fit()
    effect = library()["wear"]
    base.terms.append(Term(effect, effect.typical.copy(), effect.free()))
    fewer = np.ones(base.conditions.rows, dtype=bool)
    fewer[base.conditions.slices()[14]] = False
    base.fit(steps=30, rows=fewer)
    exponent = base.terms[0].values[1]
    assert 0.3 < exponent < 0.7
    # By one observation a run, whatever the number of its samples.
    block = next(block for block in base.blocks() if "wear.exponent" in block.names)
    assert block.prior is not None
    assert block.value[block.prior.places] == [exponent]
    assert block.prior.mean == [0.5]
    sd = block.prior.sd
    assert sd == pytest.approx([0.8 / (RUN_SCATTER * np.sqrt(500 * 12))])
    # Weighed against the noise: the same law in noise of half the size is held half as tightly.
    base.noise_arcsec = 0.5
    again = next(block for block in base.blocks() if "wear.exponent" in block.names)
    assert again.prior is not None
    assert again.prior.sd == pytest.approx(2 * sd)


def test_what_the_runs_took_up_of_an_effect_counts_as_its_size():
    """An effect that stands still in every run may hide in the stiffness that each run has."""

    def uneven(columns, wound):
        elastic = wound * 7.0 + 25.0 * np.tanh(wound / 8.0)
        return 0.02 * np.cos(2 * columns["input_angle"]) * elastic

    base = Base(Conditions(campaign(seed=6, warm=False, add=uneven)), RATED_NM)
    base.first_fit()
    modulation = library()["stiffness_modulation"]
    wanted = base.copy()
    wanted.terms.append(Term(modulation, modulation.typical.copy(), modulation.free()))
    wanted.fit()
    size = term_size(wanted, 0)
    assert size > 1.0
    noise = estimate_noise(base, [])
    settled = settle(base, noise)
    hidden = settled.base.copy()
    hidden.terms.append(Term(modulation, 0.2 * wanted.terms[0].values, modulation.free()))
    assert term_size(hidden, 0) < 0.3 * size
    assert taken_from_all(settled.base, hidden) == pytest.approx(size, rel=0.1)


def test_the_next_run_is_the_one_that_differs_most():
    def both(columns, wound):
        return gap(columns, wound)

    data = campaign(seed=6, add=both)
    order = np.argsort([run.columns["temperature"][0] for run in data.runs])
    data.runs = [data.runs[i] for i in order]
    for r, run in enumerate(data.runs):
        run.columns["cycles"] = np.full(len(run), 1e5 * r)
    found = diagnose(data, ratio=RATIO, rated_torque_Nm=RATED_NM)
    options = []
    for label, temperature in (("again", 44.0), ("cold", 10.0)):
        columns = {k: v.copy() for k, v in data.runs[-1].columns.items()}
        columns["temperature"][:] = temperature
        options.append(Run(label, "plan.csv", columns))
    found.effects = ["thermal_gap", "wear"]
    answer = next_runs(found, Campaign(options), library(), RATIO)
    assert answer["suggested"] == "cold"
    # An effect that was found beside them and that nothing is confused with has no say in it.
    alone = {run["run"]: run["separation_nats"] for run in answer["runs"]}
    found.selection.steps[0].rivals = ["wear"]
    found.effects.append("load_dependent_friction")
    beside = next_runs(found, Campaign(options), library(), RATIO)
    assert beside["suggested"] == "cold"
    assert {r["run"]: r["separation_nats"] for r in beside["runs"]} == pytest.approx(alone)


def write(data, file):
    """Write a campaign as CSV."""
    names = [
        "time",
        "torque",
        "lost_motion",
        "temperature",
        "input_angle",
        "output_angle",
    ]
    heads = ["time_s", "torque_Nm", "lost_motion_rad", "temperature_C"]
    heads += ["input_angle_rad", "output_angle_rad"]
    lines = [",".join(["run", *heads])]
    for run in data.runs:
        table = np.column_stack([run.columns[n] for n in names])
        lines += [f"{run.label}," + ",".join(f"{x:.9g}" for x in row) for row in table]
    file.write_text("\n".join(lines) + "\n")


def test_commands_from_diagnosis_to_fitted_file(tmp_path, capsys):
    drive, data = tmp_path / "drive.toml", tmp_path / "data.csv"
    drive.write_text(DRIVE)
    write(campaign(add=gap), data)
    assert main(["diagnose", str(drive), str(data), "--json", "-"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["effects"] == ["thermal_gap"]
    fitted = tmp_path / "fitted.toml"
    words = ["fit", str(drive), str(data), "--add", "thermal_gap", "-o", str(fitted)]
    assert main(words) == 0
    assert "thermal_gap" in capsys.readouterr().out
    assert read_drive(fitted).effects[0]["name"] == "thermal_gap"
    assert main(["diagnose", str(fitted), str(data), "--json", "-"]) == 0
    again = json.loads(capsys.readouterr().out)
    assert again["ladder"][0]["effects"] == ["thermal_gap"]
    assert (again["verdict"], again["effects"]) == ("complete", [])


def test_commands_about_effects_recordings_and_plans(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    drive, data = tmp_path / "drive.toml", tmp_path / "data.csv"
    drive.write_text(DRIVE)
    write(campaign(), data)
    assert main(["effects"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == 27
    assert main(["effects", "wear"]) == 0
    assert "cycles" in capsys.readouterr().out
    assert main(["effects", "wera"]) == 2
    assert "wear" in capsys.readouterr().err
    assert main(["effects", "new", "cable_pull"]) == 0
    assert (tmp_path / "cable_pull.py").exists()
    assert main(["effects", "new", "cable_pull"]) == 2
    assert main(["check", str(data)]) == 0
    capsys.readouterr()
    assert main(["forecast", str(drive), str(data), "--json", "-"]) == 0
    forecast = json.loads(capsys.readouterr().out)
    assert forecast["schema"] == "lostmotion.forecast/1"
    rows = {row["name"]: row for row in forecast["effects"]}
    assert rows["thermal_gap"]["testable"]
    assert rows["ratcheting"]["testable"]
    assert not rows["wear"]["testable"]


def turning_joint(file, *, dead=False, locked=False):
    """A joint that swings under gravity: torque rises with the angle, the lost motion with both."""
    output = np.zeros(1000) if locked else np.sin(0.01 * np.arange(1000))
    torque = 30 * np.sin(0.01 * np.arange(1000))
    turned = 100 * (output - torque / 3e4) * (10 if locked else 1)
    output[500:] = output[500] if dead else output[500:]
    rows = np.column_stack((0.01 * np.arange(1000), torque, turned, output))
    head = "time_s,torque_Nm,input_angle_rad,output_angle_rad"
    np.savetxt(file, rows, delimiter=",", header=head, comments="")
    return str(file)


def test_check_needs_no_ratio_to_be_right_about_a_turning_joint(tmp_path, capsys):
    def findings(file, *more):
        assert main(["check", file, "--json", "-", *more]) == 0
        found = json.loads(capsys.readouterr().out)
        return found["ratio_known"], found["findings"]

    sound = turning_joint(tmp_path / "a.csv")
    assert findings(sound) == (False, [])
    assert findings(sound, "--ratio", "100") == (True, [])
    assert findings(sound, "--ratio", "1e2") == (True, [])
    assert findings(turning_joint(tmp_path / "b.csv", locked=True)) == (False, [])
    for more in ([], ["--ratio", "100"]):
        (text,) = findings(turning_joint(tmp_path / "c.csv", dead=True), *more)[1]
        assert "output_angle_rad (run c): stuck x 500" in text
    for ratio, expected in (("0", "1 to 10000, or"), ("-2e4", "1 to 10000, or"), ("x", "a number")):
        assert main(["check", sound, "--ratio", ratio]) == 2
        assert f"--ratio: found '{ratio}', expected {expected}" in capsys.readouterr().err


def test_effects_of_c_and_their_cards():
    for name, one in library().items():
        assert one.name == name
        assert one.mechanism
        assert one.equation
        assert all(v.low <= v.typical <= v.high for v in one.values)
        assert dataclasses.is_dataclass(one)
