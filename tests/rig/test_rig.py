"""Tests of the rig: it works as its README states."""

from __future__ import annotations

import ast
import gzip
import json
from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

from .bench import (
    SCATTER,
    SIGMA_ARCSEC,
    Residual,
    TestBench,
    TooSmallError,
    stream,
)
from .campaign import Conditions, angle_noise, make_campaign
from .drives import SIZES, build_drive
from .hidden import EFFECTS, HIDDEN, OUTSIDE, lagged
from .mechanics import ARCSEC, SCALES, Array, Drive, Memory, Samples, quasi_static, turn
from .plans import PLANS, make_plan
from .suites import DEVELOP, JUDGE, KINDS, seeds_of, twins_of, write_suite

try:
    import tomllib
except ModuleNotFoundError:
    import tomli as tomllib

# The names of the effects; scripts depend on them.
NAMES = {
    "kinematic_error",
    "kinematic_sideband",
    "stiffness_modulation",
    "lobe_eccentricity",
    "output_eccentricity",
    "free_play",
    "input_coupling_play",
    "thermal_gap",
    "thermal_stiffness",
    "thermal_drift",
    "thermal_friction",
    "wear",
    "creep",
    "viscous_friction",
    "stribeck_friction",
    "load_dependent_friction",
    "soft_windup",
    "stiffening",
    "asymmetric_stiffness",
    "torque_offset",
    "torque_scale",
    "input_lock_compliance",
    "output_tilt",
    "axial_shift",
    "inertia",
    "sensor_lag",
    "ratcheting",
}
QUICK = ("kinematic_error", "thermal_gap", "creep", "load_dependent_friction", "torque_offset")


@cache
def drive(number: int = 2) -> Drive:
    return build_drive(SIZES[number], np.random.default_rng(number))


@cache
def bench(plan: str = "third") -> TestBench:
    return TestBench(5, 2, plan)


def path(*shares: float, steps: int = 200) -> Array:
    """Torques that change linearly from share to share of the rated torque of the drive."""
    legs = [np.linspace(a, b, steps + 1)[1:] for a, b in pairwise(shares)]
    return drive().rated_torque_Nm * np.concatenate(legs)


# --- mechanics -----------------------------------------------------------------------------------


def test_torques_balance_at_every_sample() -> None:
    torque = path(0, 1, -0.4, 0.7, -1, 0.2)
    turned = quasi_static(drive(), torque)
    force = np.zeros(len(drive().slip_limit_Nm))
    before = 0.0
    for i, angle in enumerate(turned.angle_rad):
        stiffness = drive().slip_limit_Nm / drive().slip_angle_rad
        force = force + stiffness * (angle - before)
        force = np.clip(force, -drive().slip_limit_Nm, drive().slip_limit_Nm)
        before = angle
        assert turned.elastic_torque_Nm[i] + force.sum() == pytest.approx(torque[i], abs=1e-5)


def test_elastic_torque_is_what_the_tooth_pairs_in_contact_carry() -> None:
    made = drive()
    bare = made.scaled(dict.fromkeys(("radial_rad", "torsion_rad", "gap_rad"), 1e-9))
    turned = quasi_static(bare, path(0, 1, -1))
    mesh = turned.angle_rad
    for side, sign in ((0, 1), (1, -1)):
        pressed = np.clip(sign * mesh[:, None] - made.pair_gap_rad[side], 0, None)
        carried = pressed @ made.pair_stiffness_Nm_per_rad[side]
        on_side = sign * mesh > 1e-7
        assert np.allclose(turned.elastic_torque_Nm[on_side], sign * carried[on_side], rtol=1e-4)


def test_small_cycles_close_and_do_not_creep() -> None:
    angle = quasi_static(drive(), path(0, 1, *([0.3, 0.36] * 20))).angle_rad
    ends = angle[399::400]
    assert np.ptp(ends[1:]) < 1e-4 * ARCSEC


def test_a_closed_excursion_is_wiped_out() -> None:
    straight = quasi_static(drive(), path(0, 0.9)).angle_rad[-1]
    roundabout = quasi_static(drive(), path(0, 0.6, -0.1, 0.6, 0.9)).angle_rad[-1]
    assert roundabout == pytest.approx(straight, abs=1e-4 * ARCSEC)


