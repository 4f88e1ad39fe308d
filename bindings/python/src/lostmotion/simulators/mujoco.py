"""Drives in MuJoCo: lost motion, hysteresis and kinematic error between actuator and joint.

    spec = mujoco.MjSpec.from_file("arm.xml")
    placed = put_drives(spec, {"shoulder": "joint.toml"})
    data = mujoco.MjData(placed.model)

The named joint keeps its name, actuator and sensors: it is the input side, in output angles. A
second hinge on the same axis, ``shoulder_lost_motion``, follows it; its angle is the lost motion.
An engine plugin (``c/mujoco_plugin.c``) applies the drive's torque to it. The plugin is compiled
once against the headers of the installed MuJoCo, and kept in the user's cache.

Needs MuJoCo (``pip install lostmotion[mujoco]``) and a C compiler.
"""

from __future__ import annotations

import dataclasses
import hashlib
import os
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.core import REFERENCE_TEMPERATURE_C, core, library_effects
from lostmotion.drives import Drive, read_drive
from lostmotion.errors import InputError
from lostmotion.export import Controller, build, make_controller
from lostmotion.files import write_whole
from lostmotion.simulators.compiler import (
    FLAGS,
    compile_shared,
    find_compiler,
    read_source,
    shared_suffix,
)

PLUGIN = "lostmotion.drive"
"""Name of the engine plugin."""

SUFFIX = "_lost_motion"
"""End of the name of the second hinge."""

TORQUE_LIMIT_NM = float(core().lib.LM_TORQUE_LIMIT_MAX_NM)
"""Torque limit in a simulation: a joint may be overloaded; its stiffness continues."""

MARGIN = 1.05
"""Margin on the greatest stiffness if effects change it, because it is searched at sixteen input
angles. Their highest harmonic, 4 per turn, is within 3 % of its extreme at one of them (cosine of
1/64 of a turn times 4, 0.92 of the ripple, which is itself a few per cent)."""

INPUT_ANGLES = 16
"""Number of input angles over one turn at which the dependence on the angle is examined."""

TORQUES = 41
"""Number of torques between minus and plus the rated torque at which it is examined."""


@dataclass(frozen=True)
class PlacedDrive:
    """One drive in a model.

    Attributes
    ----------
    joint, lost_motion_joint : str
        Names of the two hinges.
    stiffness_max_Nm_per_rad : float
        The greatest tangent stiffness, right after a reversal.
    damping_Nm_s : float
        Damping of the second hinge: half the step times that stiffness, for stability. It is not a
        property of the drive and decreases with the step.
    effects : tuple of str
        Effects of the drive file that are in the model.
    set_aside : dict
        Effects that are not in the model, with reasons.
    """

    joint: str
    lost_motion_joint: str
    stiffness_max_Nm_per_rad: float
    damping_Nm_s: float
    effects: tuple[str, ...]
    set_aside: dict[str, str]


@dataclass(frozen=True)
class Placed:
    """A compiled model with its drives."""

    model: Any
    drives: tuple[PlacedDrive, ...]


def import_mujoco() -> Any:
    """Import MuJoCo.

    Raises
    ------
    InputError
        When it is not installed.
    """
    try:
        import mujoco
    except ImportError:
        expected = "MuJoCo: pip install 'lostmotion[mujoco]'"
        raise InputError("mujoco", "", "no such package", expected) from None
    return mujoco


