"""A seven-joint arm in MuJoCo: repeatability and tracking, rigid, with drives, compensated.

    python -m lostmotion.simulators.arm [--json FILE] [--picture FILE.svg] [--step SECONDS]

The arm (``arm.xml``) goes to one pose from several others, and follows a path on which every joint
reverses. Its motors follow their own encoders: feed-forward torque of the rigid arm, and a
proportional and derivative controller. The compensator is the library's float32 code, one instance
per joint, with the torque of the commanded motion.
"""

from __future__ import annotations

import argparse
import io
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.core import core
from lostmotion.drives import Drive, read_drive
from lostmotion.export import build, make_controller
from lostmotion.on_progress import OnProgress
from lostmotion.rms import rms_of
from lostmotion.shipped import find_inputs
from lostmotion.simulators.mujoco import SUFFIX, put_drives

HERE = Path(__file__).parent

JOINTS = tuple(f"joint{i + 1}" for i in range(7))

SHIPPED = ("drives/size_25.toml",) * 4 + ("joint/joint.toml",) * 3
"""Drive of each joint: two of the drives in the package."""

PROPORTIONAL_NM = np.array([9e3] * 4 + [2.5e3] * 3)
"""Position gains, N*m/rad: 20 Hz with the armatures of ``arm.xml``."""

DERIVATIVE_NM_S = np.array([1e2] * 4 + [3e1] * 3)

POSE = np.array([0.4, 0.7, -0.3, 0.9, 0.2, 0.8, 0.1])
"""Pose at which the repeatability is measured, rad."""

APPROACHES = 6
"""Number of starting poses around this pose; each joint approaches from one side or the other."""

REACH_RAD = 0.15
"""Distance of these from the pose, in each joint."""

MOVE_S, REST_S = 0.6, 0.4
"""Time of a motion, and time to settle."""

PATH_S = 4.0
"""Duration of the path."""

SIDES_SEED = 4
"""Random seed of the sides from which the pose is approached."""

VARIANTS = ("rigid", "drives", "compensated")


@dataclass(frozen=True)
class Motion:
    """A commanded motion of all joints, one row per step."""

    angle_rad: FloatArray
    velocity_rad_s: FloatArray
    acceleration_rad_s2: FloatArray


def minimum_jerk(start: FloatArray, end: FloatArray, step_s: float) -> Motion:
    """Move from rest to rest."""
    count = round(MOVE_S / step_s)
    t = np.arange(count)[:, None] / count
    way = end - start
    return Motion(
        start + way * t**3 * (10 - 15 * t + 6 * t**2),
        way * 30 * t**2 * (1 - t) ** 2 / MOVE_S,
        way * 60 * t * (1 - t) * (1 - 2 * t) / MOVE_S**2,
    )


def hold(at: FloatArray, duration_s: float, step_s: float) -> Motion:
    """Stand still."""
    rows = np.tile(at, (round(duration_s / step_s), 1))
    return Motion(rows, np.zeros_like(rows), np.zeros_like(rows))


def lissajous(step_s: float) -> Motion:
    """Path on which the joints swing at different rates, from rest to rest, each with reversals."""
    t = (np.arange(round(PATH_S / step_s)) * step_s)[:, None]
    cycles = np.array([2, 3, 2, 4, 3, 5, 2])
    size = 0.5 / cycles
    rate = 2 * np.pi * cycles / PATH_S
    # The square of a sine begins and ends at rest.
    return Motion(
        POSE + size * np.sin(rate * t / 2) ** 2,
        size * rate / 2 * np.sin(rate * t),
        size * rate**2 / 2 * np.cos(rate * t),
    )


def join(parts: Sequence[Motion]) -> Motion:
    """One motion after the other."""
    return Motion(
        np.concatenate([part.angle_rad for part in parts]),
        np.concatenate([part.velocity_rad_s for part in parts]),
        np.concatenate([part.acceleration_rad_s2 for part in parts]),
    )


def example_drives() -> list[Drive]:
    """Read the drives of the seven joints, with a typical kinematic error."""
    import tempfile

    added = (HERE / "kinematic_error.toml").read_text(encoding="utf-8")
    found = {}
    with tempfile.TemporaryDirectory(prefix="lostmotion-") as folder:
        for name in set(SHIPPED):
            file = Path(folder) / Path(name).name
            text = (find_inputs() / name).read_text(encoding="utf-8")
            file.write_text(f"{text}\n{added}", encoding="utf-8")
            found[name] = read_drive(file)
    return [found[name] for name in SHIPPED]


