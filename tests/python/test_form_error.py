"""Form error of the baseline model: its columns, its variance, its effect."""

from __future__ import annotations

import numpy as np
import pytest
from small_campaigns import RATED_NM, RATIO, answer_of, campaign, gap

from lostmotion.candidates.candidate import LOAD_NEEDS
from lostmotion.candidates.named import tangent
from lostmotion.discover import diagnose
from lostmotion.discover.conclusion import HYSTERESIS_FORM
from lostmotion.discover.form_variance import confounded_effects, largest_model
from lostmotion.discover.linearise import columns_of
from lostmotion.effects.conditions import Conditions
from lostmotion.effects.library import library
from lostmotion.evidence.gram import gather
from lostmotion.evidence.noise import Noise
from lostmotion.evidence.scatter import reduce
from lostmotion.evidence.shared_error import without_shared
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.hysteresis import operator_columns
from lostmotion.fit.terms import Term
from lostmotion.recordings import Campaign, Run


def basis(data):
    return BaselineModel(Conditions(data), RATED_NM).form_basis


def other_loop(columns, wound):
    """A loop of another shape: odd under a change of sign, and no function of the torque."""
    return 2.0 * np.cos(3.0 * 2.0 * np.pi * columns["time"] / 25.0)


def opening_gap(columns, wound):
    return gap(columns, wound) + other_loop(columns, wound)


def test_columns_of_the_torques_history_are_odd_and_independent_of_rate():
    data = campaign(1, runs=6, rows=300)
    turned, slow = (
        Campaign([Run(run.label, "made.csv", dict(run.columns)) for run in data.runs])
        for _ in range(2)
    )
    for run in turned.runs:
        run.columns["torque"] = -run.columns["torque"]
    for run in slow.runs:
        run.columns["time"] = 7.0 * run.columns["time"]
    columns = basis(data).preisach()
    assert basis(turned).preisach() == pytest.approx(-columns, abs=1e-12)
    assert np.array_equal(basis(slow).preisach(), columns)
    assert np.sqrt(np.mean(columns**2, axis=0)) == pytest.approx(1.0)


def test_dahls_friction_is_that_of_small_steps():
    one = BaselineModel(Conditions(campaign(1, runs=2, rows=60)), RATED_NM)
    torque = one.conditions.torque
    found, radius = one.form_basis.dahl(torque), one.form_basis.radius_Nm
    steps, force = np.diff(torque, prepend=torque[0]), np.zeros(found.shape[1])
    for step, row in zip(steps, found, strict=True):
        for _ in range(500):
            force += (np.sign(step) - force) * abs(step) / 500 / radius
        assert row == pytest.approx(force, abs=0.02)


def test_only_what_shakes_the_contacts_changes_dahls_friction():
    """Small cycles about a torque bring it to zero, and leave operators where they are."""
    base = BaselineModel(Conditions(campaign(1, runs=2, rows=300)), RATED_NM)
    assert base.form_basis.shaken().shape == (600, 0)
    assert base.with_present_form().form_basis is base.form_basis
    half = base.form_basis.radius_Nm
    rise, shake = np.linspace(0.0, RATED_NM, 100), 0.2 * half[3] * np.sin(np.arange(500))
    moving = np.concatenate((rise, RATED_NM + shake))
    force = base.form_basis.dahl(moving)[:, 3]
    assert force[99] > 0.9
    assert abs(force[-1]) < 0.1
    steady, one = np.zeros(half.size), np.ones(moving.size)
    plays = operator_columns(half, steady, moving, one, [slice(0, 600)])[:, 3]
    assert plays[-1] + shake[-1] == pytest.approx(plays[99], abs=0.2 * half[3])


def test_a_stiffness_that_varies_with_the_input_angle_shakes_the_contacts():
    data = campaign(1, runs=2, rows=300)
    for run in data.runs:
        run.columns["input_angle"] = 2.0 * np.arange(300)
    modulation = library()["stiffness_modulation"]
    values = np.array([value.typical for value in modulation.values])
    base = BaselineModel(
        Conditions(data), RATED_NM, terms=[Term(modulation, values, modulation.free())]
    )
    shaken = base.with_present_form().form_basis.shaken()
    assert np.sqrt(np.mean(shaken**2, axis=0)).max() > 0.05
    for run in data.runs:
        run.columns["torque"] = -run.columns["torque"]
    other = BaselineModel(Conditions(data), RATED_NM, terms=base.terms)
    assert other.with_present_form().form_basis.shaken() == pytest.approx(-shaken, abs=1e-12)


def test_runs_that_repeat_a_torque_path_share_what_is_along_it():
    data = campaign(2, runs=7, rows=300)  # three amplitudes, one after the other
    assert basis(data).repeats() == [[0, 3, 6], [1, 4], [2, 5]]
    data.runs[6].columns["torque"] = 0.8 * data.runs[6].columns["torque"]
    assert basis(data).repeats() == [[0, 3], [1, 4], [2, 5]]


