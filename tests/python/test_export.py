"""Parameters for the controller: the values of a drive file arrive in the library's struct."""

from __future__ import annotations

import csv
import json
import re
import struct
import subprocess
import zlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from conftest import DATA, needs_compiler
from lostmotion.cli import main
from lostmotion.core import NEEDS, core
from lostmotion.discover import Value, formula
from lostmotion.drives import read_drive
from lostmotion.errors import InputError
from lostmotion.export import (
    Controller,
    Envelope,
    Limits,
    Play,
    Watch,
    build,
    format_blob,
    format_header,
    make_controller,
    read_settings,
)
from lostmotion.model import design_model
from lostmotion.recordings import Campaign, Run, read_campaign
from lostmotion.replay import conditions, load_parameters, replay
from lostmotion.units import ARCMIN, ARCSEC

LIB = Path(__file__).parents[2] / "lib"
STIFFNESSES = ("T1_Nm", "T2_Nm", "K1_Nm_per_rad", "K2_Nm_per_rad", "K3_Nm_per_rad")
WARNINGS = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror"]

Write = Callable[..., Path]


def stored(parameters: Any) -> bytes:
    """The blob as the library itself writes it."""
    c = core(32)
    room = c.lib.LM_BLOB_BYTES_MAX
    found = c.ffi.new("uint8_t[]", room)
    length = c.ffi.new("size_t *")
    fault = c.fault()
    c.check(c.lib.lm_store_parameters(parameters, found, room, length, fault), fault)
    return bytes(c.ffi.buffer(found, length[0]))


def controllers() -> list[Controller]:
    """Bought and designed drives, friction inside, effects of each kind."""
    limits = Limits(1e-3, 2e-3, 0.05, 5.0, 2e3, 60.0)
    watch = Watch(1.0, 2.0, 1e-5, 1e-4)
    torque = np.linspace(-40, 40, 21)
    both = Controller(
        50.0,
        torque,
        torque / 2e4,
        limits,
        watch,
        outside=[Play(0.5, 0.006, 3e-6)],
        inside=[Play(1.0, 0.0, 0.3), Play(4.0, 0.1, 0.05)],
        effects=[
            ("torque_scale", [0.02]),
            ("thermal_friction", [0.02]),
            ("soft_windup", [5e-5, 2.0]),
        ],
        envelope=Envelope(4.0, 12.0),
    )
    drives = [read_drive(DATA / "drives" / f"{name}.toml") for name in ("size_25", "reference_a")]
    return [*(make_controller(drive) for drive in drives), both]


@pytest.mark.parametrize("index", range(3))
def test_blob_is_what_the_library_writes_and_reads(index: int) -> None:
    controller = controllers()[index]
    blob = format_blob(controller)
    made = build(controller)
    assert blob == stored(made)
    assert blob == stored(load_parameters(blob))
    assert made.fingerprint == load_parameters(blob).fingerprint == zlib.crc32(blob[:-4])


def test_blob_has_the_stated_layout() -> None:
    blob = format_blob(controllers()[2])
    assert blob[:4] == b"LMP1"
    assert struct.unpack("<3I", blob[4:16]) == (0x01020304, 3, len(blob))
    assert struct.unpack("<fI", blob[16:24]) == (50.0, 21)
    plays = 24 + 21 * 8
    assert struct.unpack("<2I", blob[plays : plays + 8]) == (3, 1)
    envelope = plays + 8 + 3 * 12
    assert struct.unpack("<2f", blob[envelope : envelope + 8]) == (4.0, 12.0)
    assert struct.unpack("<I", blob[-4:]) == (zlib.crc32(blob[:-4]),)


@pytest.mark.parametrize("position", [0, 5, 9, 13, 40, -1])
def test_damaged_blob_is_refused(position: int) -> None:
    blob = bytearray(format_blob(controllers()[0]))
    blob[position] ^= 0x10
    with pytest.raises(InputError):
        load_parameters(bytes(blob))


