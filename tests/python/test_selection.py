"""Candidates that are refitted, confirmed, and useful."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from small_campaigns import RATED_NM, RATIO, answer_of, campaign, gap

from lostmotion import threads
from lostmotion.discover import diagnose, library
from lostmotion.discover.choice import (
    best_of,
    choose,
    explained_by_less,
    of_use,
    replace_form,
    simplest,
)
from lostmotion.discover.gates import accepted
from lostmotion.discover.growing_model import Lead
from lostmotion.discover.linearise import Settled, plain_rms, settle
from lostmotion.discover.measurement_noise import estimate_noise
from lostmotion.discover.recorded_model import RecordedModel, fall_of_error
from lostmotion.discover.refits import refit, refitted, without_deviations
from lostmotion.discover.selection import drop_others
from lostmotion.discover.shortlist import strongest
from lostmotion.discover.terms import term_size
from lostmotion.drives import read_drive
from lostmotion.effects.conditions import Conditions
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.terms import Term
from lostmotion.recordings import read_campaign
from lostmotion.threads import begin, in_parallel

sys.path.insert(0, str(Path(__file__).parents[1]))
from rig.suites import write_suite


@pytest.fixture(scope="module")
def warm_gap():
    return diagnose(None, campaign(add=gap), ratio=RATIO, rated_torque_Nm=RATED_NM)


def test_an_offset_is_no_larger_than_what_it_explains(monkeypatch):
    """It does not hide a weaker effect either: its tangent continues beyond the kink that it
    moves."""
    sizes = {}
    take = RecordedModel.take

    def noted(model, contender, current):
        sizes[contender.name] = contender.size
        take(model, contender, current)

    monkeypatch.setattr(RecordedModel, "take", noted)
    data = campaign(seed=3, add=lambda at, wound: 9.0 * np.tanh(wound / 0.1) + 0.5 * gap(at, wound))
    for run in data.runs:
        run.columns["torque"] = run.columns["torque"] + 1.5
    found = answer_of(data)
    assert found["effects"] == ["torque_offset", "thermal_gap"]
    before, after = (rung["rms_arcsec"] for rung in found["ladder"][:2])
    assert sizes["torque_offset"] == pytest.approx(np.sqrt(before**2 - after**2), rel=0.05)


def test_a_shape_that_beats_an_effect_of_the_form_hides_no_better_effect(warm_gap):
    step = warm_gap.selection.steps[0]
    right = step.selected
    own = replace(right.candidate, name="like a form", of_form=True)
    form = replace(right, candidate=own, result=replace(right.result, name=own.name), gain=5.0)
    plain = replace(own, name="a shape", named=False, of_form=False)
    shape = replace(
        form,
        candidate=plain,
        result=replace(right.result, name=plain.name),
        gain=0.99 * right.gain,
    )
    step.round.candidates[own.name] = own

    def best(effects, shape=None):
        return best_of(step.round, effects, shape, replace_form(step.round, effects))

    try:
        assert best([form, right], shape) is right
        assert best([form], shape) is shape
        assert best([form, right]) is form
        assert best([]) is None
        # One that was found without form error as well is compared with it, and with no other.
        fitted = replace(form, candidate=right.candidate, result=right.result, gain=9.0)
        fitted.formless = fitted.settled
        other = replace(right, result=replace(right.result, name="another"), gain=50.0)
        assert best([form, fitted, other]) is fitted
        assert best([fitted, other]) is other
        # Another law of friction is compared with it.
        law = replace(own, name="a law", of_form=False, effect=library()["creep"])
        step.round.candidates[law.name] = law
        friction = replace(form, result=replace(right.result, name=law.name), gain=9.0)
        assert best([form, friction, right]) is friction
    finally:
        del step.round.candidates[own.name]
        step.round.candidates.pop("a law", None)


def test_a_rival_that_keeps_its_gain_beside_the_selected_effect_is_none():
    def results(**gains):
        return [SimpleNamespace(name=name, gain=gain) for name, gain in gains.items()]

    step = SimpleNamespace(results=results(alias=20.0, other=12.0, gone=8.0))
    step.rivals = ["alias", "other", "gone"]
    drop_others(step, results(alias=1.5, other=9.0))
    assert step.rivals == ["alias", "gone"]


def test_independent_pieces_of_work_keep_their_order():
    assert in_parallel(lambda x: x * x, range(20)) == [x * x for x in range(20)]
    assert in_parallel(str, [1]) == ["1"]
    assert in_parallel(str, []) == []


def test_work_in_parallel_may_have_parts_that_are_done_in_parallel():
    def depth(levels: int) -> int:
        return 1 + sum(in_parallel(depth, [levels - 1] * 3)) if levels else 1

    assert depth(4) == 121


@pytest.mark.parametrize("cores", [1, 2])
def test_work_that_was_begun_is_done_once_and_its_error_is_that_of_the_work(monkeypatch, cores):
    monkeypatch.setattr(threads, "cores", lambda: cores)
    done = []
    results = [begin(lambda number=number: done.append(number) or number) for number in range(6)]
    assert [result() for result in (*results, *results)] == [*range(6), *range(6)]
    assert sorted(done) == list(range(6))
    wrong = begin(lambda: 1 // 0)
    with pytest.raises(ZeroDivisionError):
        wrong()


def test_every_library_of_linear_algebra_is_limited_whenever_it_is_loaded():
    code = (
        "from lostmotion.threads import one_thread; import numpy, threadpoolctl\n"
        "with one_thread():\n"
        "    import scipy.linalg\n"
        "    print(sorted({one['num_threads'] for one in threadpoolctl.threadpool_info()}))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "OPENBLAS_NUM_THREADS": "2"},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == "[1]\n"


def test_an_error_of_work_in_parallel_is_that_of_the_work():
    with pytest.raises(ZeroDivisionError):
        in_parallel(lambda x: 1 // (x - 7), range(9))


def test_an_added_effect_never_makes_the_error_of_the_ladder_rise(warm_gap):
    """A fit converges even if deviations of single runs make it start far from the solution."""
    before = warm_gap.selection.began_with
    friction = library()["stribeck_friction"]
    grown = before.copy()
    grown.curve.slopes *= 3.0
    grown.terms.append(Term(friction, np.array([-900.0, 800.0, 0.01, 0.1]), friction.free()))
    alone, led_back = without_deviations(grown), without_deviations(grown, before)
    assert [term.effect.name for term in led_back.terms] == ["stribeck_friction"]
    for found in (alone, led_back):
        assert plain_rms(found) <= 1.0001 * plain_rms(before)


def model_before(diagnosis) -> RecordedModel:
    """The model of a diagnosis as it was in its first round."""
    model = RecordedModel(diagnosis.selection.began_with, library(), RATIO)
    model.settled = [diagnosis.selection.settled[0]]
    return model


def test_a_shape_of_larger_gain_by_tangents_hides_no_effect(warm_gap):
    """Only refits decide between a shape and an effect of inexact form."""
    first = warm_gap.selection.steps[0]
    one, other = (
        next(r for r in first.results if first.round.candidates[r.name].named is named)
        for named in (False, True)
    )
    leads = [
        Lead(first.round, replace(result, gain=gain), None)
        for result, gain in ((one, 1e4), (other, 10.0))
    ]
    assert [lead.name for lead in strongest(leads)] == [other.name, one.name]


def test_a_lead_that_does_not_pass_hides_no_weaker_one(warm_gap, monkeypatch):
    """The candidate with the largest gain by its tangent is refitted first; if it fails, the next
    one is."""
    first = warm_gap.selection.steps[0]
    found = {result.name: result for result in first.results}
    blurred = replace(found["kinematic_error"], gain=1e4)
    leads = [
        Lead(first.round, one, first.round.size_of(one)) for one in (blurred, found["thermal_gap"])
    ]
    assert [lead.name for lead in strongest(leads)] == ["kinematic_error"]
    monkeypatch.setattr("lostmotion.discover.choice.find_leads", lambda *_: leads)
    with_candidate = RecordedModel.with_candidate

    def flattering(model, lead):
        """Return the gain by the tangent; the gates are those of the true refit."""
        contender = with_candidate(model, lead)
        if lead.name == "kinematic_error":
            contender.gain = 1e4
        return contender

    monkeypatch.setattr(RecordedModel, "with_candidate", flattering)
    monkeypatch.setattr(RecordedModel, "more_starts", lambda _, current, leads: leads)
    least = 0.5 * first.round.size_of(blurred)
    model = model_before(warm_gap)
    results = [blurred, found["thermal_gap"]]
    step = choose(model, first.round, results, least)
    tried = {c.name: c.passes for c in step.contenders}
    assert not tried["kinematic_error"]
    assert step.selected.name == "thermal_gap"
    assert step.rivals == []


def test_what_unseen_runs_do_not_confirm_is_of_no_use_beside_an_effect(warm_gap):
    """A gain within the fitted runs is not enough: any column may reproduce their form."""
    model, current = model_before(warm_gap), warm_gap.selection.steps[0].round
    found = {result.name: result for result in warm_gap.selection.steps[0].results}
    opened, spelled = (refit(current, found[name]) for name in ("thermal_gap", "kinematic_error"))
    spelled.gain = 2.0 * opened.gain
    assert simplest([opened, spelled]) is spelled
    assert of_use(model, current, [opened, spelled]) == ([opened], [spelled])
    assert of_use(model, current, [spelled]) == ([], [spelled])
    # An unnamed shape may be the same residual.
    nameless = [r for r in found.values() if not current.candidates[r.name].named]
    shapes = (refit(current, one) for one in reversed(nameless))
    shape = next(one for one in shapes if model.fall_of_left_out(one) < 0.01)
    assert of_use(model, current, [shape]) == ([shape], [])
    assert of_use(model, current, [spelled, shape]) == ([], [spelled, shape])
    # Beside an effect it could displace that one, and must predict better as well.
    assert of_use(model, current, [opened, shape]) == ([opened], [shape])
    later = warm_gap.selection.steps[1].round
    assert later.has_effects
    assert of_use(model, later, [shape]) == ([], [shape])
    # Reduction of the error by an effect of the least size, a tenth of the noise (arcsec^2).
    assert model.fall_of_left_out(spelled) < 0.01 < model.fall_of_left_out(opened)
    # The models are those of the answer, or the present one after more steps.
    before, after = (rung["rms_heldout_arcsec"] for rung in warm_gap.ladder)
    fall = before**2 - after**2
    assert 0.98 * fall < model.fall_of_left_out(opened) < fall + 1e-9


def test_a_worse_explanation_is_no_larger_than_the_best_one(warm_gap):
    """Nothing is named if the best explanation of what is missing is too small to count."""
    model, current = model_before(warm_gap), warm_gap.selection.steps[0].round
    found = {result.name: result for result in warm_gap.selection.steps[0].results}
    best, worse = (refit(current, found[name]) for name in ("thermal_gap", "thermal_stiffness"))
    assert best.gain > worse.gain
    assert not model.keeps_beside(worse, best)
    assert model.keeps_beside(best, worse)
    assert not explained_by_less(model, worse, [best, worse])
    best.passes = False
    assert explained_by_less(model, worse, [best, worse])
    assert not explained_by_less(model, worse, [replace(best, explains=False), worse])
    # One that explains something else keeps its gain.
    worse.passes, worse.gain = False, 2.0 * best.gain
    assert not explained_by_less(model, best, [best, worse])


def test_left_out_runs_confirm_an_effect_of_the_least_size(warm_gap, monkeypatch):
    model = RecordedModel.__new__(RecordedModel)
    model.settled, model.within = [warm_gap.selection.settled[0]], 1.0
    named = SimpleNamespace(named=True)
    opened = SimpleNamespace(settled=warm_gap.selection.settled[1], candidate=named)
    monkeypatch.setattr(model, "in_answer", lambda settled: settled.base)
    after = np.random.default_rng(0).normal(size=model.now.base.conditions.rows)
    after /= np.sqrt(np.mean(after**2))
    monkeypatch.setattr(model, "left_out_residual", lambda _: after)
    for size, confirmed in ((0.09, False), (0.11, True)):
        model.present = (model.now, np.sqrt(1.0 + size**2) * after)
        assert model.fall_of_left_out(opened) == pytest.approx(size**2)
        assert model.confirms(opened) is confirmed
    # The same fall is no evidence for an effect that the answer does not contain.
    idle = opened.settled.base.copy()
    idle.terms[-1].values[idle.terms[-1].effect.scaling()] = 0.0
    monkeypatch.setattr(model, "in_answer", lambda _: idle)
    assert model.fall_of_left_out(opened) == 0.0


def test_wear_is_named_though_left_out_runs_scatter_by_more_than_it_gains(tmp_path):
    """Their error weighs all rows the same: a few runs of large loops decide how it scatters."""
    (truth,) = write_suite(
        "single", 1, "develop", tmp_path, twins=False, skip=3, only=("wear",),
        report=lambda _: None,
    )  # fmt: skip
    assert list(truth["effects"]) == ["wear"]
    drive = read_drive(tmp_path / f"{truth['name']}.toml")
    found = diagnose(drive, read_campaign(tmp_path / f"{truth['name']}.csv.gz", ratio=drive.ratio))
    assert (found.verdict, found.effects) == ("missing-effect", ["wear"])
    least, _ = found.ladder[-1]["gain_interval_arcsec"]
    assert least < 0.0


def test_an_effect_that_explains_nothing_more_is_dropped(warm_gap):
    """Beside the true gap an effect without any share in the data is not kept."""
    newest, settled = warm_gap.selection.steps[0].selected, warm_gap.selection.settled[-1]
    base = settled.base.copy()
    offset = library()["torque_offset"]
    base.terms.insert(0, Term(offset, offset.typical * 0.0, [0]))
    both = refitted(base, settled.noise)
    alone = both.base.copy()
    del alone.terms[1]
    model = SimpleNamespace(
        now=replace(both, base=alone), counts={"torque_offset": 20}, replaced=set()
    )
    model.to_drop = partial(RecordedModel.to_drop, model)
    for given, names in ((0, ["thermal_gap"]), (1, ["torque_offset", "thermal_gap"])):
        model.given_terms = given
        kept = RecordedModel.without_idle(model, replace(newest, settled=both))
        assert [term.effect.name for term in kept.base.terms] == names


def test_an_effect_that_explained_what_the_newest_does_is_dropped_once(warm_gap):
    newest = warm_gap.selection.steps[0].selected
    found = newest.tested
    assert accepted(found, 1)
    model = SimpleNamespace(replaced=set())
    shape = replace(newest, candidate=replace(newest.candidate, named=False))
    drop = partial(RecordedModel.to_drop, model, "creep", newest, 1)
    most, least = (replace(found, gain=share * found.gain) for share in (0.6, 0.4))
    assert [drop(found, most), drop(found, least), drop(found, least)] == [False, True, False]
    assert model.replaced == {"creep"}
    assert not RecordedModel.to_drop(model, "wear", shape, 1, found, least)
    assert drop(found, replace(least, p=1.0))  # not significant any more
    assert drop(found, None)


def test_what_the_runs_took_up_of_an_effect_counts_as_its_size():
    """An effect that is constant in every run may be absorbed by the stiffness of each run."""

    def uneven(columns, wound):
        elastic = wound * 7.0 + 25.0 * np.tanh(wound / 8.0)
        return 0.02 * np.cos(2 * columns["input_angle"]) * elastic

    base = BaselineModel(Conditions(campaign(seed=6, warm=False, add=uneven)), RATED_NM)
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
    with_effect = Settled(hidden, settled.contest, noise)
    assert fall_of_error(settled, with_effect) == pytest.approx(size, rel=0.1)
