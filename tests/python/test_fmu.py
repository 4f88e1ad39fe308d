"""FMUs of every shipped drive, run by FMPy: the model in float64, the compensator bit for bit."""

from __future__ import annotations

import dataclasses
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from conftest import DATA, FITTED, needs_compiler
from lostmotion.core import core
from lostmotion.drives import read_drive
from lostmotion.effects.loading import load
from lostmotion.errors import InputError
from lostmotion.export import Controller, build, make_controller
from lostmotion.recordings import read_campaign
from lostmotion.replay import replay
from lostmotion.simulators.description import Version
from lostmotion.simulators.fmu import export_fmu, make_sources
from lostmotion.simulators.variables import Kind, list_variables

fmpy = pytest.importorskip("fmpy", reason="no FMPy: pip install 'lostmotion[test]'")
fmi2 = pytest.importorskip("fmpy.fmi2", reason="no FMPy")
fmi3 = pytest.importorskip("fmpy.fmi3", reason="no FMPy")
build_platform_binary = pytest.importorskip(
    "fmpy.build", reason="an FMPy that compiles no sources"
).build_platform_binary
validate_fmu = pytest.importorskip("fmpy.validation", reason="no FMPy").validate_fmu

pytestmark = needs_compiler

DRIVES = sorted(
    file
    for folder in ("drives", "joint", "cycloidal_locked_output", "friction_damper")
    for file in (DATA / folder).glob("*.toml")
)

each_drive = pytest.mark.parametrize(
    ("drive_file", "version"),
    [pytest.param(file, 2 + i % 2, id=f"{file.stem}-{2 + i % 2}") for i, file in enumerate(DRIVES)],
)
"""Each drive by one version of FMI: the code of a version is the same for all drives."""

EFFECTS = """
[drive]
name = "joint with effects"
ratio = 100
rated_torque_Nm = 67
[catalogue]
T1_Nm = 14
T2_Nm = 48
K1_Nm_per_rad = 31e3
K2_Nm_per_rad = 50e3
K3_Nm_per_rad = 57e3
hysteresis_arcmin = 1
[[effect]]
name = "creep"
share = 0.01
onset_s = 0.01
[[effect]]
name = "thermal_friction"
rate_per_K = 0.02
[[effect]]
name = "output_eccentricity"
cosine_rad = 4e-5
sine_rad = 2e-5
[[effect]]
name = "kinematic_error"
cosine_2_rad = 1e-4
sine_2_rad = 3e-5
cosine_4_rad = 1e-5
sine_4_rad = 0
"""
"""One effect with a memory, one that widens the friction, one of each angle."""

PERIOD_S = 1e-3
SAMPLES = 400
INTEGERS = ("status", "mode")

Floats = npt.NDArray[np.float64]


