"""Evidence: classes of runs, effects visible in few runs, effects that act on the torque."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from small_campaigns import RATED_NM, RATIO, campaign, torque_of

from lostmotion.candidates.between_runs import partings, run_drifts, scan
from lostmotion.candidates.candidate import Candidate
from lostmotion.candidates.named import named_candidates
from lostmotion.candidates.shapes import waves
from lostmotion.discover import diagnose, library
from lostmotion.discover.contest_round import RecordedRound, make_candidates, make_round
from lostmotion.discover.gates import accepted, corrected_for, judge
from lostmotion.discover.linearise import noise_rms, settle
from lostmotion.discover.measurement_noise import estimate_noise
from lostmotion.discover.noise_floor import noise_floor
from lostmotion.discover.refits import refit
from lostmotion.discover.terms import contest_of_term
from lostmotion.effects.conditions import Conditions
from lostmotion.evidence.contest import Contest
from lostmotion.evidence.gram import gather
from lostmotion.evidence.noise import Noise
from lostmotion.evidence.scatter import solved
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.terms import Term
from lostmotion.recordings import Campaign, Run
from lostmotion.torsion_curve import run_plays

ARCSEC = np.pi / 180 / 3600
RUNS, ROWS = 20, 80


def scattering(seed: int, steps: float = 0.0, few: float = 0.0, many: float = 0.0):
    """Runs whose slope scatters by 1; a step of it in the last three, a wave in three, in all."""
    rng = np.random.default_rng(seed)
    starts = np.arange(RUNS + 1) * ROWS
    run_of = np.repeat(np.arange(RUNS), ROWS)
    x = np.tile(np.linspace(-1, 1, ROWS), RUNS)
    own = rng.normal(size=(RUNS, 2))
    own[-3:, 0] += steps
    worn = np.isin(run_of, (4, 9, 14))
    column = np.where(worn, np.sin(9 * x), 0.0)
    y = 3 * x + own[run_of, 0] * x + own[run_of, 1] + rng.normal(size=x.size)
    y += few * column + many * np.cos(9 * x)
    both = np.column_stack((x, np.ones(x.size)))
    noise = Noise([np.zeros(0)] * RUNS, np.ones(RUNS))
    blocks = [
        (f"step {k}", np.where(beyond[run_of], x, 0.0)[:, None])
        for k, (_, beyond) in enumerate(partings(np.arange(RUNS, dtype=float)))
    ]
    blocks += [("few", column[:, None]), ("many", np.cos(9 * x)[:, None])]
    return gather(both, np.zeros(2), both, blocks, y, noise, starts)


def best_step(contest: Contest):
    masks = np.array([beyond for _, beyond in partings(np.arange(RUNS, dtype=float))], dtype=float)
    best = int(np.argmax(scan(contest, 0, masks)))
    return best, contest.test(f"step {best}"), len(masks)


def test_partings_are_between_different_values():
    found = partings(np.array([0.0, 0.0, 5.0, 5.0, 5.0, 9.0]))
    assert [np.count_nonzero(beyond) for _, beyond in found] == [4, 1]
    assert [threshold for threshold, _ in found] == [2.5, 7.0]


def test_the_level_is_shared_evenly_among_answers_and_within_each():
    def candidate(name, kind, starts=0, tests=1):
        column = np.ones((2, max(starts, 1)))
        start_of = list(range(starts))
        return Candidate(name, kind == "effect", column, start_of=start_of, kind=kind, tests=tests)

    made = [candidate(f"wave {k}", "ripple") for k in range(50)]
    made += [candidate("step", "run", tests=2), candidate("drift", "run")]
    made += [candidate("plain", "effect"), candidate("grid", "effect", starts=4)]
    columns = [(c.name, np.ones((4, c.columns.shape[1]))) for c in made]
    noise = Noise([np.zeros(0)] * 2, np.ones(2))
    evidence = gather(
        np.ones((4, 1)),
        np.ones(1),
        np.ones((4, 1)),
        columns,
        np.zeros(4),
        noise,
        np.array([0, 2, 4]),
    )
    nothing: Any = None
    candidates = {c.name: c for c in made}
    current = RecordedRound(Contest(evidence), candidates, {}, 0.0, nothing)
    paid = {c.name: corrected_for(current, c) for c in made}
    answers = 2 + 3  # two effects and three unnamed kinds
    assert (paid["plain"], paid["grid"]) == (answers * 1, answers * 5)
    assert (paid["wave 0"], paid["step"], paid["drift"]) == (answers * 50, answers * 3, answers * 3)
    # If each test passes with a probability of level / paid, any passes with the level at most:
    # no smooth shape is in the round, and its share is not used.
    tests = {"plain": 1, "grid": 5, "step": 2, "drift": 1} | {f"wave {k}": 1 for k in range(50)}
    assert sum(count / paid[name] for name, count in tests.items()) == pytest.approx(4 / answers)


def test_the_scan_finds_what_a_test_of_every_parting_finds():
    contest = Contest(scattering(3, steps=6.0))
    masks = np.array([beyond for _, beyond in partings(np.arange(RUNS, dtype=float))], dtype=float)
    fast = scan(contest, 0, masks)
    slow = [contest.test(f"step {k}", refit_scatter=False).wald for k in range(len(masks))]
    assert fast == pytest.approx(slow, rel=1e-6, abs=1e-6)


def test_a_step_of_the_last_runs_is_found_where_it_is():
    found = 0
    for seed in range(10):
        contest = Contest(scattering(seed, steps=6.0))
        best, result, trials = best_step(contest)
        masks = partings(np.arange(RUNS, dtype=float))
        found += (
            np.count_nonzero(masks[best][1]) == 3 and result.p * trials <= 0.05 and result.gain >= 2
        )
    assert found >= 8


def test_the_best_of_many_partings_keeps_the_level_of_its_test():
    wrong = 0
    for seed in range(120):
        _, result, trials = best_step(Contest(scattering(seed)))
        wrong += result.p * trials <= 0.05
    assert wrong < 14  # binomial(120, 0.05): 0.3 % beyond


def test_flips_cannot_refuse_what_the_plan_lets_three_runs_show():
    hits, limits = 0, []
    for seed in range(10):
        result = Contest(scattering(seed, few=1.0)).test("few")
        limits.append(result.flip_limit)
        hits += accepted(result, 1)
    assert min(limits) > 0.2
    assert hits >= 9


def test_few_runs_have_no_more_false_alarms_than_many():
    wrong = sum(accepted(Contest(scattering(seed)).test("few"), 1) for seed in range(150))
    assert wrong < 9  # the level is at most 0.05 x 0.05 / 0.25: binomial(150, 0.01), 0.01 % beyond


def test_many_runs_keep_the_flips_at_their_level():
    limits = [Contest(scattering(seed, many=0.5)).test("many").flip_limit for seed in range(3)]
    assert limits == [0.05] * 3


def test_what_all_runs_have_more_of_is_a_change_of_the_base_whatever_their_deviations_are():
    # Otherwise a shape with a constant would contain the deviations that it has to explain.
    base = BaselineModel(Conditions(campaign(seed=4)), RATED_NM, None)
    base.first_fit()
    base.deviations[:, :2] = np.random.default_rng(4).normal(size=(base.conditions.runs, 2)) * 0.05
    point = base.at()
    step = 1e-6
    runs, fixed = base.run_columns(point), base.fixed_columns(point)
    more = base.copy()
    more.curve.slopes = base.curve.slopes * (1 + step)
    assert runs[:, 0] == pytest.approx((more.angle() - base.angle()) / step, abs=1e-3)
    taken = np.linalg.lstsq(fixed, runs[:, 0], rcond=None)[0]
    assert np.abs(runs[:, 0] - fixed @ taken).max() < 1e-8 * np.abs(runs[:, 0]).max()


def turning_campaign(seed: int = 1) -> Campaign:
    """Loops in which the input turns back and forth at several speeds."""
    made = campaign(seed)
    for r, run in enumerate(made.runs):
        t = run.columns["time"]
        run.columns["input_angle"] = (5.0 + 5.0 * (r % 4)) * np.sin(0.4 * t + r)
        run.columns["output_angle"] = run.columns["input_angle"] / RATIO
    return Campaign(made.runs)


@pytest.mark.parametrize("name", ["viscous_friction", "stribeck_friction", "inertia"])
def test_what_acts_on_the_torque_has_the_slope_of_the_whole_model(name):
    base = BaselineModel(Conditions(turning_campaign()), RATED_NM)
    base.fit(steps=10)
    effect = library()[name]
    (candidate,), closed = named_candidates({name: effect}, base, base.at(), RATIO)
    assert not closed
    plain = base.at().angle
    place = effect.indices("linear")[0]
    values = candidate.starts[0].copy()
    values[effect.indices("linear")] = 0.0
    values[place] = 1e-3 * RATED_NM / {"inertia": 0.16}.get(name, 20.0)
    if name == "stribeck_friction":
        values[place] = 1e-3 * RATED_NM
    base.terms.append(Term(effect, values, [place]))
    change = (base.at().angle - plain) / values[place]
    column = candidate.columns[:, 0]
    cosine = change @ column / np.linalg.norm(change) / np.linalg.norm(column)
    assert cosine > 0.98
    assert np.linalg.norm(change) == pytest.approx(np.linalg.norm(column), rel=0.1)


@pytest.mark.parametrize("name", ["stiffness_modulation", "lobe_eccentricity", "kinematic_error"])
def test_what_an_effect_in_the_model_does_counts_in_full_for_it(name):
    base = BaselineModel(Conditions(turning_campaign()), RATED_NM)
    base.fit(steps=5)
    effect = library()[name]
    values = effect.typical.copy()
    values[effect.scaling()] *= 2.0
    if name == "lobe_eccentricity":
        values[:2] = 0.0
    without = base.angle()
    base.terms = [Term(effect, values, effect.indices("linear") + effect.indices("shape"))]
    with_it = base.angle()
    rng = np.random.default_rng(7)
    base.measured = with_it + rng.normal(size=with_it.size)
    runs = base.conditions.runs
    settled = settle(base, Noise([np.zeros(0)] * runs, np.ones(runs)))
    contest, block = contest_of_term(settled, 0)
    # Its power over the noise, minus what the baseline model and the scatter of the runs absorb.
    power = float(np.sum((with_it - without) ** 2))
    assert contest.test(block).wald > 0.2 * power > 100.0


@pytest.mark.parametrize("takeup", [0.1, 0.4, 1.0])
@pytest.mark.parametrize("direction_deg", range(0, 180, 15))
def test_lobes_that_do_not_run_true_are_fitted_whatever_their_direction(direction_deg, takeup):
    base = BaselineModel(Conditions(turning_campaign()), RATED_NM)
    base.fit(steps=5)
    effect = library()["lobe_eccentricity"]
    direction = np.radians(direction_deg)
    runout, closing = 4e-5, 1e-4
    values = np.array([0, 0, runout * np.cos(direction), runout * np.sin(direction),
                       closing / (takeup * RATED_NM), takeup * RATED_NM])  # fmt: skip
    true = base.copy()
    true.terms = [Term(effect, values, effect.free())]
    rng = np.random.default_rng(direction_deg)
    power = float(np.sum((true.angle() - base.angle()) ** 2))
    sigma = np.sqrt(power / 400.0)
    base.measured = true.angle() + sigma * rng.normal(size=base.measured.size)
    runs = base.conditions.runs
    settled = settle(base, Noise([np.zeros(0)] * runs, np.full(runs, sigma)))
    candidates, _ = named_candidates({effect.name: effect}, base, base.at(), RATIO)
    current = make_round(settled, candidates, {})
    result = judge(current, effect.name)
    contender = refit(current, result)
    assert contender.gain > 0.7 * result.gain > 10.0


@pytest.mark.parametrize("sense", [1, -1])
def test_a_coupling_falls_over_the_same_way_whichever_way_the_drive_turns(sense):
    """The input of a drive of negative ratio turns against the output, and so does its drag."""
    conditions = Conditions(turning_campaign())
    for column in ("input_angle_rad", "input_velocity_rad_s"):
        conditions.columns[column] = sense * conditions.columns[column]
    base = BaselineModel(conditions, RATED_NM)
    base.fit(steps=5)
    effect = library()["input_coupling_play"]
    drag = 0.05 * RATED_NM
    values = np.array([0.008, RATIO, 0.01 * RATED_NM, sense * drag, 0.2])
    true = base.copy()
    true.terms = [Term(effect, values, effect.free())]
    rng = np.random.default_rng(3)
    power = float(np.sum((true.angle() - base.angle()) ** 2))
    sigma = np.sqrt(power / 4e4)
    base.measured = true.angle() + sigma * rng.normal(size=base.measured.size)
    runs = base.conditions.runs
    settled = settle(base, Noise([np.zeros(0)] * runs, np.full(runs, sigma)))
    candidates, _ = named_candidates({effect.name: effect}, base, base.at(), sense * RATIO)
    current = make_round(settled, candidates, {})
    contender = refit(current, judge(current, effect.name))
    assert contender.gain > 50.0
    assert contender.settled is not None
    play, _, _, found_drag, _ = contender.settled.base.terms[-1].values
    assert play > 0
    assert sense * found_drag > 0


def quick_campaign(seed: int, share: float) -> Campaign:
    """Sixteen runs, the last three of them quick, in which the drive is softer by `share`."""
    rng = np.random.default_rng(seed)
    swings = [torque_of(r, 500) for r in range(16)]
    remembered = run_plays(np.array([3.0]), np.concatenate(swings), 0.0)[:, 0].reshape(16, 500)
    made = []
    for r in range(16):
        quick = r >= 13
        wound = swings[r] + 0.5 * (1 + 0.02 * rng.normal()) * remembered[r]
        soft = 1 + 0.003 * rng.normal() + share * quick
        y = soft * (wound * 7.0 + 25.0 * np.tanh(wound / 8.0)) + rng.normal(size=500)
        columns = {
            "time": np.arange(500) * (0.01 if quick else 0.1),
            "torque": swings[r],
            "lost_motion": y * ARCSEC,
        }
        made.append(Run(r + 1, "made.csv", columns))
    return Campaign(made)


def test_a_drive_that_is_softer_in_quick_runs_hangs_on_the_rate_or_on_the_run():
    found = diagnose(None, quick_campaign(4, 0.03), ratio=RATIO, rated_torque_Nm=RATED_NM).answer()
    assert found["verdict"] == "unexplained"
    # The quick runs are the last ones: these recordings cannot state which of the two it is.
    assert {d["covariate"] for d in found["unexplained"]["depends_on"]} == {
        "torque_rate",
        "run",
    }


def test_a_parameter_that_drifts_from_run_to_run_is_reported():
    data = campaign(seed=8, runs=16, warm=False)
    base = BaselineModel(Conditions(data), RATED_NM)
    tangent = run_drifts(base)[0].columns[:, 0]
    for r, run in enumerate(data.runs):
        drift = 0.02 * (r / 15 - 0.5)
        run.columns["lost_motion"] = run.columns["lost_motion"] * (1 + drift)
    found = diagnose(None, data, ratio=RATIO, rated_torque_Nm=RATED_NM).answer()
    assert (found["verdict"], found["effects"]) == ("unexplained", [])
    (one,) = found["unexplained"]["depends_on"]
    assert (one["covariate"], one["shape"]) == ("run", "stiffness, a steady drift")
    first = slice(0, 500)
    assert tangent[first] == pytest.approx(-base.run_columns(base.at())[first, 0])


def test_quick_runs_that_are_like_the_others_are_no_class():
    found = diagnose(None, quick_campaign(5, 0.0), ratio=RATIO, rated_torque_Nm=RATED_NM).answer()
    assert found["verdict"] == "complete"


def test_what_the_friction_of_all_runs_shares_is_no_scatter():
    data = campaign(3)
    base = BaselineModel(Conditions(data), RATED_NM)
    base.first_fit()
    # Half widths that fit no run: their residual is in every run.
    base.hysteresis.radius_Nm = 0.8 * base.hysteresis.radius_Nm
    base.fit(steps=8)
    candidates, _ = make_candidates(base, library(), RATIO, waves(base))
    noise = estimate_noise(base, [k.columns for k in candidates])
    settled = settle(base, noise)
    friction = settled.base.deviations[:, 1]
    assert abs(friction.mean()) < 0.01
    floor = noise_floor(settled, noise_rms(noise, base))
    # Noise of 1 arcsec, with the scatter of 0.3 % in stiffness and 2 % in friction.
    assert 1.0 < floor < 1.3


def test_the_angle_alone_is_that_of_the_whole_evaluation():
    base = BaselineModel(Conditions(turning_campaign()), RATED_NM)
    base.fit(steps=5)
    effects = library()
    for name, place in (
        ("viscous_friction", 0),
        ("kinematic_error", 0),
        ("thermal_friction", 0),
    ):
        base.terms.append(Term(effects[name], effects[name].typical, [place]))
    base.deviations[:] = np.random.default_rng(2).normal(size=base.deviations.shape) * 0.01
    base.hysteresis.start[:] = 0.3
    assert base.angle() == pytest.approx(base.at().angle, abs=1e-9)


def test_equations_that_rounding_made_singular_have_a_solution() -> None:
    singular = 1e22 * np.ones((3, 3))
    assert np.all(np.isfinite(solved(singular, np.ones(3))))
    regular = np.diag([1.0, 2.0, 4.0])
    np.testing.assert_allclose(solved(regular, np.ones(3)), [1.0, 0.5, 0.25])