@cache
def load_plugin() -> Path:
    """Compile the plugin unless it is cached, load it into MuJoCo and return its path.

    MuJoCo's own viewer, ``simulate``, loads the same file from its folder of plugins.

    Raises
    ------
    InputError
        When MuJoCo or a C compiler is missing.
    """
    mujoco = import_mujoco()
    root = Path(mujoco.__file__).parent
    library = next(
        (file for pattern in ("libmujoco.so*", "libmujoco*.dylib") for file in root.glob(pattern)),
        None,
    )
    if library is None:
        raise InputError(root, "libmujoco", "no such file", "MuJoCo as its own wheel installs it")
    texts = {
        "library_config.h": "#define LM_REAL_BITS 64\n#define LM_PROFILE LM_PROFILE_FULL\n",
        "runtime.c": '#include "library_config.h"\n\n#include "lostmotion.c"\n',
        "plugin.c": '#include "library_config.h"\n\n#include "mujoco_plugin.c"\n',
    }
    for name in ("lostmotion.c", "lostmotion.h", "mujoco_plugin.c"):
        texts[name] = read_source(name)
    made_of = repr((mujoco.__version__, str(library), FLAGS, sys.platform, sorted(texts.items())))
    name = f"lostmotion_{hashlib.sha256(made_of.encode()).hexdigest()[:16]}{shared_suffix()}"
    place = cache_folder() / name
    if not place.is_file():
        compiler = find_compiler()
        if compiler is None:
            raise InputError("CC", "", "no C compiler", "a C compiler: the plugin is compiled once")
        options = [f"-I{root / 'include'}"]
        linked = [str(library), f"-Wl,-rpath,{root}"]
        content = compile_shared(compiler, texts, ("runtime.c", "plugin.c"), options, linked)
        try:
            place.parent.mkdir(parents=True, exist_ok=True)
            write_whole(place, content)
        except (OSError, InputError):
            place = Path(tempfile.mkdtemp(prefix="lostmotion-")) / name
            write_whole(place, content)
    mujoco.mj_loadPluginLibrary(str(place))
    return place


def cache_folder() -> Path:
    """Folder of the user in which the plugin is cached (XDG_CACHE_HOME)."""
    stated = os.environ.get("XDG_CACHE_HOME", "")
    try:
        return (Path(stated) if stated else Path.home() / ".cache") / "lostmotion"
    except RuntimeError:  # no home folder
        return Path(tempfile.mkdtemp(prefix="lostmotion-"))


def put_drives(
    spec: Any,
    drives: Mapping[str, Drive | str | Path],
    *,
    temperature_C: float = REFERENCE_TEMPERATURE_C,
    cycles: float = 0.0,
) -> Placed:
    """Insert drives between actuators and joints of a model, and compile it.

    Parameters
    ----------
    spec : mujoco.MjSpec, str or Path
        The model, or an MJCF file. The spec is changed.
    drives : mapping
        From the name of a hinge to a drive or a drive file. The hinge must be alone in its body and
        have an armature: the inertia of rotor and wave generator times the ratio squared.
    temperature_C, cycles : float
        Conditions for the effects of the drives.

    Returns
    -------
    Placed
        The compiled model; positions and velocities have one more entry per drive.

    Raises
    ------
    InputError
        If a joint does not exist or cannot have a drive, or MuJoCo or a compiler is missing.
    """
    mujoco = import_mujoco()
    load_plugin()
    if isinstance(spec, (str, Path)):
        try:
            spec = mujoco.MjSpec.from_file(str(spec))
        except (ValueError, OSError) as error:
            raise InputError(spec, "", str(error).splitlines()[0], "an MJCF model") from None
    step_s = float(spec.option.timestep)
    _check_integrator(mujoco, spec)
    # Everything is read and checked before the spec is changed.
    wanted = []
    for name, given in drives.items():
        drive = given if isinstance(given, Drive) else read_drive(given)
        controller, aside = simulated_parts(make_controller(drive, profile="full"))
        bounds = find_bounds(controller, drive, temperature_C, cycles)
        conditions = {
            "ratio": repr(drive.ratio),
            "temperature_C": repr(temperature_C),
            "cycles": repr(cycles),
            "stiffness_max_Nm_per_rad": repr(bounds.stiffness_Nm_per_rad),
        }
        configuration = conditions | _configuration(controller)
        wanted.append((_hinge(mujoco, spec, name), controller, aside, bounds, configuration))
    _widen_keys(spec, list(drives))
    placed = []
    for joint, controller, aside, bounds, configuration in wanted:
        lost = _put(mujoco, spec, joint, bounds, step_s, configuration)
        effects = tuple(effect for effect, _ in controller.effects)
        stiffness = bounds.stiffness_Nm_per_rad
        placed.append(
            PlacedDrive(joint.name, lost, stiffness, bounds.damping(step_s), effects, aside)
        )
    try:
        return Placed(spec.compile(), tuple(placed))
    except ValueError as error:
        raise InputError("model", "", str(error).splitlines()[0], "a model that compiles") from None