class Compensators:
    """The controller's compensator of each joint, in float32."""

    def __init__(self, drives: Sequence[Drive], torque_Nm: FloatArray, step_s: float) -> None:
        c = core(32)
        self._core = c
        self._ratio = [drive.ratio for drive in drives]
        self._parameters = [
            build(make_controller(drive, {"period": step_s}, profile="full"), c) for drive in drives
        ]
        self._instances = [c.ffi.new("lm_compensator *") for _ in drives]
        self._at = c.ffi.new("lm_conditions *")
        for instance, parameters, torque in zip(
            self._instances, self._parameters, torque_Nm, strict=True
        ):
            c.call(c.lib.lm_start_compensator, instance, parameters, torque)

    def _tell(self, joint: int, torque_Nm: float, angle_rad: float) -> Any:
        self._at.torque_Nm = torque_Nm
        self._at.input_angle_rad = np.remainder(self._ratio[joint] * angle_rad, 2 * np.pi)
        self._at.elapsed_s = 0.0
        return self._at

    def settle(self, torque_Nm: FloatArray, angle_rad: FloatArray) -> FloatArray:
        """Return the corrections of joints at rest."""
        lib = self._core.lib
        return np.array(
            [
                lib.lm_settle_compensator(
                    one, self._tell(i, torque_Nm[i], angle_rad[i])
                ).correction_rad
                for i, one in enumerate(self._instances)
            ]
        )

    def step(self, torque_Nm: FloatArray, angle_rad: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return corrections and their velocities."""
        lib = self._core.lib
        found = [
            lib.lm_step_compensator(one, self._tell(i, torque_Nm[i], angle_rad[i]))
            for i, one in enumerate(self._instances)
        ]
        return (
            np.array([now.correction_rad for now in found]),
            np.array([now.velocity_rad_s for now in found]),
        )


@dataclass(frozen=True)
class Walk:
    """Path of the tool, one row per step: actual and commanded position."""

    tool_m: FloatArray
    commanded_m: FloatArray


class Rigid:
    """The arm with rigid joints: feed-forward torque, and commanded tool position."""

    def __init__(self, mujoco: Any, model: Any) -> None:
        self._mujoco, self._model = mujoco, model
        self._data = mujoco.MjData(model)
        self._armature = np.array(model.dof_armature)

    def torques(self, motion: Motion, k: int) -> tuple[FloatArray, FloatArray]:
        """Torque of the motors, and external torque on the outputs, at a step of a motion."""
        data = self._data
        data.qpos[:], data.qvel[:] = motion.angle_rad[k], motion.velocity_rad_s[k]
        data.qacc[:] = motion.acceleration_rad_s2[k]
        self._mujoco.mj_inverse(self._model, data)
        motor = np.array(data.qfrc_inverse)
        link = motor + data.qfrc_passive - self._armature * motion.acceleration_rad_s2[k]
        return motor, -link

    def tool(self) -> FloatArray:
        """Commanded tool position at the last requested step."""
        return np.array(self._data.site("tool").xpos)


def walk(mujoco: Any, variant: str, drives: Sequence[Drive], motion: Motion, step_s: float) -> Walk:
    """Simulate a motion from rest."""

    def spec() -> Any:
        made = mujoco.MjSpec.from_file(str(HERE / "arm.xml"))
        made.option.timestep = step_s
        return made

    rigid = Rigid(mujoco, spec().compile())
    if variant == "rigid":
        model = spec().compile()
    else:
        model = put_drives(spec(), dict(zip(JOINTS, drives, strict=True))).model
    data = mujoco.MjData(model)
    place = np.array([model.joint(name).qposadr[0] for name in JOINTS])
    dof = np.array([model.joint(name).dofadr[0] for name in JOINTS])
    data.qpos[place] = motion.angle_rad[0]
    correction, velocity = np.zeros(7), np.zeros(7)
    compensators = None
    _, external = rigid.torques(motion, 0)
    if variant == "compensated":
        compensators = Compensators(drives, external, step_s)
        correction = compensators.settle(external, motion.angle_rad[0])
        data.qpos[place] += correction
    if variant != "rigid":
        lost = np.array([model.joint(name + SUFFIX).qposadr[0] for name in JOINTS])
        data.qpos[lost] = 0.0
    tool, commanded = [], []
    for k in range(motion.angle_rad.shape[0]):
        motor, external = rigid.torques(motion, k)
        commanded.append(rigid.tool())
        mujoco.mj_kinematics(model, data)
        tool.append(np.array(data.site("tool").xpos))
        if compensators is not None:
            correction, velocity = compensators.step(external, motion.angle_rad[k] + correction)
        data.ctrl[:] = (
            motor
            + PROPORTIONAL_NM * (motion.angle_rad[k] + correction - data.qpos[place])
            + DERIVATIVE_NM_S * (motion.velocity_rad_s[k] + velocity - data.qvel[dof])
        )
        mujoco.mj_step(model, data)
    return Walk(np.array(tool), np.array(commanded))


def approaches(step_s: float) -> tuple[Motion, list[int]]:
    """Approach the pose from several sides; also returns the steps at rest there."""
    sides = np.random.default_rng(SIDES_SEED).choice([-1.0, 1.0], size=(APPROACHES, 7))
    parts, rests, count = [hold(POSE, REST_S, step_s)], [], round(REST_S / step_s)
    for side in sides:
        away = POSE + REACH_RAD * side
        for part in (
            minimum_jerk(POSE, away, step_s),
            hold(away, REST_S, step_s),
            minimum_jerk(away, POSE, step_s),
            hold(POSE, REST_S, step_s),
        ):
            parts.append(part)
            count += part.angle_rad.shape[0]
        rests.append(count - 1)
    return join(parts), rests


def repeatability_m(attained_m: FloatArray) -> float:
    """Pose repeatability of ISO 9283: mean distance from the mean, and three times its spread."""
    distance = np.linalg.norm(attained_m - attained_m.mean(axis=0), axis=1)
    return float(distance.mean() + 3.0 * distance.std(ddof=1))


def run_arm(step_s: float = 1e-3, progress: OnProgress | None = None) -> dict[str, dict[str, Any]]:
    """Simulate the three variants.

    Parameters
    ----------
    step_s : float
        Timestep of the simulation and period of the controller.
    progress : callable, optional
        ``progress(done, of, step)``, see `lostmotion.on_progress`.

    Returns
    -------
    dict
        By variant: ``repeatability_um``, ``tracking_rms_um``, ``tracking_max_um``, and the data of
        the figure.

    Raises
    ------
    InputError
        When MuJoCo or a C compiler is missing.
    """
    from lostmotion.simulators.mujoco import import_mujoco

    mujoco = import_mujoco()
    drives = example_drives()
    there, rests = approaches(step_s)
    path = join([hold(POSE, REST_S, step_s), lissajous(step_s)])
    found = {}
    for number, variant in enumerate(VARIANTS):
        if progress is not None:
            progress(number, len(VARIANTS), variant)
        attained = walk(mujoco, variant, drives, there, step_s).tool_m[rests]
        done = walk(mujoco, variant, drives, path, step_s)
        error = np.linalg.norm(done.tool_m - done.commanded_m, axis=1)[round(REST_S / step_s) :]
        found[variant] = {
            "repeatability_um": 1e6 * repeatability_m(attained),
            "tracking_rms_um": 1e6 * rms_of(error),
            "tracking_max_um": 1e6 * float(error.max()),
            "error_um": 1e6 * error,
        }
    return found


def show_arm(found: dict[str, dict[str, Any]]) -> str:
    """Write the numbers as a table."""
    out = io.StringIO()
    print("joints        repeatability  tracking rms  tracking max", file=out)
    for variant, numbers in found.items():
        row = (numbers[key] for key in ("repeatability_um", "tracking_rms_um", "tracking_max_um"))
        text = "".join(f"{value:11.0f} um" for value in row)
        print(f"{variant:<12}{text}", file=out)
    return out.getvalue()


def run_example(words: Sequence[str] | None = None) -> int:
    """Command line of the example."""
    parser = argparse.ArgumentParser(prog="python -m lostmotion.simulators.arm")
    parser.add_argument("--step", type=float, default=1e-3, metavar="SECONDS")
    parser.add_argument("--json", metavar="FILE")
    parser.add_argument("--picture", metavar="FILE.html")
    arguments = parser.parse_args(words)
    found = run_arm(arguments.step)
    if arguments.json:
        numbers = {
            variant: {key: value for key, value in row.items() if key != "error_um"}
            for variant, row in found.items()
        }
        Path(arguments.json).write_text(json.dumps(numbers, indent=1) + "\n", encoding="utf-8")
    if arguments.picture:
        from lostmotion.simulators.arm_picture import write_arm_page

        drive = read_drive(find_inputs() / SHIPPED[0])
        command = f"{parser.prog} --picture {arguments.picture}"
        write_arm_page(arguments.picture, found, drive, PATH_S, command)
    sys.stdout.write(show_arm(found))
    return 0


if __name__ == "__main__":
    sys.exit(run_example())
