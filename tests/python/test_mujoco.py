"""Drives in MuJoCo: no energy is created, and the lost motion is that of `predict`."""

from __future__ import annotations

import copy
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from conftest import DATA, FITTED, needs_compiler
from lostmotion.drives import read_drive
from lostmotion.errors import InputError
from lostmotion.predict import predict
from lostmotion.simulators.arm import run_arm
from lostmotion.simulators.mujoco import (
    Placed,
    load_plugin,
    put_drives,
    set_timestep,
    slow_reversal,
)
from lostmotion.units import ARCMIN

mujoco = pytest.importorskip("mujoco", reason="no MuJoCo: pip install 'lostmotion[mujoco]'")

pytestmark = needs_compiler

DRIVES = sorted(
    file
    for folder in ("drives", "joint", "cycloidal_locked_output", "friction_damper")
    for file in (DATA / folder).glob("*.toml")
)

JOINT = DATA / "joint" / "joint.toml"

EFFECTS = """
[[effect]]
name = "kinematic_error"
cosine_2_rad = 1e-4
sine_2_rad = 3e-5
cosine_4_rad = 1e-5
sine_4_rad = 0.0
[[effect]]
name = "creep"
share = 0.01
onset_s = 1.0
[[effect]]
name = "torque_offset"
offset_Nm = 0.5
"""

STEPS_S = (5e-4, 2e-3, 4e-3)
LOCKED = 1e9
"""Armature of an input that does not move."""

Floats = npt.NDArray[np.float64]


@pytest.fixture
def with_effects(tmp_path: Path) -> Path:
    file = tmp_path / "with_effects.toml"
    file.write_text(JOINT.read_text(encoding="utf-8") + EFFECTS, encoding="utf-8")
    return file


def one_joint(step_s: float = 2e-3, armature: float = 0.1, more: str = "") -> mujoco.MjSpec:
    """A link on a hinge, without gravity."""
    return mujoco.MjSpec.from_string(
        f"""<mujoco>
        <option timestep="{step_s}" gravity="0 0 0" integrator="implicitfast"/>
        <default><joint damping="0.0" frictionloss="0.0"/></default>
        <worldbody><body name="link">
          <joint name="elbow" axis="0 0 1" armature="{armature}"/>
          <geom type="box" size=".2 .05 .05" mass="1"/>
        </body></worldbody>
        <actuator><motor joint="elbow"/></actuator>{more}</mujoco>"""
    )


def middle(torque: Floats, lost: Floats, at: Floats) -> Floats:
    """Middle of the loop's two branches at some torques."""
    quarter = torque.size // 4
    rising = np.r_[3 * quarter : torque.size, 0:quarter]
    falling = np.arange(quarter, 3 * quarter)[::-1]
    branches = [np.interp(at, torque[part], lost[part]) for part in (rising, falling)]
    return np.asarray(np.mean(branches, axis=0))


@pytest.mark.parametrize("drive_file", DRIVES, ids=lambda file: f"{file.parent.name}-{file.stem}")
def test_slow_reversal_with_a_locked_input_gives_what_predict_does(drive_file: Path) -> None:
    drive = read_drive(drive_file)
    # Both branches slip in the inner fifth of a loop.
    at = np.array([-0.2, -0.1, 0.1, 0.2]) * drive.rated_torque_Nm
    found = middle(*slow_reversal(drive, drive.rated_torque_Nm), at)
    predicted = np.array(predict(drive, at)["total_arcmin"]) * ARCMIN
    np.testing.assert_allclose(found, predicted, rtol=0.01)


def test_a_fitted_drive_with_friction_in_parallel(tmp_path: Path) -> None:
    file = tmp_path / "fitted.toml"
    file.write_text(FITTED + EFFECTS, encoding="utf-8")
    watch_energy(put_drives(one_joint(), {"elbow": file}), np.array([10.0, 50.0]))
    file.write_text(FITTED, encoding="utf-8")
    watch_energy(put_drives(one_joint(), {"elbow": file}), np.array([10.0, 50.0]))
    at = np.array([-20.0, -5.0, 5.0, 20.0])
    found = middle(*slow_reversal(file, 80.0), at)
    predicted = np.array(predict(read_drive(file), at)["fitted_arcmin"]) * ARCMIN
    np.testing.assert_allclose(found, predicted, rtol=0.01)


@pytest.mark.parametrize("drive_file", DRIVES, ids=lambda file: f"{file.parent.name}-{file.stem}")
def test_the_step_does_not_change_the_lost_motion(drive_file: Path) -> None:
    drive = read_drive(drive_file)
    found = []
    for step_s in STEPS_S:
        torque, lost = slow_reversal(drive, drive.rated_torque_Nm, step_s=step_s)
        middles = middle(torque, lost, np.array([-0.1, 0.1]) * drive.rated_torque_Nm)
        found.append([np.ptp(middles), np.ptp(lost)])
    for row in found[1:]:
        assert row == pytest.approx(found[0], rel=0.02)