CHECK = """
#include <stdio.h>
#include "params.h"
int main(void) {
  unsigned char blob[LM_BLOB_BYTES_MAX];
  size_t length;
  lm_fault fault = {LM_OK, "", 0, 0, 0};
  static lm_parameters again;
  if (lm_check_parameters(&joint_parameters, &fault) != LM_OK ||
      lm_store_parameters(&joint_parameters, blob, sizeof blob, &length, &fault) != LM_OK ||
      lm_load_parameters(&again, blob, length, lm_effects, LM_EFFECT_COUNT, &fault) != LM_OK) {
    printf("%s", fault.input);
    return 1;
  }
  fwrite(blob, 1, length, stdout);
  return again.fingerprint != joint_parameters.fingerprint;
}
"""


def compile_header(folder: Path, header: str, flags: list[str]) -> subprocess.CompletedProcess[str]:
    (folder / "params.h").write_text(header)
    (folder / "check.c").write_text(CHECK)
    sources = [LIB / "status.c", *(LIB / "runtime").rglob("*.c"), folder / "check.c"]
    command = ["cc", "-std=c99", "-DLM_REAL_BITS=32", *WARNINGS, *flags]
    command += [
        f"-I{LIB / 'include'}",
        f"-I{LIB}",
        f"-I{folder}",
        "-o",
        str(folder / "check"),
    ]
    return subprocess.run(
        [*command, *map(str, sources)], capture_output=True, text=True, check=False
    )


@needs_compiler
@pytest.mark.parametrize(("index", "profile"), [(1, "FULL"), (2, "STANDARD")])
def test_header_compiles_and_holds_what_the_blob_holds(
    tmp_path: Path, index: int, profile: str
) -> None:
    controller = controllers()[index]
    header = format_header(controller, "joint_parameters", "a */ joint")
    sizes = [f"-DLM_PROFILE=LM_PROFILE_{profile}"]
    if profile == "STANDARD":
        sizes += ["-DLM_EFFECTS_MAX=3", "-DLM_EFFECT_MEMORY_MAX=0", "-DLM_ENVELOPE=1"]
    done = compile_header(tmp_path, header, sizes)
    assert done.returncode == 0, done.stderr
    run = subprocess.run([tmp_path / "check"], capture_output=True, check=False)
    assert run.returncode == 0, run.stdout
    assert run.stdout == format_blob(controller)


def test_header_has_the_operators_of_the_library_to_the_last_bit() -> None:
    made = replace(controllers()[1], outside=[Play(0.0, 0.2, 1e-6)], inside=[])
    # The library keeps 1.2f and derives the other slope from it: 1 - (1.2f - 1).
    assert np.float32(1) - (np.float32(1.2) - np.float32(1)) == np.float32(0.79999995)
    slot = " {0.0f, {0.79999995f, 1.2f}, 1e-06f}"
    assert slot in format_header(made, "joint_parameters", "joint")


def test_header_names_the_conditions_that_the_host_fills_in(
    write: Write, bought: dict[str, Any]
) -> None:
    def wanted(controller: Controller) -> str:
        return format_header(controller, "joint_parameters", "joint").splitlines()[2]

    assert wanted(make_controller(read_drive(write(bought)))) == " * Every tick needs torque_Nm. */"
    gap = make_controller(read_drive(write(bought)), profile="gap")
    assert wanted(gap) == " * Every tick needs output_angle_rad. */"
    bought["effect"] = [
        {"name": "creep", "share": 0.01, "onset_s": 1},
        {"name": "thermal_drift", "drift_rad_per_K": 1e-6},
        {"name": "viscous_friction", "drag_Nm_s": 0.01},
    ]
    full = make_controller(read_drive(write(bought)), profile="full")
    fields = "torque_Nm, input_velocity_rad_s, temperature_C, elapsed_s"
    assert wanted(full) == f" * Every tick needs {fields}. */"
    own = formula(
        "cable",
        "-stiffness_Nm_per_rad * output_angle_rad",
        values=[Value("stiffness_Nm_per_rad", "linear", 0.5, -50.0, 50.0)],
        kind="torque",
    )
    bought["effect"] = [{"name": "cable", "stiffness_Nm_per_rad": 1}]
    bought["fit"] = {"values": {"cable.stiffness_Nm_per_rad": 1.0}}
    mine = make_controller(read_drive(write(bought)), profile="full", own={"cable": own})
    assert wanted(mine) == " * Every tick needs torque_Nm, output_angle_rad. */"
    # The bits are in the order of the rows.
    text = (LIB / "include" / "lostmotion" / "condition_list.h").read_text()
    bits = re.findall(r"#define LM_NEEDS_(\w+) (\d+)u", text)
    assert [int(bit) for _, bit in bits] == [1 << k for k in range(len(NEEDS))]
    for (need, _), field in zip(bits, NEEDS, strict=True):
        assert need == "TIME" or field.startswith(need.lower())