LOCKED_KG_M2 = 1e9
"""Armature of an input that is locked."""

LINK = """<mujoco>
<option timestep="{step_s}" gravity="0 0 0" integrator="implicitfast"/>
<worldbody><body name="link">
  <joint name="input" axis="0 0 1" armature="{armature}"/>
  <geom type="box" size="0.2 0.05 0.05" mass="1"/>
</body></worldbody></mujoco>"""
"""A link of 0.014 kg m^2 on a locked input."""


def slow_reversal(
    drive: Drive | str | Path,
    torque_Nm: float,
    *,
    step_s: float = 2e-3,
    period_s: float = 20.0,
) -> tuple[FloatArray, FloatArray]:
    """Measure the lost motion of a drive with locked input in the simulator.

    Parameters
    ----------
    drive : Drive, str or Path
    torque_Nm : float
        Amplitude of the external torque on the output, a sine.
    step_s, period_s : float
        Of the simulation, and of the sine.

    Returns
    -------
    torque_Nm, lost_motion_rad : ndarray
        Over the second period.
    """
    mujoco = import_mujoco()
    link = mujoco.MjSpec.from_string(LINK.format(step_s=step_s, armature=LOCKED_KG_M2))
    model = put_drives(link, {"input": drive}).model
    data = mujoco.MjData(model)
    count = round(period_s / step_s)
    torque = torque_Nm * np.sin(2 * np.pi * np.arange(2 * count) / count)
    lost = np.empty(2 * count)
    for k in range(2 * count):
        data.qfrc_applied[:] = torque[k]
        mujoco.mj_step(model, data)
        lost[k] = data.qpos[1]
    return torque[count:], lost[count:]


def set_timestep(placed: Placed, step_s: float) -> None:
    """Set the timestep of a compiled model and the corresponding damping of its drives."""
    model = placed.model
    share = step_s / float(model.opt.timestep)
    for one in placed.drives:
        model.dof_damping[model.joint(one.lost_motion_joint).dofadr[0]] *= share
    model.opt.timestep = step_s


def _check_integrator(mujoco: Any, spec: Any) -> None:
    if spec.option.integrator == mujoco.mjtIntegrator.mjINT_RK4:
        expected = "Euler, implicit or implicitfast: their joint damping is that of the step's end"
        raise InputError("model", "option.integrator", "RK4", expected)


def _hinge(mujoco: Any, spec: Any, name: str) -> Any:
    joint = spec.joint(name)
    if joint is None:
        known = ", ".join(j.name for j in spec.joints if j.name) or "none"
        raise InputError("model", "joint", f"'{name}'", f"a joint of the model: {known}")
    if joint.type != mujoco.mjtJoint.mjJNT_HINGE:
        raise InputError("model", f"joint.{name}", "another kind of joint", "a hinge")
    if len(joint.parent.joints) != 1:
        count = len(joint.parent.joints)
        raise InputError("model", f"joint.{name}", f"{count} joints in its body", "one")
    if not joint.armature > 0:
        expected = "the inertia of rotor and wave generator times the ratio squared, kg m^2"
        raise InputError("model", f"joint.{name}.armature", f"{joint.armature:g}", expected)
    return joint