def watch_energy(placed: Placed, scale_Nm: Floats) -> None:
    """Apply random torques to both hinges, then none: the released energy does not exceed the
    supplied one."""
    model, data = placed.model, mujoco.MjData(placed.model)
    rng = np.random.default_rng(3)
    momentum = np.zeros(2)
    work = largest = 0.0
    for k in range(3000):
        if k % 20 == 0:
            data.qfrc_applied[:] = rng.normal(size=2) * scale_Nm if k < 2000 else 0.0
        mujoco.mj_step(model, data)
        # The torque is constant over a step; its work is torque times motion.
        work += model.opt.timestep * float(data.qfrc_applied @ data.qvel)
        mujoco.mj_mulM(model, data, momentum, data.qvel)
        motion = 0.5 * float(data.qvel @ momentum)
        largest = max(largest, motion)
        assert motion <= work + 1e-9 * largest
    assert largest > 1e-3
    assert np.all(np.isfinite(data.qpos))


@pytest.mark.parametrize("step_s", [*STEPS_S, 1e-2])
@pytest.mark.parametrize("armature", [0.1, 1e-3])
def test_no_energy_is_created(with_effects: Path, step_s: float, armature: float) -> None:
    """Random torques on both sides, then none: the energy of the motion never exceeds their
    work."""
    for file in (JOINT, with_effects):
        scale = np.array([10.0 * min(1.0, 10 * armature), 50.0])
        watch_energy(put_drives(one_joint(step_s, armature), {"elbow": file}), scale)


@pytest.mark.parametrize("drive_file", DRIVES, ids=lambda file: f"{file.parent.name}-{file.stem}")
def test_no_energy_is_created_by_any_shipped_drive(drive_file: Path) -> None:
    watch_energy(put_drives(one_joint(), {"elbow": drive_file}), np.array([10.0, 50.0]))


def test_the_kinematic_error_moves_the_output_and_the_input_feels_it(with_effects: Path) -> None:
    placed = put_drives(one_joint(armature=LOCKED), {"elbow": with_effects})
    assert placed.drives[0].effects == ("kinematic_error", "creep")
    assert list(placed.drives[0].set_aside) == ["torque_offset"]
    model, data = placed.model, mujoco.MjData(placed.model)
    ratio = read_drive(with_effects).ratio
    data.qvel[0] = 0.005  # slow, because the damping lags by a step
    angle, lost = [], []
    for _ in range(16000):
        mujoco.mj_step(model, data)
        angle.append(ratio * data.qpos[0])
        lost.append(data.qpos[1])
    phase = 2.0 * np.array(angle[4000:])
    share = np.array([np.cos(phase), np.sin(phase)]) @ np.array(lost[4000:]) * 2 / len(phase)
    assert share == pytest.approx([1e-4, 3e-5], rel=0.1, abs=5e-6)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.qfrc_passive[0] != 0.0  # at rest the teeth hold the input at the kinematic error


def test_a_reset_state_continues_as_before(with_effects: Path) -> None:
    placed = put_drives(one_joint(), {"elbow": with_effects})
    model, data = placed.model, mujoco.MjData(placed.model)
    rng = np.random.default_rng(5)
    torques = rng.normal(size=300) * 40.0

    def go(one: mujoco.MjData, part: Floats) -> list[float]:
        found = []
        for torque in part:
            one.qfrc_applied[:] = torque
            mujoco.mj_step(model, one)
            found += one.qpos.tolist()
        return found

    go(data, torques[:150])
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    state = np.empty(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, state, kind)
    known = go(data, torques[150:])
    mujoco.mj_setState(model, data, state, kind)
    assert go(data, torques[150:]) == known
    mujoco.mj_setState(model, data, state, kind)
    other = copy.copy(data)
    mujoco.mj_resetData(model, data)
    assert go(other, torques[150:]) == known
    go(data, torques[:150])
    assert go(data, torques[150:]) == known
    # An evaluation at another position, without a step, changes nothing.
    mujoco.mj_resetData(model, data)
    go(data, torques[:150])
    kept = data.qpos.copy()
    data.qpos[1] = 3e-3
    mujoco.mj_forward(model, data)
    data.qpos[:] = kept
    assert go(data, torques[150:]) == known