@pytest.mark.parametrize("steps", [1, 10, 1000])
def test_the_end_does_not_depend_on_the_number_of_steps(steps: int) -> None:
    way = (0, 1, -1, 0.5, -0.2)
    end = quasi_static(drive(), path(*way, steps=steps)).angle_rad[-1]
    assert end == pytest.approx(quasi_static(drive(), path(*way)).angle_rad[-1], abs=1e-4 * ARCSEC)


def test_memory_continues_from_one_stretch_to_the_next() -> None:
    torque = path(0, 1, -0.5, 0.3)
    whole = quasi_static(drive(), torque).angle_rad
    memory = Memory()
    parts = [quasi_static(drive(), part, memory).angle_rad for part in np.split(torque, 3)]
    assert np.array_equal(np.concatenate(parts), whole)


def test_a_mass_is_at_rest_when_a_recording_starts_and_swings_when_the_torque_jumps() -> None:
    torque = 0.4 * drive().rated_torque_Nm * np.repeat([-1.0, 0.0, 0.4], [20, 20, 40])
    one = np.ones(torque.size)
    step = 0.01 * one
    step[[0, 20]] = 0.0  # two recordings; the second has a jump

    def turned(inertia_kgm2: float) -> Array:
        heavy = replace(drive(), inertia_kgm2=inertia_kgm2)
        samples = Samples(
            torque, heavy.gap_rad * one, one, one, 0 * one, 0 * one, step_s=step.copy()
        )
        return turn(heavy, samples).angle_rad

    light, heavy = turned(0.0), turned(0.5)
    assert heavy[:40] == pytest.approx(light[:40], abs=1e-4 * ARCSEC)
    assert np.abs(heavy[40:] - light[40:]).max() > 1.0 * ARCSEC


@pytest.mark.parametrize("number", range(len(SIZES)))
def test_loops_have_the_form_of_a_strain_wave_drive(number: int) -> None:
    made = TestBench(number, number, "third", sheet_error=0.0).drive
    ramp = np.linspace(0, made.rated_torque_Nm, 300)
    loop = np.concatenate([ramp, ramp[::-1], -ramp, -ramp[::-1], ramp, ramp[::-1]])
    angle = quasi_static(made, loop).angle_rad.reshape(6, 300) / ARCSEC
    load, unload = angle[4], angle[5][::-1]
    width = unload - load
    assert 20 < width[0] < 130
    assert abs(width[-1]) < 0.01
    assert np.all(width > -0.01)
    # Both sides are equal except for the scatter of the teeth.
    assert np.sqrt(np.mean((angle[5] + angle[3]) ** 2)) < 0.5
    sheet, book = made.sheet, SIZES[number].stiffness
    assert sheet["K1_Nm_per_rad"] < sheet["K2_Nm_per_rad"] < sheet["K3_Nm_per_rad"]
    for name, value in zip(("K1", "K2", "K3"), book, strict=True):
        assert 0.6 < sheet[f"{name}_Nm_per_rad"] / (1e3 * value) < 1.7


# --- noise and scatter ---------------------------------------------------------------------------


def test_the_noise_is_what_is_stated() -> None:
    made = make_campaign(3, 2, {}, "standard")
    rated = made.bench.drive.rated_torque_Nm
    noise = (
        made.measured["output_angle_rad"]
        - made.readings.lost_motion_rad
        - made.bench.plan.input_angle_rad / made.bench.drive.ratio
    ) / ARCSEC
    assert np.std(noise) == pytest.approx(1.5, rel=0.03)
    rows = made.bench.plan.slices()[0]
    torque = made.measured["torque_Nm"] - made.readings.torque_Nm
    assert np.std(torque) == pytest.approx(2e-4 * rated, rel=0.03)
    counts = made.measured["output_angle_rad"][rows] / (0.3 * ARCSEC)
    assert np.allclose(counts, np.round(counts), atol=1e-6)
    for lag in (1, 3, 8):
        found = np.mean([noise[r][lag:] @ noise[r][:-lag] for r in made.bench.plan.slices()])
        whole = np.mean([noise[r] @ noise[r] for r in made.bench.plan.slices()])
        assert found / whole == pytest.approx(0.3 * 0.85**lag, abs=0.03)