def _widen_keys(spec: Any, names: Sequence[str]) -> None:
    """Add a zero for each lost motion to keyframes."""
    if not len(spec.keys):
        return
    model = spec.copy().compile()
    for key in spec.keys:
        for values, address in (("qpos", model.jnt_qposadr), ("qvel", model.jnt_dofadr)):
            old = list(getattr(key, values))
            if old:
                after = sorted(int(address[model.joint(name).id]) + 1 for name in names)
                setattr(key, values, np.insert(np.array(old), after, 0.0).tolist())


def simulated_parts(controller: Controller) -> tuple[Controller, dict[str, str]]:
    """Remove from a controller what is not part of the drive in a simulator.

    Returns
    -------
    controller : Controller
        With the effects of the drive itself, and a torque limit beyond any simulation.
    set_aside : dict
        The other effects, with reasons.
    """
    c = core(64)
    known = library_effects(c)
    lib = c.lib
    kept, aside = [], {}
    others = (
        lib.LM_NEEDS_OUTPUT_ANGLE
        | lib.LM_NEEDS_OUTPUT_ACCELERATION
        | lib.LM_NEEDS_TILT_MOMENT
        | lib.LM_NEEDS_AXIAL_FORCE
        | lib.LM_NEEDS_INPUT_VELOCITY
    )
    for name, values in controller.effects:
        effect = known.get(name)
        if effect is None:
            aside[name] = "a user effect"
        elif effect.kind == lib.LM_EFFECT_TORQUE:
            aside[name] = "acts on the measured torque, not on the drive"
        elif effect.covariates & others:
            aside[name] = "depends on a quantity that the joint does not provide"
        else:
            kept.append((name, values))
    return (
        dataclasses.replace(controller, effects=kept, own={}, torque_limit_Nm=TORQUE_LIMIT_NM),
        aside,
    )


def _put(
    mujoco: Any,
    spec: Any,
    joint: Any,
    bounds: Bounds,
    step_s: float,
    configuration: Mapping[str, str],
) -> str:
    """Add the second hinge after a joint, and the plugin that acts on both; returns its name."""
    name = f"{joint.name}{SUFFIX}"
    body = joint.parent
    plugin = spec.add_plugin(name=f"{joint.name}_drive", plugin_name=PLUGIN, active=True)
    spec.activate_plugin(PLUGIN)
    plugin.config = {
        "input_joint": joint.name,
        "lost_motion_joint": name,
        **configuration,
    }
    body.plugin = plugin
    added = body.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE)
    added.axis, added.pos = joint.axis, joint.pos
    added.armature = added.frictionloss = 0.0
    added.limited = mujoco.mjtLimited.mjLIMITED_FALSE
    _set_first(added, "stiffness", 0.0)
    _set_first(added, "damping", bounds.damping(step_s))
    if bounds.turning > 0:
        _set_first(joint, "damping", _first(joint.damping) + bounds.input_damping(step_s))
    return name


def _first(value: Any) -> float:
    return float(np.atleast_1d(value)[0])


def _set_first(owner: Any, name: str, value: float) -> None:
    """Set a coefficient, which is the first of a polynomial in newer versions of MuJoCo."""
    old = np.atleast_1d(getattr(owner, name))
    if np.ndim(getattr(owner, name)) == 0:
        setattr(owner, name, value)
    else:
        setattr(owner, name, [value, *[0.0] * (old.size - 1)])


def _configuration(controller: Controller) -> dict[str, str]:
    """Write the plugin configuration of a drive."""

    def listed(values: Sequence[float] | FloatArray) -> str:
        return " ".join(repr(float(value)) for value in values)

    plays = controller.plays
    return {
        "torque_limit_Nm": repr(controller.torque_limit_Nm),
        "knots_torque_Nm": listed(controller.torque_Nm),
        "knots_angle_rad": listed(controller.angle_rad),
        "play_radius_Nm": listed([play.radius_Nm for play in plays]),
        "play_widening": listed([play.widening for play in plays]),
        "play_weight": listed([play.weight for play in plays]),
        "outside": str(len(controller.outside)),
        "envelope_Nm": repr(controller.envelope.most_Nm),
        "knee_Nm": repr(controller.envelope.knee_Nm),
        "effects": "; ".join(f"{name} {listed(values)}" for name, values in controller.effects),
    }