@needs_compiler
def test_header_fits_any_larger_store(tmp_path: Path) -> None:
    header = format_header(controllers()[0], "joint_parameters", "joint")
    for sizes in ("-DLM_CURVE_POINTS_MAX=16 -DLM_PLAYS_MAX=4", "-DLM_PLAYS_MAX=32"):
        done = compile_header(tmp_path, header, sizes.split())
        assert done.returncode == 0, done.stderr
        run = subprocess.run([tmp_path / "check"], capture_output=True, check=False)
        assert (run.returncode, run.stdout) == (0, format_blob(controllers()[0]))


@needs_compiler
def test_header_that_does_not_fit_stops_the_build(tmp_path: Path) -> None:
    header = format_header(controllers()[0], "joint_parameters", "joint")
    for small in ("-DLM_PLAYS_MAX=3", "-DLM_PROFILE=LM_PROFILE_GAP"):
        done = compile_header(tmp_path, header, [small])
        assert done.returncode != 0
        assert "these parameters need" in done.stderr
    header = format_header(controllers()[2], "joint_parameters", "joint")
    done = compile_header(tmp_path, header, ["-DLM_EFFECTS_MAX=3", "-DLM_ENVELOPE=0"])
    assert done.returncode != 0
    assert "LM_ENVELOPE 1" in done.stderr


@needs_compiler
def test_gap_profile_is_half_the_lost_motion_each_way(
    tmp_path: Path, write: Write, bought: dict[str, Any]
) -> None:
    controller = make_controller(read_drive(write(bought)), profile="gap")
    # The sheet of conftest states 1 arcmin.
    assert controller.outside[0].radius_Nm == pytest.approx(0.5 * ARCMIN)
    header = format_header(controller, "joint_parameters", "joint")
    done = compile_header(tmp_path, header, ["-DLM_PROFILE=LM_PROFILE_GAP"])
    assert done.returncode == 0, done.stderr
    run = subprocess.run([tmp_path / "check"], capture_output=True, check=False)
    assert (run.returncode, run.stdout) == (0, format_blob(controller))
    del bought["catalogue"]["lost_motion_arcmin"]
    wind_up = make_controller(read_drive(write(bought)), profile="gap").outside[0].radius_Nm
    assert wind_up == pytest.approx(0.04 * 67 / 31e3)


def evaluate(parameters: Any, torque: list[float]) -> np.ndarray:
    c = core(32)
    memory = c.ffi.new("lm_memory *")
    at = c.ffi.new("lm_conditions *")
    c.lib.lm_start_model(memory, 0.0)
    found = []
    for value in torque:
        at.torque_Nm = value
        found.append(c.lib.lm_step_model(parameters, memory, at))
    return np.array(found)


def test_catalogue_figures_come_out_of_the_controller(write: Write, bought: dict[str, Any]) -> None:
    del bought["catalogue"]["hysteresis_arcmin"]
    plain = build(make_controller(read_drive(write(bought))))
    # Size 25 of the catalogue: K1 to T1, K2 to T2, K3 beyond.
    expected = [14 / 31e3, 14 / 31e3 + 34 / 50e3, 14 / 31e3 + 34 / 50e3 + 12 / 57e3]
    assert evaluate(plain, [14, 48, 60]) == pytest.approx(expected, rel=1e-5)
    assert evaluate(plain, [-60]) == pytest.approx([-expected[-1]], rel=1e-5)
    bought["catalogue"]["hysteresis_arcmin"] = 1
    loop = build(make_controller(read_drive(write(bought))))
    # After full swings the loop at zero torque is as wide as the sheet's hysteresis.
    falling, rising = evaluate(loop, [67, 0, -67, 0])[[1, 3]]
    assert falling - rising == pytest.approx(1 * ARCMIN, rel=1e-3)