def test_whitening_makes_the_noise_white_with_unit_variance() -> None:
    plan = bench().plan
    lengths = [rows.stop - rows.start for rows in plan.slices()]
    noise = SIGMA_ARCSEC * ARCSEC * angle_noise(np.random.default_rng(1), lengths)
    white = np.concatenate(bench()._whitened(noise[:, None]))[:, 0]
    assert np.var(white) == pytest.approx(1.0, abs=0.04)
    for lag in (1, 2, 5):
        assert abs(white[lag:] @ white[:-lag]) / len(white) < 0.03


def test_the_scatter_from_run_to_run_is_what_is_stated() -> None:
    found: dict[str, list[float]] = {name: [] for name in SCATTER}
    for seed in range(12):
        made = TestBench(seed, seed, "third").thinned
        change = made.plain - made.unscattered
        for rows in made.plan.slices():
            # In a run that turns without load, the scatter is not visible.
            if np.ptp(made.plan.torque[rows]) < 0.5:
                continue
            tangents = np.column_stack(
                [made.scatter_tangents[rows], np.ones(rows.stop - rows.start)]
            )
            fit = np.linalg.lstsq(tangents, change[rows], rcond=None)[0]
            for name, value in zip(SCATTER, fit, strict=False):
                found[name].append(value)
    stated = {"stiffness": 0.003, "friction": 0.02, "gap": 0.01}
    for name, rms in stated.items():
        assert np.std(found[name]) == pytest.approx(rms, rel=0.25), name


def test_the_scatter_can_be_made_larger() -> None:
    one, three = (TestBench(5, 2, "third", scatter=factor).scattered for factor in (1, 3))
    for name in SCATTER:
        assert np.allclose(three[name] - 1, 3 * (one[name] - 1))


def test_a_lag_is_that_of_a_first_order_low_pass() -> None:
    step = np.r_[0.0, np.full(999, 0.01)]
    ramp = np.cumsum(step)
    late = lagged(ramp, step, 0.2)
    assert np.allclose(late, ramp - 0.2 * (1 - np.exp(-ramp / 0.2)), atol=1e-9)


# --- what is hidden ------------------------------------------------------------------------------


def test_every_effect_of_the_library_can_be_hidden() -> None:
    assert EFFECTS.keys() == NAMES


@pytest.mark.parametrize("name", [name for name in HIDDEN if not HIDDEN[name].spike])
def test_nothing_is_changed_by_an_effect_of_no_size(name: str) -> None:
    made = bench().thinned
    readings = made.read({name: 0.0})
    assert np.allclose(readings.lost_motion_rad, made.plain, atol=1e-3 * ARCSEC)
    assert np.allclose(readings.torque_Nm, made.torque_Nm)


@cache
def sized(name: str) -> tuple[float, Residual]:
    return bench().magnitude_for(name, 0.5)


@pytest.mark.parametrize("name", QUICK)
def test_an_effect_leaves_the_wanted_residual(name: str) -> None:
    magnitude, residual = sized(name)
    assert residual.arcsec == pytest.approx(0.5 * SIGMA_ARCSEC, rel=0.03)
    assert 0 < magnitude < HIDDEN[name].limit


@pytest.mark.parametrize("name", ["thermal_gap", "creep"])
def test_another_way_of_refitting_leaves_as_much(name: str) -> None:
    made = bench().thinned
    magnitude, _ = sized(name)
    truth = made.read({name: magnitude}).lost_motion_rad

    def left(moves: Array) -> Array:
        scales = dict(zip(SCALES, 1 + moves, strict=True))
        refitted = made.refitted(scales, made.torque_Nm)
        prior = np.sqrt(made._weight) * moves
        return np.concatenate([made.centred(truth - refitted), prior]) / ARCSEC

    found = least_squares(left, np.zeros(len(SCALES)), x_scale=0.1, diff_step=1e-3, max_nfev=15)
    rms = np.sqrt(np.mean(found.fun[: len(truth)] ** 2))
    assert rms == pytest.approx(made.absorb({name: magnitude}).arcsec, rel=0.02)


