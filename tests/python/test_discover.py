"""Discovery from recordings to the result, on small generated campaigns."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import pytest
from small_campaigns import (
    ARCSEC,
    DRIVE,
    RATED_NM,
    RATIO,
    answer_of,
    campaign,
    gap,
    read_by_encoders,
    ripple,
)

from lostmotion.candidates.forms import form_of
from lostmotion.discover import diagnose, library
from lostmotion.discover.advice import advise
from lostmotion.discover.answer import plausible
from lostmotion.discover.conclusion import Conclusion, decide
from lostmotion.discover.diagnosis import estimated_at_bound
from lostmotion.discover.fitted_model import fit_model
from lostmotion.discover.outliers import clean_outliers, crossing, spiking
from lostmotion.drives import format_toml, parse_drive, tomllib
from lostmotion.effects.conditions import Conditions
from lostmotion.errors import InputError
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.terms import RUN_SCATTER, Term
from lostmotion.recordings import Campaign, Run
from lostmotion.report.discovery import verdict_sentence
from lostmotion.units import parse_unit


@pytest.fixture(scope="module")
def warm_gap():
    return diagnose(None, campaign(add=gap), ratio=RATIO, rated_torque_Nm=RATED_NM)


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


def test_a_complete_model_is_reported_complete():
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
    assert first["at_bound"] == ["gap_rad"]  # the gap never closes: every large value fits


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
    """Runs in which the input turns back and forth, at three speeds, against friction."""
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


def test_values_that_turn_an_effect_into_another_are_reported():
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

    No torsion curve of straight pieces with operators on the torque has exactly this form.
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


def test_friction_of_another_form_than_the_base_is_no_missing_effect():
    """At one loading rate sliders resemble friction that falls with the speed: too small to
    count."""
    small = []
    for seed in range(1, 6):
        found = diagnose(
            None, sliders_beside_a_spring(seed), ratio=100.0, rated_torque_Nm=40.0
        ).answer()
        assert (found["verdict"], found["effects"], found["events"]) == ("complete", [], [])
        small += [c["name"] for c in found["candidates"] if c.get("too_small")]
    assert small in ([], ["rate_dependent_friction"])


@pytest.mark.parametrize("name", ["load_dependent_friction", "creep"])
def test_what_takes_work_never_gives_it(name):
    takes = library()[name]
    (linear,) = takes.indices("linear")
    assert takes.values[linear].low == 0
    assert form_of(takes).possible(takes, np.array([0.1]))
    assert not form_of(takes).possible(takes, np.array([-0.1]))


@pytest.mark.parametrize(("off_Nm", "wide_Nm", "gap_arcsec"), [(1.5, 0.3, 9.0), (0.4, 0.1, 4.0)])
def test_a_sensor_off_by_more_than_the_gap_is_wide_is_no_uneven_spring(off_Nm, wide_Nm, gap_arcsec):
    """If the baseline model has absorbed the gap in part, its tangent explains less than that of a
    confounded effect."""
    data = campaign(seed=3, add=lambda columns, wound: gap_arcsec * np.tanh(wound / wide_Nm))
    for run in data.runs:
        run.columns["torque"] = run.columns["torque"] + off_Nm
    found = answer_of(data)
    assert (found["verdict"], found["effects"]) == ("missing-effect", ["torque_offset"])
    (offset,) = (c for c in found["candidates"] if c["name"] == "torque_offset")
    assert offset["parameters"]["offset_Nm"] == pytest.approx(-off_Nm, rel=0.1)


def test_what_no_effect_explains_is_reported_to_depend_on_torque():
    found = answer_of(campaign(seed=3, add=ripple))
    assert found["verdict"] == "unexplained"
    assert found["unexplained"]["depends_on"][0]["covariate"] == "torque"
    period = float(found["unexplained"]["depends_on"][0]["shape"].split()[2])
    assert period == pytest.approx(5.0, rel=0.01)


@pytest.mark.parametrize("zero", [5.0, 0.0], ids=["set to zero again", "stays"])
def test_a_slip_is_placed_in_its_run_and_second(zero):
    """The shift that remains in later runs is not a second cause."""
    diagnosis = diagnose(
        None,
        campaign(seed=4, slip=(6, 23.0, 8.0), zero=zero),
        ratio=RATIO,
        rated_torque_Nm=RATED_NM,
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
    """The angle jumps with the lost motion, and no shape over the angle replaces the events."""
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


def test_a_constant_lost_motion_is_refused():
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
    assert "not identifiable" in answer_of(data)["not_testable"]["thermal_gap"]


def test_wild_samples_are_counted_and_do_not_name_anything():
    data = campaign(seed=5)
    rng = np.random.default_rng(0)
    for run in data.runs:
        run.columns["lost_motion"][rng.choice(np.arange(5, 495), 5, replace=False)] += 60 * ARCSEC
    base = BaselineModel(Conditions(data), RATED_NM)
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
    base = BaselineModel(Conditions(data), RATED_NM)
    base.fit()
    clean_outliers(base)
    first = int(base.conditions.starts[4])
    assert not base.outlier[first + at[0]]
    assert base.outlier[first + at[5]]


def test_a_spike_on_a_steep_ramp_is_an_outlier_and_a_step_or_kink_is_none():
    ramp = 20.0 * np.arange(40.0)
    for size in (34.0, -34.0):
        wild = ramp.copy()
        wild[17] += size
        assert np.flatnonzero(spiking(wild, 10.0)[2:-2]).tolist() == [15]
    step, kink = ramp.copy(), ramp.copy()
    step[17:] += 50.0
    kink[17:] = ramp[17]
    assert not spiking(step, 10.0)[2:-2].any()
    assert not spiking(kink, 10.0)[2:-2].any()


def test_the_crossing_of_a_gap_is_told_from_a_ramp():
    ramp = np.linspace(-3.0, 3.0, 40)
    assert not crossing(5.0 * ramp).any()
    gap = 5.0 * ramp + 30.0 * np.sign(ramp)
    assert np.flatnonzero(crossing(gap)).tolist() == [18, 19, 20, 21, 22]


@pytest.mark.parametrize(("rows", "count"), [(slice(250, None), 0), (slice(250, 251), 1)])
def test_samples_at_a_step_of_the_residual_are_no_outliers(rows, count):
    data = campaign(seed=3)
    data.runs[4].columns["lost_motion"][rows] += 40.0 * ARCSEC
    base = BaselineModel(Conditions(data), RATED_NM)
    base.fit()
    assert clean_outliers(base) == count


def test_wild_samples_that_crowd_in_one_run_are_left_as_they_are():
    data = campaign(seed=3)
    data.runs[4].columns["lost_motion"][20:480:20] += 40.0 * ARCSEC
    base = BaselineModel(Conditions(data), RATED_NM)
    base.fit()
    clean_outliers(base)
    assert not base.outlier[base.conditions.slices()[4]].any()


def test_beside_an_effect_of_the_file_the_same_counts_as_beside_one_that_was_found():
    def uneven_gap(columns, wound):
        tenth = columns["input_angle"][0] == 0.7 * 9
        return gap(columns, wound) + 2.0 * tenth * np.tanh(wound / 0.2)

    data = campaign(runs=16, rows=400, add=uneven_gap)
    drive = parse_drive(tomllib.loads(DRIVE))
    plain = diagnose(drive, data)
    assert (plain.verdict, plain.effects) == ("missing-effect", ["thermal_gap"])
    model = fit_model(drive, data, ["thermal_gap"])
    fitted = diagnose(parse_drive(tomllib.loads(format_toml(model.document(drive)))), data)
    assert (fitted.verdict, fitted.effects) == ("complete", [])
    assert fitted.selection.given_arcsec == pytest.approx(
        plain.selection.steps[0].selected.size, rel=0.1
    )
    assert plain.selection.given_arcsec == 0.0


def test_an_effect_at_a_bound_is_not_recommended():
    found = Conclusion("missing-effect", ["wear", "creep"], ["wear", "creep"], [], [])
    last = SimpleNamespace(closed={})
    says = advise(found, library(), last, 12, {"wear": [], "creep": ["time_s"]}, {})
    assert "fit --add wear." in says
    assert "--add creep" not in says
    assert "creep is not recommended: time_s at its bound" in says
    assert "fit --add wear --add creep." in advise(found, library(), last, 12, {}, {})


def test_values_at_a_bound_are_those_that_are_estimated():
    base = BaselineModel(Conditions(campaign()), RATED_NM)
    effect = library()["creep"]
    values = effect.typical.copy()
    place = effect.free()[-1]
    values[place] = effect.values[place].high
    name = effect.values[place].name
    base.terms = [Term(effect, values, effect.free())]
    assert estimated_at_bound(base) == {"creep": [name]}
    base.terms = [Term(effect, values, [i for i in effect.free() if i != place])]
    assert estimated_at_bound(base) == {"creep": []}


@pytest.mark.parametrize(("runs", "says"), [(1, "1 run."), (5, "5 runs.")])
def test_few_runs_are_inconclusive(runs, says):
    verdict, shown = decide(runs, [], [], False)
    assert (verdict, shown) == ("inconclusive", [])
    sentence = verdict_sentence({"verdict": verdict, "effects": [], "runs": runs})
    assert sentence == f"Inconclusive: {says} At least 6 are needed to identify an effect."
    assert decide(6, [], [], False) == ("complete", [])


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
    base = BaselineModel(Conditions(data), RATED_NM)
    base.first_fit()
    effect = library()["wear"]
    base.terms.append(Term(effect, effect.typical.copy(), effect.free()))
    fewer = np.ones(base.conditions.rows, dtype=bool)
    fewer[base.conditions.slices()[14]] = False
    base.fit(steps=30, rows=fewer)
    exponent = base.terms[0].values[1]
    assert 0.3 < exponent < 0.7
    # The prior counts as one observation per run, for any number of samples.
    block = next(block for block in base.blocks() if "wear.exponent" in block.names)
    assert block.prior is not None
    assert block.value[block.prior.places] == [exponent]
    assert block.prior.mean == [0.5]
    sd = block.prior.sd
    assert sd == pytest.approx([0.8 / (RUN_SCATTER * np.sqrt(500 * 12))])
    # Relative to the noise: with noise of half the size the same law is weighted half as much.
    base.noise_arcsec = 0.5
    again = next(block for block in base.blocks() if "wear.exponent" in block.names)
    assert again.prior is not None
    assert again.prior.sd == pytest.approx(2 * sd)