def test_design_keeps_its_torsion_curve_within_the_stated_error(
    write: Write, drawn: dict[str, Any]
) -> None:
    drive = read_drive(write(drawn))
    controller = make_controller(drive)
    torque = np.linspace(-80, 80, 257)
    exact = design_model(drive).torsion_curve(torque).total_rad
    straight = np.interp(torque, controller.torque_Nm, controller.angle_rad)
    assert controller.torque_Nm.size == 33
    assert np.max(np.abs(straight - exact)) < 0.1 * ARCSEC
    assert make_controller(drive, profile="full").torque_Nm.size == 64


def test_flank_friction_of_a_design_makes_a_loop_that_grows_with_the_torque() -> None:
    drive = read_drive(DATA / "drives" / "reference_a.toml")
    parameters = build(make_controller(drive))
    wide = np.subtract(*evaluate(parameters, [60, 30, -60, 30])[[1, 3]])
    narrow = np.subtract(*evaluate(parameters, [60, 10, -60, 10])[[1, 3]])
    # The torque has to return through zero before the wide operators follow.
    assert 0 < narrow < wide


def test_fitted_drive_brings_its_own_torsion_curve_and_friction(
    write: Write, bought: dict[str, Any]
) -> None:
    bought["fit"] = {
        "friction": "inside",
        "values": {
            "knot_1_Nm": 2.0,
            "knot_2_Nm": 20.0,
            "slope_1_rad_per_Nm": 1e-4,
            "slope_2_rad_per_Nm": 5e-5,
            "slope_3_rad_per_Nm": 2e-5,
            "play_radius_1_Nm": 1.0,
            "play_share_1": 0.25,
            "play_radius_2_Nm": 3.0,
            "play_share_2": 0.0,
        },
    }
    controller = make_controller(read_drive(write(bought)))
    assert controller.torque_Nm.tolist() == [-134, -20, -2, 0, 2, 20, 134]
    assert list(controller.plays) == list(controller.inside) == [Play(1.0, 0.0, 0.25)]
    # At torques up to 40 the play lags by 1: 0.25 of it is missing from the torque that winds up.
    wound = 40 - 0.25 * 1.0
    expected = 2 * 1e-4 + 18 * 5e-5 + (wound - 20) * 2e-5
    assert evaluate(build(controller), [40.0]) == pytest.approx([expected], rel=1e-5)


def test_effects_of_the_file_arrive_in_order_with_their_units(
    write: Write, bought: dict[str, Any]
) -> None:
    bought["effect"] = [
        {"name": "soft_windup", "windup_arcsec": 10.0, "torque_Nm": 2.0},
        {"name": "torque_offset", "offset_mNm": 100.0},
    ]
    controller = make_controller(read_drive(write(bought)))
    assert [name for name, _ in controller.effects] == ["torque_offset", "soft_windup"]
    assert controller.effects[0][1] == pytest.approx([0.1])
    assert controller.effects[1][1] == pytest.approx([10 * ARCSEC, 2.0])
    plain = build(
        make_controller(read_drive(write({k: bought[k] for k in ("drive", "catalogue")})))
    )
    shifted = evaluate(build(controller), [20.0]) - evaluate(plain, [20.1])
    assert shifted == pytest.approx([10 * ARCSEC], abs=0.01 * ARCSEC)


def test_settings_take_any_unit_and_the_rest_follows() -> None:
    settings = read_settings(["period_us=500", "correction_arcmin=5", "noise_arcsec=3"])
    assert settings == pytest.approx(
        {"period": 5e-4, "correction": 5 * ARCMIN, "noise": 3 * ARCSEC}
    )
    limits = make_controller(read_drive(DATA / "drives" / "size_25.toml"), settings).limits
    assert limits.response_per_s == pytest.approx(62.5)
    assert limits.acceleration_rad_s2 == pytest.approx(125 * limits.velocity_rad_s)