class Running:
    """An instance of an FMU, by either version of FMI."""

    def __init__(self, file: Path, folder: Path, **start: float) -> None:
        self.description = fmpy.read_model_description(str(file))
        unpacked = folder / file.stem
        if not unpacked.exists():
            fmpy.extract(str(file), unzipdir=str(unpacked))
        self.old = self.description.fmiVersion.startswith("2")
        made = fmi2.FMU2Slave if self.old else fmi3.FMU3Slave
        self.fmu = made(
            guid=self.description.guid,
            unzipDirectory=str(unpacked),
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName="drive",
        )
        self.reference = {v.name: v.valueReference for v in self.description.modelVariables}
        self.fmu.instantiate()
        if self.old:
            self.fmu.setupExperiment(startTime=0.0)
        for name, value in start.items():
            self.set(name, value)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()
        self.time_s = 0.0

    def set(self, name: str, value: float) -> None:
        if name in INTEGERS:
            (self.fmu.setInteger if self.old else self.fmu.setUInt32)(
                [self.reference[name]], [int(value)]
            )
        else:
            (self.fmu.setReal if self.old else self.fmu.setFloat64)([self.reference[name]], [value])

    def get(self, *names: str) -> list[float]:
        read = self.fmu.getReal if self.old else self.fmu.getFloat64
        whole = self.fmu.getInteger if self.old else self.fmu.getUInt32
        return [(whole if name in INTEGERS else read)([self.reference[name]])[0] for name in names]

    def step(self, step_s: float = PERIOD_S, **inputs: float) -> None:
        for name, value in inputs.items():
            self.set(name, value)
        self.fmu.doStep(self.time_s, step_s)
        self.time_s += step_s

    def save(self) -> Any:
        return self.fmu.getFMUstate() if self.old else self.fmu.getFMUState()

    def restore(self, state: Any) -> None:
        (self.fmu.setFMUstate if self.old else self.fmu.setFMUState)(state)

    def forget(self, state: Any) -> None:
        (self.fmu.freeFMUstate if self.old else self.fmu.freeFMUState)(state)

    def pickled(self, state: Any) -> bytes:
        store = self.fmu.serializeFMUstate if self.old else self.fmu.serializeFMUState
        return bytes(store(state))

    def unpickled(self, stored: bytes) -> Any:
        load = self.fmu.deSerializeFMUstate if self.old else self.fmu.deserializeFMUState
        return load(stored)

    def derivative(self, unknown: str, known: str, seed: float = 1.0) -> float:
        pair = ([self.reference[unknown]], [self.reference[known]], [seed])
        return float(self.fmu.getDirectionalDerivative(*pair)[0])

    def close(self) -> None:
        self.fmu.terminate()
        self.fmu.freeInstance()


Written = tuple[Path, Controller, float]


def export_of(drive_file: Path, folder: Path, kind: Kind, version: Version) -> Written:
    """Export an FMU and state what it was made of."""
    drive = read_drive(drive_file)
    controller = make_controller(drive, profile="full")
    file = folder / f"{drive_file.stem}_{kind}_{version}.fmu"
    export_fmu(controller, file, kind=kind, version=version, ratio=drive.ratio, title=drive.name)
    return file, controller, drive.ratio


MADE: dict[tuple[str, Kind, Version], Written] = {}
"""FMUs that a test has already made: the same drive gives the same bytes."""