def test_instances_in_threads_are_independent(with_effects: Path) -> None:
    rollout = pytest.importorskip("mujoco.rollout", reason="MuJoCo without its rollout module")
    model = put_drives(one_joint(), {"elbow": with_effects}).model
    size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    data = mujoco.MjData(model)
    start = np.empty(size)
    mujoco.mj_getState(model, data, start, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    control = np.random.default_rng(7).normal(size=(8, 500, 1)) * 30.0
    states = [
        rollout.rollout(model, [mujoco.MjData(model) for _ in range(count)], start, control)[0]
        for count in (1, 4)
    ]
    np.testing.assert_array_equal(states[0], states[1])
    assert np.ptp(states[0][:, -1], axis=0).max() > 0


def test_it_costs_less_than_two_microseconds_a_joint_and_step(with_effects: Path) -> None:
    count = 4000

    def measure(model: mujoco.MjModel) -> float:
        data = mujoco.MjData(model)
        best = np.inf
        for _ in range(5):
            data.qpos[1] = 1.5e-3
            data.qfrc_applied[0] = 20.0
            start = time.process_time()
            mujoco.mj_step(model, data, nstep=count)
            best = min(best, (time.process_time() - start) / count)
        return float(best)

    placed = put_drives(one_joint(), {"elbow": with_effects})
    spring = one_joint()
    added = spring.body("link").add_joint(
        name="spring", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1]
    )
    added.range = [-1e-2, 1e-2]
    assert measure(placed.model) - measure(spring.compile()) < 2e-6


def test_a_model_keeps_its_keyframes_and_its_file(tmp_path: Path) -> None:
    key = '<keyframe><key name="bent" qpos="0.7" qvel="0.1"/></keyframe>'
    spec = one_joint(more=key)
    placed = put_drives(spec, {"elbow": JOINT})
    assert placed.model.key("bent").qpos.tolist() == [0.7, 0.0]
    assert placed.model.key("bent").qvel.tolist() == [0.1, 0.0]
    again = mujoco.MjModel.from_xml_string(spec.to_xml())
    found = []
    for model in (placed.model, again):
        data = mujoco.MjData(model)
        data.qfrc_applied[1] = 30.0
        mujoco.mj_step(model, data, nstep=50)
        found.append(data.qpos[1])
    assert found[1] == pytest.approx(found[0], rel=1e-4)  # MJCF is written with six digits


def test_another_timestep_is_refused_until_the_damping_is_set() -> None:
    placed = put_drives(one_joint(), {"elbow": JOINT})
    model, data = placed.model, mujoco.MjData(placed.model)
    model.opt.timestep = 4e-3
    with pytest.raises(mujoco.FatalError, match="set_timestep"):
        mujoco.mj_step(model, data)
    model.opt.timestep = 2e-3
    set_timestep(placed, 4e-3)
    mujoco.mj_step(model, data)
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    with pytest.raises(mujoco.FatalError, match="implicit"):
        mujoco.mj_step(model, data)


def test_what_cannot_have_a_drive_is_reported(tmp_path: Path) -> None:
    cases = [
        (one_joint(), "knee", "elbow"),
        (one_joint(armature=0.0), "elbow", "armature"),
    ]
    spec = one_joint()
    spec.body("link").add_joint(name="second", axis=[1, 0, 0])
    cases.append((spec, "elbow", "2 joints"))
    spec = one_joint()
    spec.joint("elbow").type = mujoco.mjtJoint.mjJNT_SLIDE
    cases.append((spec, "elbow", "hinge"))
    spec = one_joint()
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    cases.append((spec, "elbow", "RK4"))
    for given, name, said in cases:
        with pytest.raises(InputError, match=said):
            put_drives(given, {name: JOINT})
    with pytest.raises(InputError, match="no_model"):
        put_drives(tmp_path / "no_model.xml", {"elbow": JOINT})


@pytest.mark.parametrize(
    ("key", "text"),
    [
        ("knots_torque_Nm", "1 2 x"),
        ("knots_torque_Nm", "1 2"),
        ("knots_angle_rad", ""),
        ("play_radius_Nm", "1 " * 80),
        ("effects", "no_such_effect 1 2"),
        ("lost_motion_joint", "nowhere"),
        ("ratio", ""),
    ],
)
def test_a_model_file_that_was_damaged_is_refused(key: str, text: str) -> None:
    spec = one_joint()
    put_drives(spec, {"elbow": JOINT})
    damaged = spec.copy()
    damaged.plugins[0].config = damaged.plugins[0].config | {key: text}
    with pytest.raises(ValueError, match="plugin"):
        damaged.compile()


def test_the_package_does_not_import_what_was_not_asked_for() -> None:
    code = (
        "import sys, lostmotion.cli, lostmotion; "
        "sys.exit(any(name.split('.')[0] in ('mujoco', 'fmpy') or 'simulators' in name "
        "for name in sys.modules))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
    assert load_plugin().is_file()


def test_the_arm_repeats_and_tracks_better_with_its_compensators() -> None:
    found = run_arm(2e-3)
    repeats = {variant: row["repeatability_um"] for variant, row in found.items()}
    tracks = {variant: row["tracking_rms_um"] for variant, row in found.items()}
    assert repeats["rigid"] < 0.5
    assert tracks["rigid"] < 50
    assert repeats["drives"] > 20
    assert repeats["compensated"] < 0.6 * repeats["drives"]
    assert tracks["drives"] > 500
    assert tracks["compensated"] < 0.25 * tracks["drives"]