def test_limits_follow_the_resonance_and_the_noise_not_the_tick() -> None:
    drive = read_drive(DATA / "drives" / "size_25.toml")

    def limits(*texts: str) -> Limits:
        return make_controller(drive, read_settings(texts)).limits

    slow, fast = limits("period_us=1000"), limits("period_us=100")
    assert replace(fast, period_s=slow.period_s) == slow
    stiff = limits("period_us=100", "resonance_Hz=80")
    assert stiff.response_per_s == pytest.approx(80 / 25 * fast.response_per_s)
    # A tick that is too long for the resonance limits the response.
    assert limits("period_us=2000").response_per_s == pytest.approx(1 / 0.032)
    # 64 response^2 slope noise of acceleration is a third of the limit; K1 is 31 kN m/rad.
    noisy = limits("period_us=100", "torque_noise_Nm=2")
    acceleration = 64 * noisy.response_per_s**2 / 31e3 * 2
    assert acceleration == pytest.approx(noisy.acceleration_rad_s2 / 3, rel=1e-3)
    assert limits("period_us=100", "torque_noise_Nm=0.01") == fast


def test_a_vibration_of_the_torque_narrows_the_operators() -> None:
    drive = read_drive(DATA / "drives" / "size_25.toml")
    still = make_controller(drive)
    shaken = make_controller(drive, read_settings(["vibration_Nm=0.5"]))
    assert [play.radius_Nm for play in shaken.plays] == pytest.approx(
        [max(play.radius_Nm - 0.5, 0) for play in still.plays]
    )
    assert any("0.5 N m" in note for note in shaken.notes)
    # A torque with a decaying oscillation of that amplitude ends the wider operators where the
    # torque without it ends the narrower ones.

    def settled(controller: Controller, torque: np.ndarray) -> float:
        return float(evaluate(build(controller, core(32)), torque.tolist())[-1])

    ramp = np.linspace(0, -20, 400)
    time = np.arange(4000)
    rest = np.full(time.size, -20.0)
    swing = 0.5 * np.exp(-time / 800.0) * np.sin(0.05 * time + np.pi / 2)
    wide = settled(still, np.concatenate((ramp, rest + swing)))
    narrow = settled(shaken, np.concatenate((ramp, rest)))
    kept = settled(still, np.concatenate((ramp, rest)))
    assert abs(wide - narrow) < 0.2 * abs(wide - kept)


def test_fit_hands_on_its_noise_and_its_ranges(write: Write, bought: dict[str, Any]) -> None:
    bought["fit"] = {
        "noise_floor_arcsec": 2.28,
        "values": {"play_envelope_Nm": 0.01, "play_envelope_knee_Nm": 9.0},
        "ranges": {"torque_Nm": [-60.0, 50.0], "temperature_C": [10.0, 50.0]},
    }
    made = build(make_controller(read_drive(write(bought))))
    assert made.watch.noise_rad == pytest.approx(2.28 * ARCSEC)
    bought["fit"]["heldout_rms_arcsec"] = 1.5  # what the deviations explain is not noise
    bounded = build(make_controller(read_drive(write(bought))))
    assert bounded.watch.noise_rad == pytest.approx(1.5 * ARCSEC)
    assert made.valid.torque_Nm == 60
    assert list(made.valid.temperature_C) == [10, 50]
    assert list(made.valid.cycles) == [0, 0]
    for wrong in (
        {"torque_Nm": [1.0, -1.0]},
        {"torque_Nm": [1.0]},
        {"speed": [0.0, 1.0]},
    ):
        bought["fit"]["ranges"] = wrong
        with pytest.raises(InputError, match=r"fit\.ranges"):
            read_drive(write(bought))