@pytest.mark.parametrize(("slower", "confounded"), [(1.0, {"creep"}), (30.0, set())])
def test_creep_is_a_form_of_hysteresis_where_all_runs_have_one_rate(slower, confounded):
    data = campaign(5, runs=6, rows=250)
    for run in data.runs[3:]:
        run.columns["time"] = slower * run.columns["time"]
    base = BaselineModel(Conditions(data), RATED_NM)
    base.fit()
    effects = [library()[name] for name in ("creep", "thermal_gap")]
    candidates = [tangent(effect, base, base.at(), RATIO) for effect in effects]
    assert confounded_effects(largest_model(base, candidates), candidates) == confounded


def test_no_form_of_hysteresis_is_even_in_the_torque():
    c = Conditions(campaign(5, runs=6, rows=250))
    even = {name for name, effect in library().items() if not effect.turns_with_torque(c)}
    alone = {name for name, effect in library().items() if effect.needs <= LOAD_NEEDS}
    assert even & alone == {"asymmetric_stiffness", "torque_offset"}
    # As many runs of each path as two: along it the form error follows any function.
    base = BaselineModel(c, RATED_NM)
    base.fit()
    one = tangent(library()["asymmetric_stiffness"], base, base.at(), RATIO)
    largest = largest_model(base, [one])
    assert largest.beyond_last(0, np.ones(1)) < 0.03
    assert confounded_effects(largest, [one]) == set()
    one.odd = True
    assert confounded_effects(largest, [one]) == {"asymmetric_stiffness"}


def test_what_only_the_form_error_follows_is_what_least_squares_say():
    base = BaselineModel(Conditions(campaign(4, runs=9, rows=250, add=opening_gap)), RATED_NM)
    base.fit()
    names = ("thermal_gap", "creep", "wear")
    effects = [tangent(library()[name], base, base.at(), RATIO) for name in names]
    largest = largest_model(base, effects)
    fixed, _, scatter, _ = columns_of(base, base.at(), form=False)
    known = [fixed, scatter[:, :3], effects[0].columns, effects[2].columns]
    left = []
    for columns in (known, [*known, base.form_basis.columns]):
        within = np.column_stack(columns)
        base.conditions.centre(within)
        within /= np.maximum(np.linalg.norm(within, axis=0), 1e-9)
        residual = base.residual()
        step = np.linalg.lstsq(within, residual, rcond=1e-7)[0]
        left.append(np.mean((residual - within @ step) ** 2))
    assert left[0] - left[1] > 0.1
    assert largest.followed_by_last([0, 2]) == pytest.approx(left[0] - left[1], rel=0.02)


def test_what_runs_of_one_load_share_is_no_effect_and_no_scatter():
    data = campaign(4, runs=9, rows=250, add=opening_gap)
    answer = answer_of(data, friction="inside")
    assert answer["effects"] == ["thermal_gap"]
    said = [what["shape"] for what in answer["unexplained"]["depends_on"]]
    assert said == [HYSTERESIS_FORM]
    # Noise of 1 arcsec; with the scatter of the campaign it is 1.06.
    assert answer["noise"]["within_runs_arcsec"] == pytest.approx(1.0, rel=0.15)
    assert answer["noise_floor_arcsec"] == pytest.approx(1.06, rel=0.15)


def test_a_drive_of_the_baselines_form_has_no_such_error():
    diagnosis = diagnose(None, campaign(5, runs=8, rows=250), ratio=RATIO, rated_torque_Nm=RATED_NM)
    assert diagnosis.verdict == "complete"
    assert diagnosis.selection is not None
    assert diagnosis.selection.settled[0].base.form_error is None


def test_evidence_without_the_forms_error_has_the_same_content():
    rng = np.random.default_rng(3)
    starts = np.arange(0, 250, 40)
    rows, runs = int(starts[-1]), starts.size - 1
    fixed, scatter, block = (rng.normal(size=(rows, n)) for n in (7, 2, 3))
    precision = np.array([0.0, 0.1, 0.0, 0.2, 30.0, 20.0, 10.0])
    noise = Noise([np.array([0.3])] * runs, np.linspace(0.8, 1.2, runs))
    whole = gather(
        fixed, precision, scatter, [("effect", block)], rng.normal(size=rows), noise, starts
    )
    omega = np.array([0.3, 0.05])
    left = without_shared(whole, whole.fixed[-3:], omega)
    index = whole.index("effect")
    beside = reduce(whole, index, omega).matrix.sum(axis=0)
    shared, others = index[4:7], np.delete(np.arange(index.size), (4, 5, 6))
    inner = beside[np.ix_(shared, shared)] + np.diag(whole.precision[4:7])
    taken = np.linalg.solve(inner, beside[np.ix_(shared, others)])
    expected = beside[np.ix_(others, others)] - beside[np.ix_(others, shared)] @ taken
    found = reduce(left, left.index("effect"), omega).matrix.sum(axis=0)
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-9)
    assert left.precision == pytest.approx(whole.precision[:4])