@pytest.fixture(scope="module", autouse=True)
def kept_folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Folder of the FMUs for the duration of the tests of this file."""
    MADE.clear()
    KEPT[:] = [tmp_path_factory.mktemp("fmus")]
    yield KEPT[0]
    MADE.clear()


KEPT: list[Path] = []


def write(drive_file: Path, kind: Kind, version: Version) -> Written:
    """Export an FMU once."""
    key = (drive_file.read_text(encoding="utf-8"), kind, version)
    if key not in MADE:
        folder = KEPT[0] / str(len(MADE))
        folder.mkdir()
        MADE[key] = export_of(drive_file, folder, kind, version)
    return MADE[key]


@pytest.fixture
def with_effects(tmp_path: Path) -> Path:
    file = tmp_path / "with_effects.toml"
    file.write_text(EFFECTS, encoding="utf-8")
    return file


def inputs_of(limit_Nm: float) -> dict[str, Floats]:
    """Nested loops, a turning input, a drive that warms up."""
    time = np.arange(SAMPLES) * PERIOD_S
    return {
        "torque": 0.9 * limit_Nm * np.sin(40.0 * time) * np.cos(9.0 * time),
        "input_angle": 3.0 + 20.0 * time,
        "input_velocity": np.full(SAMPLES, 20.0),
        "temperature": 20.0 + 30.0 * time,
        "cycles": 1e5 * time,
    }


FIELDS = {
    "torque": "torque_Nm",
    "input_angle": "input_angle_rad",
    "output_angle": "output_angle_rad",
    "input_velocity": "input_velocity_rad_s",
    "temperature": "temperature_C",
    "cycles": "cycles",
}


def run_model(controller: Controller, columns: dict[str, Floats], start: float = 0.0) -> Floats:
    """Lost motion by `lm_run_model` in float64, from a drive that was never loaded."""
    c = core(64)
    parameters = build(controller, c)
    memory = c.ffi.new("lm_memory *")
    c.lib.lm_start_model(memory, start)
    recording = c.ffi.new("lm_recording *")
    recording.count = SAMPLES
    arrays = {FIELDS[name]: c.array(column) for name, column in columns.items()}
    arrays["elapsed_s"] = c.array(np.full(SAMPLES, PERIOD_S))
    pointers = {name: c.pointer(array) for name, array in arrays.items()}
    for name, pointer in pointers.items():
        setattr(recording, name, pointer)
    angle = c.zeros(SAMPLES)
    c.lib.lm_run_model(parameters, memory, recording, c.pointer(angle, write=True))
    return np.asarray(angle)


def feed(fmu: Running, columns: dict[str, Floats], *outputs: str) -> Floats:
    """Step through columns and collect outputs, one row per sample."""
    rows = []
    for k in range(SAMPLES):
        fmu.step(**{name: float(column[k]) for name, column in columns.items()})
        rows.append(fmu.get(*outputs))
    return np.array(rows)


@each_drive
def test_the_fmus_of_a_shipped_drive(drive_file: Path, version: Version, tmp_path: Path) -> None:
    file, controller, ratio = write(drive_file, "torque", version)
    assert validate_fmu(str(file)) == []
    columns = inputs_of(controller.torque_limit_Nm)
    forward = Running(file, tmp_path)
    lost, angle, stiffness, status = feed(
        forward, columns, "lost_motion", "output_angle", "stiffness", "status"
    ).T
    forward.close()
    known = run_model(controller, columns)
    np.testing.assert_allclose(lost, known, rtol=0, atol=1e-12)
    np.testing.assert_allclose(angle, columns["input_angle"] / ratio + known, rtol=0, atol=1e-12)
    assert np.all(stiffness > 0)
    assert not np.any(status)

    inverse_file, _, _ = write(drive_file, "angles", version)
    assert validate_fmu(str(inverse_file)) == []
    inverse = Running(inverse_file, tmp_path)
    angles = {name: columns[name] for name in columns if name != "torque"}
    torque, again = feed(inverse, angles | {"output_angle": angle}, "torque", "lost_motion").T
    inverse.close()
    # lm_invert_model's bound: if the drive is stiff, a rounding of the angle is a large torque
    np.testing.assert_allclose(again, known, rtol=0, atol=1e-12)
    np.testing.assert_allclose(
        torque, columns["torque"], rtol=0, atol=1e-9 * controller.torque_limit_Nm
    )


@each_drive
def test_without_friction_an_fmu_gives_what_predict_does(
    drive_file: Path, version: Version, tmp_path: Path
) -> None:
    from lostmotion.predict import predict
    from lostmotion.units import ARCMIN

    drive = read_drive(drive_file)
    file, controller, _ = write(drive_file, "torque", version)
    torque = controller.torque_Nm
    predicted = np.array(predict(drive, torque)["total_arcmin"]) * ARCMIN
    fmu = Running(file, tmp_path)
    for i in range(len(controller.plays)):
        fmu.set(f"friction.weight[{i + 1}]", 0.0)
    found = []
    for value in torque:
        fmu.step(torque=float(value))
        found += fmu.get("lost_motion")
    fmu.close()
    np.testing.assert_allclose(found, predicted, rtol=0, atol=1e-12)


@each_drive
def test_the_compensator_has_the_bits_of_replay(
    drive_file: Path, version: Version, tmp_path: Path
) -> None:
    file, controller, ratio = write(drive_file, "compensator", version)
    assert validate_fmu(str(file)) == []
    columns = inputs_of(controller.torque_limit_Nm)
    log = tmp_path / "log.csv"
    table = {
        "time_s": np.arange(SAMPLES) * PERIOD_S,
        "torque_Nm": columns["torque"],
        "input_angle_rad": columns["input_angle"],
        "output_angle_rad": columns["input_angle"] / ratio + columns["torque"] / 3e4,
        "temperature_C": columns["temperature"],
        "cycles": columns["cycles"],
    }
    np.savetxt(
        log,
        np.column_stack(list(table.values())),
        fmt="%.17g",
        delimiter=",",
        header=",".join(table),
        comments="",
    )
    tape = replay(build(controller), read_campaign([log], ratio=ratio)).tapes[0]
    told = tape.told
    fmu = Running(file, tmp_path, torque=float(told["torque_Nm"][0]))
    names = {field: name for name, field in FIELDS.items()} | {
        "output_acceleration_rad_s2": "output_acceleration"
    }
    for k in range(SAMPLES):
        inputs = {names[field]: float(told[field][k]) for field in told if field != "elapsed_s"}
        elapsed = float(told["elapsed_s"][k]) or controller.limits.period_s
        fmu.step(elapsed, **inputs)
        found = fmu.get(
            "correction", "correction_velocity", "correction_acceleration", "lost_motion"
        )
        assert np.array(found, dtype=np.float32).tobytes() == tape.values[k].tobytes()
        assert fmu.get("status") == [tape.status[k]]
    fmu.close()
    assert np.ptp(tape.values[:, 0]) > 0


@pytest.mark.parametrize("version", [2, 3])
def test_effects_with_memory_and_of_the_output_angle(
    with_effects: Path, version: Version, tmp_path: Path
) -> None:
    file, controller, ratio = write(with_effects, "torque", version)
    columns = inputs_of(67.0)
    start = {name: float(column[0]) for name, column in columns.items()}
    fmu = Running(file, tmp_path, **start)
    start["output_angle"] = fmu.get("output_angle")[0]
    del start["torque"]
    lost, angle = feed(fmu, columns, "lost_motion", "output_angle").T
    fmu.close()
    known = run_model(controller, columns | {"output_angle": angle})
    np.testing.assert_allclose(lost, known, rtol=0, atol=1e-12)
    np.testing.assert_allclose(angle, columns["input_angle"] / ratio + lost, rtol=0, atol=1e-15)

    inverse = Running(write(with_effects, "angles", version)[0], tmp_path, **start)
    angles = {name: columns[name] for name in columns if name != "torque"}
    (torque,) = feed(inverse, angles | {"output_angle": angle}, "torque").T
    inverse.close()
    np.testing.assert_allclose(torque, columns["torque"], rtol=0, atol=1e-6)


def test_a_fitted_drive_is_written_and_read_unchanged(tmp_path: Path) -> None:
    drive_file = tmp_path / "fitted.toml"
    drive_file.write_text(FITTED, encoding="utf-8")
    file, controller, ratio = write(drive_file, "torque", 3)
    assert ratio == -101
    assert controller.envelope.most_Nm == 3.0
    columns = inputs_of(60.0)
    start = {name: float(column[0]) for name, column in columns.items()}
    fmu = Running(file, tmp_path, **start)
    lost, angle = feed(fmu, columns, "lost_motion", "output_angle").T
    fmu.close()
    known = run_model(controller, columns)
    np.testing.assert_allclose(lost, known, rtol=0, atol=1e-12)
    np.testing.assert_allclose(angle, columns["input_angle"] / ratio + known, rtol=0, atol=1e-12)
    del start["torque"]
    angles = {name: columns[name] for name in columns if name != "torque"} | {"output_angle": angle}
    inverse_file = write(drive_file, "angles", 3)[0]
    inverse = Running(inverse_file, tmp_path, **start, output_angle=start["input_angle"] / ratio)
    (torque,) = feed(inverse, angles, "torque").T
    inverse.close()
    np.testing.assert_allclose(torque, columns["torque"], rtol=0, atol=1e-7)


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("kind", ["torque", "angles", "compensator"])
def test_a_restored_state_continues_as_the_original(
    with_effects: Path, kind: Kind, version: Version, tmp_path: Path
) -> None:
    file, _, ratio = write(with_effects, kind, version)
    columns = inputs_of(67.0)
    if kind != "torque":
        columns["output_angle"] = columns["input_angle"] / ratio + columns["torque"] / 4e4
    if kind == "angles":
        del columns["torque"]
    outputs = ("lost_motion", "status", "correction" if kind == "compensator" else "stiffness")
    half = SAMPLES // 2
    fmu = Running(file, tmp_path)
    first = {name: column[:half] for name, column in columns.items()}

    def go(instance: Running, part: dict[str, Floats]) -> list[list[float]]:
        rows = []
        for k in range(half):
            instance.step(**{name: float(column[k]) for name, column in part.items()})
            rows.append(instance.get(*outputs))
        return rows

    go(fmu, first)
    if kind != "compensator":
        fmu.set("torque_limit", 120.0)  # a parameter that was set, but is not yet active
    state = fmu.save()
    stored = fmu.pickled(state)
    second = {name: column[half:] for name, column in columns.items()}
    known = go(fmu, second)
    assert go(fmu, second) != known  # the history matters
    fmu.restore(state)
    assert go(fmu, second) == known
    fmu.forget(state)
    other = Running(file, tmp_path)
    go(other, second)
    copy = other.unpickled(stored)
    other.restore(copy)
    other.forget(copy)
    assert go(other, second) == known
    damaged = bytearray(stored)
    damaged[len(damaged) // 2] ^= 1
    for wrong in (bytes(damaged), stored[:-1], b""):
        with pytest.raises(Exception, match=r"(?i)error|failed|status"):
            other.unpickled(wrong)
    fmu.close()
    other.close()


@pytest.mark.parametrize("version", [2, 3])
def test_directional_derivatives_are_those_of_the_next_step(
    with_effects: Path, version: Version, tmp_path: Path
) -> None:
    file, _, ratio = write(with_effects, "torque", version)
    fmu = Running(file, tmp_path)
    held = {"input_angle": 0.7, "temperature": 26.0}
    for torque in (30.0, -20.0, 11.0):
        fmu.step(torque=torque, **held)
    state = fmu.save()

    def stepped(**inputs: float) -> float:
        fmu.restore(state)
        fmu.step(**({"torque": 11.0} | held | inputs))
        return fmu.get("lost_motion")[0]

    at = stepped()
    steps = {"torque": 1e-3, "input_angle": 1e-4, "temperature": 1e-2}
    for name, size in steps.items():
        for sign in (1.0, -1.0):
            moved = ({"torque": 11.0} | held)[name] + sign * size
            known = (stepped(**{name: moved}) - at) / size
            fmu.restore(state)
            assert fmu.derivative("lost_motion", name, sign) == pytest.approx(
                known, rel=1e-3, abs=1e-13
            )
    up, down = (fmu.derivative("lost_motion", "torque", sign) for sign in (1.0, -1.0))
    assert up > 0 > down
    assert fmu.get("stiffness")[0] == pytest.approx(1.0 / up, rel=1e-6)
    assert -down < 0.9 * up  # the drive is stiffer against the direction of the last load
    assert fmu.derivative("output_angle", "input_angle") == pytest.approx(
        1.0 / ratio + fmu.derivative("lost_motion", "input_angle"), rel=1e-9
    )
    angle = fmu.get("output_angle")[0]
    fmu.close()

    inverse = Running(write(with_effects, "angles", version)[0], tmp_path)
    inverse.step(output_angle=angle, **held)
    inverse.step(output_angle=angle + 1e-5, **held)
    stiffness = inverse.get("stiffness")[0]
    assert inverse.derivative("torque", "output_angle") == pytest.approx(stiffness, rel=1e-4)
    inverse.close()


def test_parameters_are_tuned_between_steps_and_refused_where_they_clash(
    tmp_path: Path,
) -> None:
    file, controller, _ = write(DATA / "drives" / "size_25.toml", "torque", 2)
    fmu = Running(file, tmp_path)
    fmu.step(torque=20.0)
    (before,) = fmu.get("lost_motion")
    state = fmu.save()
    fmu.set("torsion_curve.torque[2]", -1e6)
    with pytest.raises(Exception, match="fmi2DoStep"):
        fmu.step(torque=20.0)
    fmu.restore(state)
    fmu.forget(state)
    for i in range(controller.torque_Nm.size):
        name = f"torsion_curve.angle[{i + 1}]"
        fmu.set(name, 2.0 * fmu.get(name)[0])
    fmu.step(torque=20.0)
    assert fmu.get("lost_motion")[0] > 1.5 * before
    fmu.close()


def test_limits_of_the_compensator_are_tuned_and_its_period_is_not(tmp_path: Path) -> None:
    file, controller, _ = write(DATA / "joint" / "joint.toml", "compensator", 3)
    fmu = Running(file, tmp_path)
    largest = controller.limits.correction_rad / 10
    fmu.set("limits.correction", largest)
    for _ in range(300):
        fmu.step(torque=40.0)
    correction, status = fmu.get("correction", "status")
    assert correction == pytest.approx(-largest, rel=1e-6)
    assert int(status) & core(32).lib.LM_STATE_POSITION_LIMITED
    fmu.set("limits.correction", controller.limits.correction_rad)
    fmu.step(torque=40.0)
    before = fmu.save()
    fmu.set("limits.period", 2e-3)
    with pytest.raises(Exception, match="fmi3DoStep"):
        fmu.step(torque=40.0)
    fmu.restore(before)
    fmu.forget(before)
    fmu.step(torque=40.0)
    fmu.close()


OWN = """from lostmotion.discover import Value, formula