def test_correction_is_reached_within_the_limits_of_the_defaults() -> None:
    drive = read_drive(DATA / "drives" / "size_25.toml")
    parameters = build(make_controller(drive))
    torque = np.repeat([0.0, 100.0], [10, 400])
    run = Run(
        1,
        "step",
        {
            "time": np.arange(torque.size) * 1e-3,
            "torque": torque,
            "lost_motion": np.zeros_like(torque),
        },
    )
    tape = replay(parameters, Campaign([run])).tapes[0]
    correction, velocity, acceleration, model = tape.values.T
    assert correction[-1] == pytest.approx(-model[-1], rel=1e-3)
    limits = parameters.limits
    assert np.max(np.abs(velocity)) <= limits.velocity_rad_s * (1 + 1e-6)
    assert np.max(np.abs(acceleration)) <= limits.acceleration_rad_s2 * (1 + 1e-6)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--set", "period=1"], "no unit"),
        (["--set", "period_Nm=1"], "a time"),
        (["--set", "perod_s=1"], "did you mean 'period_s'"),
        (["--set", "period_s"], "without ="),
        (["--set", "period_s=one"], "KEY_UNIT=NUMBER"),
        (["--set", "response_per_s=1000"], "at most 62.5"),
        (["--set", "misfit_arcsec=1", "--set", "noise_arcsec=2"], "misfit_rad"),
        (["--name", "3 joints"], "a name in C"),
        (["-o", "params.txt"], ".h, .bin or .fmu"),
        (["-o", "nowhere/params.h"], "folder"),
    ],
)
def test_bad_options_of_export_are_reported_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], says: str
) -> None:
    place = tmp_path / "params.h"
    drive = str(DATA / "drives" / "size_25.toml")
    words = [str(tmp_path / w) if w.startswith(("params", "nowhere")) else w for w in words]
    assert main(["export", drive, "-o", str(place), *words]) == 2
    error = capsys.readouterr().err
    assert says in error
    assert error.count("\n") == 1
    assert not place.exists()


def test_loop_wider_than_the_drive_is_refused(write: Write, bought: dict[str, Any]) -> None:
    bought["catalogue"]["hysteresis_arcmin"] = 30
    with pytest.raises(InputError, match="too wide"):
        build(make_controller(read_drive(write(bought))))


@pytest.mark.parametrize(("size", "ratio", "guaranteed_arcmin"), [("14", 30, 3), ("17", 50, 2)])
def test_guarantee_wider_than_the_stiffnesses_bear_is_no_obstacle(
    write: Write,
    bought: dict[str, Any],
    size: str,
    ratio: int,
    guaranteed_arcmin: float,
) -> None:
    def rows(name: str) -> list[dict[str, str]]:
        with (DATA / "catalogue" / name).open(newline="") as stream:
            found = list(csv.DictReader(stream))
        return [row for row in found if (row["size"], row["ratio"]) == (size, str(ratio))]

    rated_Nm = float(rows("torque_ratings.csv")[0]["rated_2000rpm_Nm"])
    sheet = {name: float(rows("torsional_stiffness.csv")[0][name]) for name in STIFFNESSES}
    bought["drive"] |= {"ratio": ratio, "rated_torque_Nm": rated_Nm}
    bought["catalogue"] = sheet | {"hysteresis_arcmin": guaranteed_arcmin}
    made = make_controller(read_drive(write(bought)))
    assert any("upper limit, is more than its stiffnesses allow" in n for n in made.notes)
    falling, rising = evaluate(build(made), [rated_Nm, 0, -rated_Nm, 0])[[1, 3]]
    assert 0.3 * guaranteed_arcmin < (falling - rising) / ARCMIN < guaranteed_arcmin
    # Right after a reversal the drive is stiffer than any value in its sheet, but not rigid.
    peak, after = evaluate(build(made), [rated_Nm, rated_Nm * (1 - 1e-3)])
    assert 0 < peak - after < rated_Nm * 1e-3 / sheet["K3_Nm_per_rad"]


def test_drive_with_effects_states_how_to_compile(write: Write, bought: dict[str, Any]) -> None:
    bought["effect"] = [
        {"name": "soft_windup", "windup_arcsec": 10.0, "torque_Nm": 2.0},
        {"name": "creep", "share": 0.01, "onset_s": 1.0},
    ]
    notes = make_controller(read_drive(write(bought))).notes
    said = "The standard build contains no effects: compile with -DLM_EFFECTS_MAX=2 "
    assert f"{said}-DLM_EFFECT_MEMORY_MAX=6." in notes
    del bought["effect"]
    bought["fit"] = {"values": {"play_envelope_Nm": 4.0, "play_envelope_knee_Nm": 9.0}}
    made = make_controller(read_drive(write(bought)))
    assert made.envelope == Envelope(4.0, 9.0)
    assert not any("compile with" in note for note in made.notes)