@dataclass(frozen=True)
class Bounds:
    """Bounds for stability.

    Attributes
    ----------
    stiffness_Nm_per_rad : float
        The greatest tangent stiffness.
    turning : float
        The greatest change of the lost motion over that of the input, in angles of the output.
    """

    stiffness_Nm_per_rad: float
    turning: float

    def damping(self, step_s: float) -> float:
        """Damping of the lost motion with which no step creates energy (c/mujoco_plugin.c).

        The energy of a step with both motions is K (h v' - t h u')^2 / 2, at most K (h v')^2 + K (t
        h u')^2, where u' is the velocity of the input and t is `turning`.
        """
        return step_s * self.stiffness_Nm_per_rad * (1.0 if self.turning > 0 else 0.5)

    def input_damping(self, step_s: float) -> float:
        """Corresponding damping of the input."""
        return step_s * self.stiffness_Nm_per_rad * self.turning**2


def find_bounds(
    controller: Controller, drive: Drive, temperature_C: float, cycles: float
) -> Bounds:
    """Find the greatest stiffness, and how the lost motion depends on the input angle.

    Raises
    ------
    InputError
        If the drive has no compliance after a reversal.
    """
    c = core(64)
    parameters = build(controller, c)
    bank = parameters.plays
    rise = 1.0 + bank.envelope_Nm / bank.knee_Nm
    least = float(c.lib.lm_find_least_slope(c.ffi.addressof(parameters.curve)))
    compliance = (1.0 - rise * bank.inside_share) * least - rise * bank.outside_rad_per_Nm
    if not compliance > 1e-3 * least:
        found = f"{compliance:.3g} rad/Nm after a reversal"
        raise InputError(drive.file, "friction", found, "a positive compliance: a narrower loop")
    stiffness = 1.0 / float(compliance)
    if not controller.effects:
        return Bounds(stiffness, 0.0)
    moved, turning = _look_around(c, parameters, drive, temperature_C, cycles)
    return Bounds(max(stiffness, MARGIN / moved), turning)


def _look_around(
    c: Any, parameters: Any, drive: Drive, temperature_C: float, cycles: float
) -> tuple[float, float]:
    """Least compliance over a loop and a turn, and greatest change with the input."""
    at = c.ffi.new("lm_conditions *")
    at.temperature_C, at.cycles = temperature_C, cycles
    memory, trial = c.ffi.new("lm_memory *"), c.ffi.new("lm_memory *")
    step_Nm, step_rad = 1e-4 * drive.rated_torque_Nm, 1e-4
    angles = 2 * np.pi * np.arange(INPUT_ANGLES) / INPUT_ANGLES
    up = np.linspace(-drive.rated_torque_Nm, drive.rated_torque_Nm, TORQUES)
    least, turning = np.inf, 0.0

    def lost(torque_Nm: float, angle_rad: float) -> float:
        at.torque_Nm, at.input_angle_rad = torque_Nm, angle_rad
        return float(c.lib.lm_evaluate_model(parameters, memory, trial, at))

    for angle in angles:
        c.lib.lm_start_model(memory, 0.0)
        for torque in (*up, *up[::-1]):
            at.torque_Nm, at.input_angle_rad = torque, angle
            here = float(c.lib.lm_step_model(parameters, memory, at))
            for sign in (1.0, -1.0):
                rise = (lost(torque + sign * step_Nm, angle) - here) / (sign * step_Nm)
                least = min(least, rise)
            turned = (lost(torque, angle + step_rad) - here) / step_rad * drive.ratio
            turning = max(turning, abs(turned))
    if not least > 0:
        found = "a lost motion that falls with the torque"
        raise InputError(drive.file, "effect", found, "a rising one: smaller effects")
    return least, turning