@pytest.mark.parametrize("name", ["torque_scale", "thermal_drift"])
def test_what_a_plan_cannot_show_is_refused(name: str) -> None:
    with pytest.raises(TooSmallError, match=f"{name}.*`third` cannot show it"):
        bench().magnitude_for(name, 0.5)


def test_what_rises_together_cannot_be_distinguished_and_what_does_not_can() -> None:
    aliased = make_campaign(850, 2, {"thermal_gap": 0.5}, "aliased")
    assert twins_of(aliased).keys() == {"wear"}
    standard = make_campaign(850, 2, {"thermal_gap": 0.5}, "third")
    assert twins_of(standard, 0.9) == {}


def test_a_slip_is_one_event_in_one_run() -> None:
    made = make_campaign(4, 1, {}, "third", magnitudes={"outside_slip": 12.0})
    (event,) = made.truth()["events"]
    change = (made.readings.lost_motion_rad - made.bench.plain) / ARCSEC
    at = int(np.flatnonzero(np.abs(np.diff(change)) > 6)[0]) + 1
    assert made.bench.plan.run[at] + 1 == event["run"]
    assert made.bench.plan.time_s[at] == event["time_s"]
    assert np.ptp(change) == pytest.approx(event["size_arcsec"])


def test_teeth_jump_only_under_an_overload() -> None:
    made = make_campaign(4, 1, {"ratcheting": 0.5}, "third")
    (event,) = made.truth()["events"]
    teeth = 2 * (made.bench.drive.ratio + 1)
    assert event["size_arcsec"] == pytest.approx(360 * 3600 / teeth)
    assert not TestBench(4, 1, "third").read({"ratcheting": 1.0}).events


def test_lost_counts_and_outliers_are_as_many_as_asked_for() -> None:
    plain = make_campaign(4, 1, {}, "third")
    spoilt = make_campaign(
        4, 1, {}, "third", Conditions(dropped_counts=40, outliers=0.01, outlier_arcsec=100)
    )
    change = (spoilt.measured["output_angle_rad"] - plain.measured["output_angle_rad"]) / ARCSEC
    (event,) = spoilt.events
    assert event.size_arcsec == pytest.approx(-12.0)
    assert np.median(change[-100:]) == pytest.approx(-12.0, abs=0.01)
    assert np.mean(np.abs(change - np.where(change < -6, -12, 0)) > 15) == pytest.approx(
        0.01, rel=0.2
    )


# --- plans and files -----------------------------------------------------------------------------


@pytest.mark.parametrize("name", PLANS)
def test_plans_are_sound(name: str) -> None:
    plan = make_plan(name, 100, np.random.default_rng(0))
    for rows in plan.slices():
        assert plan.step_s[rows][0] == 0
        assert np.all(plan.step_s[rows][1:] > 0)
    assert np.max(np.abs(plan.torque)) <= (3.0 if name == "extended" else 1.0)
    assert np.array_equal(plan.thinned(1).step_s, plan.step_s)


def test_the_standard_plan_is_that_of_the_shared_campaigns() -> None:
    plan = make_plan("standard", 100, np.random.default_rng(0))
    assert len(plan.run) == 44200
    counts = {kind: plan.kinds.count(kind) for kind in set(plan.kinds)}
    assert counts == {"loop": 18, "turning": 9, "hold": 2, "fast loop": 2}


def test_turning_is_one_turn_and_back_without_a_jump_of_speed() -> None:
    plan = make_plan("standard", 100, np.random.default_rng(0))
    for rows, kind in zip(plan.slices(), plan.kinds, strict=True):
        if kind == "turning":
            angle = plan.input_angle_rad[rows]
            assert np.max(angle) == pytest.approx(2 * np.pi * 100, rel=0.02)
            assert angle[-1] < 0.01 * np.max(angle)
            speed = plan.speed_rad_per_s[rows]
            assert np.max(np.abs(np.diff(speed))) < 0.1 * np.max(np.abs(speed))