def test_export_and_replay_commands(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    drive = str(DATA / "drives" / "size_25.toml")
    blob = tmp_path / "params.bin"
    assert main(["export", drive, "-o", str(blob), "--json", "-"]) == 0
    exported = json.loads(capsys.readouterr().out)
    assert exported["fingerprint"] == f"{zlib.crc32(blob.read_bytes()[:-4]):08x}"
    assert main(["export", drive, "-o", str(tmp_path / "params.h")]) == 0
    assert exported["fingerprint"] in capsys.readouterr().out

    time = np.arange(3000) * 1e-3
    torque = 60 * np.sin(4 * time) * np.minimum(time, 1)
    truth = evaluate(load_parameters(blob.read_bytes()), list(torque)) + 0.5
    log = tmp_path / "log.csv"
    rows = (f"{t:.17g},{q:.17g},{x:.17g}" for t, q, x in zip(time, torque, truth, strict=True))
    log.write_text("\n".join(["time_s,torque_Nm,lost_motion_rad", *rows]) + "\n")
    table = tmp_path / "ticks.csv"
    words = ["replay", str(blob), str(log), "--table", str(table)]
    assert main([*words, "--json", "-"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["fingerprint"] == exported["fingerprint"]
    assert answer["samples"] == 3000
    # The log is the model's own: the residual is the limiter's lag.
    assert answer["rms_model_arcsec"] < 0.01
    assert answer["rms_compensated_arcsec"] < 0.02 * answer["rms_uncompensated_arcsec"]
    assert answer["by_run"][0]["unknown_at_end_arcsec"] < 0.01
    assert main(words) == 0
    assert "compensated" in capsys.readouterr().out

    numbers = np.genfromtxt(table, delimiter=",", skip_header=1, dtype=np.float32)
    assert numbers.shape == (3000, 8)
    assert numbers[:, 2].tolist() == torque.astype(np.float32).tolist()
    # The same from the drive file as from the blob.
    assert main(["replay", drive, str(log), "--json", "-"]) == 0
    assert json.loads(capsys.readouterr().out)["bits_crc32"] == answer["bits_crc32"]


def test_replay_of_a_log_that_begins_in_motion_has_no_jolt(tmp_path: Path) -> None:
    time = np.arange(50) * 1e-3
    rows = (f"{t:.17g},5,{200 * t:.17g},{2 * t:.17g}" for t in time)
    log = tmp_path / "log.csv"
    head = "time_s,torque_Nm,input_angle_rad,output_angle_rad"
    log.write_text("\n".join([head, *rows]) + "\n")
    found = conditions(read_campaign([log], ratio=100).runs[0])
    assert np.allclose(found["input_velocity_rad_s"], 200, rtol=1e-6)
    assert np.max(np.abs(found["output_acceleration_rad_s2"])) < 1e-6
    # The compensator counts a tick of unknown length as one period.
    assert found["elapsed_s"][0] == 0


def test_replay_states_what_it_cannot_use(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    drive = str(DATA / "drives" / "size_25.toml")
    blob = tmp_path / "params.bin"
    assert main(["export", drive, "-o", str(blob)]) == 0
    log = tmp_path / "log.csv"
    log.write_text("time_s,torque_Nm,lost_motion_rad\n0,0,0\n0.01,1,0.0001\n0.02,2,0.0002\n")
    capsys.readouterr()
    assert main(["replay", str(blob), str(log), "--set", "period_ms=1"]) == 2
    assert "a blob is complete" in capsys.readouterr().err
    blob.write_bytes(blob.read_bytes()[:-1])
    assert main(["replay", str(blob), str(log)]) == 2
    assert "length" in capsys.readouterr().err
    assert main(["replay", str(tmp_path / "none.bin"), str(log)]) == 2
    assert "no such file" in capsys.readouterr().err
    assert main(["replay", drive, str(log), "--table", str(log)]) == 2
    assert "a separate file" in capsys.readouterr().err
    # Another rate is stated, not refused.
    assert main(["replay", drive, str(log)]) == 0
    assert "step is 10 ms" in capsys.readouterr().out