ripple = formula(
    "ripple",
    "size_rad * sin(3 * input_angle_rad)",
    values=[Value("size_rad", role="linear", typical=1e-4, low=-1e-2, high=1e-2)],
    kind="angle",
    mechanism="a ripple of three waves a turn",
)
"""


def test_an_effect_of_the_user_is_in_the_fmu(tmp_path: Path) -> None:
    (tmp_path / "ripple.py").write_text(OWN, encoding="utf-8")
    own = load(tmp_path / "ripple.py")
    bought = read_drive(DATA / "joint" / "joint.toml")
    drive = dataclasses.replace(bought, effects=[{"name": "ripple", "size_rad": 1e-4}])
    controller = make_controller(drive, profile="full", own=own)
    file = tmp_path / "own.fmu"
    export_fmu(controller, file, kind="torque", version=2, ratio=drive.ratio, title="")
    fmu = Running(file, tmp_path)
    found = []
    for angle in (0.0, 0.4, 0.9):
        fmu.step(input_angle=angle)
        found += fmu.get("lost_motion")
    fmu.close()
    np.testing.assert_allclose(found, 1e-4 * np.sin([0.0, 1.2, 2.7]), rtol=0, atol=1e-15)


@pytest.mark.parametrize("version", [2, 3])
def test_inputs_beyond_the_model_are_clipped_and_reported(version: Version, tmp_path: Path) -> None:
    file, controller, _ = write(DATA / "joint" / "joint.toml", "torque", version)
    lib = core(64).lib
    fmu = Running(file, tmp_path)
    fmu.step(torque=2.0 * controller.torque_limit_Nm)
    lost, status = fmu.get("lost_motion", "status")
    assert status == lib.LM_STATE_TORQUE_CLIPPED
    fmu.step(torque=controller.torque_limit_Nm)
    assert fmu.get("lost_motion", "status") == [lost, 0]
    fmu.step(torque=float("nan"))
    assert fmu.get("lost_motion", "status") == [lost, lib.LM_STATE_INPUT_REFUSED]
    fmu.close()
    inverse = Running(write(DATA / "joint" / "joint.toml", "angles", version)[0], tmp_path)
    inverse.step(output_angle=0.5)
    assert inverse.get("torque") == [controller.torque_limit_Nm]
    assert inverse.get("status") == [lib.LM_STATE_TORQUE_CLIPPED]
    inverse.close()


@pytest.mark.parametrize("version", [2, 3])
def test_four_instances_at_once_do_not_meet(version: Version, tmp_path: Path) -> None:
    file, controller, _ = write(DATA / "joint" / "joint.toml", "torque", version)
    scales = (1.0, 0.6, -0.8, 0.3)
    columns = inputs_of(controller.torque_limit_Nm)
    instances = [Running(file, tmp_path) for _ in scales]
    found: list[list[float]] = [[] for _ in scales]
    for k in range(SAMPLES):
        for i, (instance, scale) in enumerate(zip(instances, scales, strict=True)):
            instance.step(torque=scale * float(columns["torque"][k]))
            found[i] += instance.get("lost_motion")
    for instance, scale, row in zip(instances, scales, found, strict=True):
        instance.close()
        known = run_model(controller, {"torque": scale * columns["torque"]})
        np.testing.assert_allclose(row, known, rtol=0, atol=1e-12)


def test_fmpy_simulates_it_and_compiles_its_sources(tmp_path: Path) -> None:
    file, _, _ = write(DATA / "joint" / "joint.toml", "torque", 2)
    signal = np.array(
        [(0.0, 0.0), (0.1, 30.0), (0.2, -30.0)], dtype=[("time", float), ("torque", float)]
    )
    result = fmpy.simulate_fmu(
        str(file),
        stop_time=0.2,
        step_size=1e-3,
        output_interval=1e-3,
        input=signal,
        output=["lost_motion", "torque"],
    )
    assert np.ptp(result["lost_motion"]) > 1e-4
    with zipfile.ZipFile(file) as archive:
        sources = archive.read("sources/lostmotion.c").decode()
        assert "lm_real lm_step_model(const lm_parameters *parameters" in sources
        archive.extractall(tmp_path / "unpacked")
    built = tmp_path / "built.so"
    units = sorted((tmp_path / "unpacked" / "sources").glob("*.c"))
    compiled = [unit for unit in units if unit.name in ("runtime.c", "model.c")]
    strict = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"]
    subprocess.run(
        ["cc", "-std=c99", "-fPIC", "-shared", *strict, *map(str, compiled), "-o", str(built)],
        check=True,
        timeout=120,
    )
    shutil.rmtree(tmp_path / "unpacked")
    if shutil.which("cmake"):
        newer = write(DATA / "joint" / "joint.toml", "torque", 3)[0]
        fmpy.extract(str(newer), unzipdir=str(tmp_path / "unpacked"))
        shutil.rmtree(tmp_path / "unpacked" / "binaries")
        build_platform_binary(tmp_path / "unpacked")
        again = fmpy.simulate_fmu(
            str(tmp_path / "unpacked"),
            stop_time=0.2,
            step_size=1e-3,
            output_interval=1e-3,
            input=signal,
            output=["lost_motion"],
        )
        np.testing.assert_allclose(again["lost_motion"], result["lost_motion"], atol=1e-15)
    needed = {v.name for v in fmpy.read_model_description(str(file)).modelVariables}
    assert {"torque", "lost_motion", "lost_motion_rate", "output_angle", "stiffness"} <= needed


def test_the_same_drive_gives_the_same_bytes(tmp_path: Path) -> None:
    drive_file = DATA / "joint" / "joint.toml"
    first = export_of(drive_file, tmp_path, "torque", 3)[0].read_bytes()
    assert export_of(drive_file, tmp_path, "torque", 3)[0].read_bytes() == first


def test_without_a_compiler_the_sources_go_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    drive = read_drive(DATA / "joint" / "joint.toml")
    answer = export_fmu(
        make_controller(drive, profile="full"),
        tmp_path / "a.fmu",
        kind="torque",
        version=2,
        ratio=drive.ratio,
        title="",
    )
    assert answer["binary"] is None
    assert any("No C compiler" in note for note in answer["notes"])
    with zipfile.ZipFile(tmp_path / "a.fmu") as archive:
        assert not [name for name in archive.namelist() if name.startswith("binaries")]
    monkeypatch.setenv("CC", "no-such-compiler")
    with pytest.raises(InputError, match="no-such-compiler"):
        export_of(DATA / "joint" / "joint.toml", tmp_path, "torque", 2)


def test_the_command_line(tmp_path: Path) -> None:
    def run(*words: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "lostmotion", "export"]
        return subprocess.run(
            [*command, str(DATA / "joint" / "joint.toml"), *words],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )

    done = run("-o", "drive.fmu", "--fmi", "3", "--json", "-")
    assert done.returncode == 0, done.stderr
    assert '"fmi": "3.0"' in done.stdout
    for words, said in (
        (("-o", "a.h", "--fmi", "3"), "--fmi"),
        (("-o", "a.h", "--fmu", "angles"), "--fmu"),
        (("-o", "a.fmu", "--profile", "gap"), "--profile"),
        (
            (
                "-o",
                "a.fmi",
            ),
            ".fmu",
        ),
    ):
        refused = run(*words)
        assert refused.returncode == 2
        assert said in refused.stderr
        assert refused.stderr.count("\n") == 1
    assert [file.name for file in tmp_path.iterdir()] == ["drive.fmu"]


HOST = Path(__file__).parents[1] / "fmu" / "host.c"

SANITIZERS = {"memory": ["address", "undefined"], "threads": ["thread"]}


@pytest.mark.parametrize("kind", ["angles", "compensator"])
@pytest.mark.parametrize("sanitizer", SANITIZERS)
def test_no_leak_no_race(with_effects: Path, kind: Kind, sanitizer: str, tmp_path: Path) -> None:
    """A host in C, four threads: instances, states, refused calls, all freed."""
    flags = [f"-fsanitize={word}" for word in SANITIZERS[sanitizer]]
    probe = tmp_path / "probe.c"
    probe.write_text("int main(void) { return 0; }\n", encoding="ascii")

    def links(compiler: str) -> bool:
        """Whether it is there, with the sanitizer's library, which is a package of its own."""
        made = [compiler, *flags, str(probe), "-o", str(tmp_path / "probe")]
        found = shutil.which(compiler) is not None
        return found and subprocess.run(made, capture_output=True, check=False).returncode == 0

    compiler = next(filter(links, ("clang-19", "clang", "gcc")), None)
    if compiler is None:
        pytest.skip(f"no C compiler with -fsanitize={SANITIZERS[sanitizer][0]}: apt install gcc")
    drive = read_drive(with_effects)
    controller = make_controller(drive, profile="full")
    variables = list_variables(controller, kind, drive.ratio)
    sources = make_sources(controller, kind, 2, variables)
    for name, text in sources.texts.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    shutil.copy(HOST, tmp_path)
    command = [compiler, "-std=c11", "-O0", "-g", "-pthread", "-ffp-contract=off", *flags]
    command += ["-fno-sanitize-recover=all", '-DFMU_TOKEN="{token}"', "-I."]
    subprocess.run(
        [*command, *sources.units, HOST.name, "-o", "host"], cwd=tmp_path, check=True, timeout=120
    )
    done = subprocess.run(
        [tmp_path / "host"], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.strip() == "4 threads agree"