def test_the_same_seed_writes_the_same_bytes(tmp_path: Path) -> None:
    for folder in ("a", "b"):
        made = make_campaign(6, 3, {}, "third", magnitudes={"creep": 3.0})
        made.write(tmp_path / folder, "x")
    for ending in (".csv.gz", ".toml", ".truth.json"):
        one, two = ((tmp_path / folder / f"x{ending}").read_bytes() for folder in ("a", "b"))
        assert one == two


def test_the_same_seed_deals_the_same_noise_to_every_effect() -> None:
    plain, crept = (
        make_campaign(6, 3, {}, "third", magnitudes=effects) for effects in ({}, {"creep": 3.0})
    )
    change = crept.measured["output_angle_rad"] - plain.measured["output_angle_rad"]
    expected = crept.readings.lost_motion_rad - plain.readings.lost_motion_rad
    assert np.max(np.abs(change - expected)) < 0.31 * ARCSEC
    assert stream(6, "angle").random() != stream(7, "angle").random()


def test_files_are_those_of_the_interface(tmp_path: Path) -> None:
    conditions = Conditions(dropped_columns=("cycles",))
    made = make_campaign(6, 3, {}, "third", conditions, {"output_tilt": 4.0})
    made.write(tmp_path, "x")
    lines = gzip.decompress((tmp_path / "x.csv.gz").read_bytes()).decode().splitlines()
    assert lines[0] == (
        "run,time_s,torque_Nm,input_angle_rad,output_angle_rad,temperature_C,tilt_moment_Nm"
    )
    table = np.array([line.split(",") for line in lines[1:]], dtype=float)
    assert table.shape == (len(made.bench.plan.run), 7)
    assert np.allclose(table[:, 4], made.measured["output_angle_rad"], atol=1e-8)
    assert np.allclose(table[:, 2], made.measured["torque_Nm"], rtol=1e-4, atol=1e-4)
    sheet = tomllib.loads((tmp_path / "x.toml").read_text())
    assert sheet["drive"]["ratio"] == made.bench.drive.ratio
    assert sheet["catalogue"].keys() == {
        "T1_Nm",
        "T2_Nm",
        "K1_Nm_per_rad",
        "K2_Nm_per_rad",
        "K3_Nm_per_rad",
        "hysteresis_arcmin",
        "lost_motion_arcmin",
    }
    truth = json.loads((tmp_path / "x.truth.json").read_text())
    assert truth["effects"] == {"output_tilt": 4.0}


def test_no_one_is_asked_to_name_what_hangs_on_a_missing_column() -> None:
    for dropped, verdict in (((), "missing-effect"), (("temperature_C",), "unexplained")):
        conditions = Conditions(dropped_columns=dropped)
        made = make_campaign(6, 3, {}, "third", conditions, {"thermal_friction": 1.0})
        assert made.truth()["verdicts"][0] == verdict


@pytest.mark.parametrize("kind", ["clean", "outside"])
def test_a_suite_gives_nothing_away_by_its_names(kind: str, tmp_path: Path) -> None:
    truths = write_suite(
        kind, 2, "develop", tmp_path, plan="third", twins=False, report=lambda _: None
    )
    assert [truth["verdicts"] for truth in truths] == [
        ["complete"] if kind == "clean" else ["unexplained"]
    ] * 2
    for truth in truths:
        sheet = tomllib.loads((tmp_path / f"{truth['name']}.toml").read_text())
        assert sheet["drive"]["name"] == truth["name"] == f"campaign_{truth['seed']:05d}"
    assert all(set(truth["effects"]) <= set(OUTSIDE) for truth in truths)


def test_developing_and_judging_share_no_seed() -> None:
    seen: set[int] = set()
    for seeds, span in (("develop", DEVELOP), ("judge", JUDGE)):
        for kind in KINDS:
            mine = set(seeds_of(kind, seeds))
            assert mine <= set(span)
            assert not mine & seen
            seen |= mine


def test_nothing_of_the_library_is_imported() -> None:
    for source in Path(__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(source.read_text())):
            names = [alias.name for alias in getattr(node, "names", []) if hasattr(alias, "name")]
            names.append(getattr(node, "module", None) or "")
            assert not any(name.startswith("lostmotion") for name in names), source.name
    assert "lostmotion/" not in Path(__file__).with_name("mechanics.c").read_text()
