"""The command: exit status, one line for bad input, JSON output, files complete or absent."""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shtab
from damaged_inputs import commands

from conftest import BOUGHT, DATA, DRAWN
from lostmotion import __version__, export, terminal
from lostmotion.cli import main
from lostmotion.commands import predict as predict_command
from lostmotion.commands.parser import JOINS, PROFILES, SHELLS, SIDES
from lostmotion.errors import LibraryError
from lostmotion.recordings import joining, protocol
from lostmotion.units import ARCMIN

Write = Callable[..., Path]
Capture = pytest.CaptureFixture[str]

REAL = DATA / "cycloidal_locked_output"


@pytest.fixture
def drawn_file(write: Write) -> str:
    return str(write(DRAWN, "drawn.toml"))


@pytest.fixture
def bought_file(write: Write) -> str:
    return str(write(BOUGHT, "bought.toml"))


def answer(capsys: Capture, *argv: str) -> dict[str, Any]:
    capsys.readouterr()
    assert main([*argv, "--json", "-"]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


def test_predict_answers_in_json_alone(capsys: Capture, bought_file: str) -> None:
    found = answer(capsys, "predict", bought_file, "--torque", "-67:67:5")
    assert found["schema"] == "lostmotion.prediction/1"
    assert found["torque_Nm"] == [-67, -33.5, 0, 33.5, 67]
    total = np.array(found["total_arcmin"])
    np.testing.assert_allclose(total, -total[::-1], atol=1e-12)
    parts = sum(np.array(part) for part in found["parts_arcmin"].values())
    np.testing.assert_allclose(parts, total, atol=1e-12)
    # 2 * 0.04 * 67 N m / 31e3 N m/rad
    assert found["reversal_lost_motion_arcmin"] == pytest.approx(0.5944, abs=1e-4)


def test_predict_without_torques_spans_plus_and_minus_the_rated_torque(
    capsys: Capture, drawn_file: str
) -> None:
    found = answer(capsys, "predict", drawn_file)
    assert (found["torque_Nm"][0], found["torque_Nm"][-1]) == (-40, 40)
    assert found["torque_Nm"][len(found["torque_Nm"]) // 2] == 0
    assert found["defaults"]["design.axial_sections"] == 1


def test_predict_takes_one_torque_and_more_than_the_library_does_at_once(
    capsys: Capture, drawn_file: str
) -> None:
    one = answer(capsys, "predict", drawn_file, "--torque", "40:40:1")
    many = answer(capsys, "predict", drawn_file, "--torque", "-40:40:1201")
    assert one["torque_Nm"] == [40]
    assert len(many["total_arcmin"]) == 1201
    assert np.all(np.diff(many["total_arcmin"]) > 0)
    assert many["total_arcmin"][-1] == pytest.approx(one["total_arcmin"][0], rel=1e-9)


def test_predict_prints_a_table_and_writes_the_answer(
    capsys: Capture, drawn_file: str, tmp_path: Path
) -> None:
    out = tmp_path / "answer.json"
    assert main(["predict", drawn_file, "--torque", "0:40:3", "--json", str(out)]) == 0
    text = capsys.readouterr().out
    assert "side clearance" in text
    assert "reversal lost motion at +-1.6 Nm" in text
    assert "design.material.youngs_modulus_MPa = 210000" in text
    assert json.loads(out.read_text())["torque_Nm"] == [0, 20, 40]


def test_predict_shows_what_a_fit_found_beside_the_sheet(
    capsys: Capture, write: Write, bought_file: str
) -> None:
    values = "knot_1_Nm = 20\nslope_1_rad_per_Nm = 3e-5\nslope_2_rad_per_Nm = 1e-5\n"
    fitted = str(write(f"{Path(bought_file).read_text()}\n[fit.values]\n{values}", "fitted.toml"))
    sheet = answer(capsys, "predict", bought_file, "--torque", "-40:40:5")
    found = answer(capsys, "predict", fitted, "--torque", "-40:40:5")
    assert found["total_arcmin"] == sheet["total_arcmin"]
    wanted = np.array([-8e-4, -6e-4, 0.0, 6e-4, 8e-4]) / ARCMIN
    np.testing.assert_allclose(found["fitted_arcmin"], wanted, rtol=1e-12)
    assert "fitted_arcmin" not in sheet
    assert main(["predict", fitted, "--torque", "-40:40:5"]) == 0
    said = capsys.readouterr().out
    assert "torque Nm  fitted" in said
    assert "fitted is the torsion curve fitted to recordings" in said


def test_predict_shows_checks_that_fail(
    capsys: Capture, write: Write, drawn: dict[str, Any]
) -> None:
    drawn["design"]["teeth"]["rigid_shift"] = 2.8
    assert main(["predict", str(write(drawn)), "--torque", "1:2:2"]) == 0
    shown = capsys.readouterr().out
    # As in the answer, but in the unit of the table above.
    found = re.search(r"check failed: smallest_gap (-[0-9.]+) arcmin, limit 0", shown)
    assert found is not None
    assert main(["predict", str(write(drawn)), "--torque", "1:2:2", "--json", "-"]) == 0
    checks = {check["name"]: check for check in json.loads(capsys.readouterr().out)["checks"]}
    assert float(found[1]) == pytest.approx(checks["smallest_gap"]["value"] / ARCMIN, rel=1e-3)


def test_predict_shows_what_each_tolerance_costs(
    capsys: Capture, write: Write, drawn: dict[str, Any]
) -> None:
    drawn["design"]["tolerance"] = [
        {"kind": "hole", "zone": "generator", "lower_um": 0, "upper_um": 12, "name": "bore"},
        {"kind": "shaft", "zone": "generator", "lower_um": -4, "upper_um": 4, "name": "race"},
    ]
    drawn["design"]["flexspline"]["rim_thickness_mm"] = 2.0  # a check without a unit fails
    assert main(["predict", str(write(drawn)), "--torque", "1:2:2"]) == 0
    shown = capsys.readouterr().out
    rows = [line.split() for line in shown.splitlines()]
    assert ["bore", "generator", "0.500", "0.0", "12.0", "60", "69"] in rows
    assert ["design.generator.floating", "=", "true"] in rows
    assert ["race", "generator", "-0.500", "-4.0", "4.0", "40", "31"] in rows
    assert re.search(r"check failed: safety_factor 0\.\d+, limit 1\.5", shown)


def test_a_radial_gap_of_no_tolerances_is_no_result(
    capsys: Capture, write: Write, drawn: dict[str, Any]
) -> None:
    drawn["design"].pop("tolerance", None)
    assert main(["predict", str(write(drawn)), "--torque", "1:2:2"]) == 0
    shown = capsys.readouterr().out
    assert "no tolerances are stated" in shown
    assert "radial gap from tolerances" not in shown


def test_clearances_at_stated_angles(capsys: Capture, drawn_file: str) -> None:
    found = answer(capsys, "clearances", drawn_file, "--angles-deg", "-10,0,80")
    assert found["schema"] == "lostmotion.clearances/1"
    assert found["angle_deg"] == pytest.approx([-10, 0, 80])
    # Reference design A: 1.531 and 0.174 arcmin; at 80 deg the teeth do not meet.
    assert found["forward_arcmin"][:2] == pytest.approx([1.531, 0.174], abs=0.003)
    assert found["forward_arcmin"][2] is None
    assert found["overlap"] == [True, True, False]


def test_clearances_at_stated_angles_give_back_the_angles_as_stated(
    capsys: Capture, drawn_file: str
) -> None:
    stated = [-60.0, -30.0, 0.1, 20.0, 30.0, 33.123456789]
    text = ",".join(map(str, stated))
    assert answer(capsys, "clearances", drawn_file, "--angles-deg", text)["angle_deg"] == stated


def test_clearances_by_phase_print_a_table(capsys: Capture, drawn_file: str) -> None:
    assert main(["clearances", drawn_file, "--phase-deg", "-0.9"]) == 0
    text = capsys.readouterr().out
    assert " -0.90 " in text
    assert " 0.00  " not in text
    assert "without overlap are not listed" in text


def test_compare_reads_foreign_recordings_by_the_map_of_the_drive(
    capsys: Capture, tmp_path: Path
) -> None:
    out = tmp_path / "comparison.json"
    argv = ["compare", str(REAL / "drive.toml"), str(REAL / "base_onyx_runin5.csv")]
    assert main([*argv, "--json", str(out)]) == 0
    captured = capsys.readouterr()
    assert captured.err == ""  # no progress bar in a pipe
    for words in ("fitted", "leave-one-run-out", "repeatability", "where it fails", "not testable"):
        assert words in captured.out
    found = json.loads(out.read_text())
    assert found["explained_share"] > 0.99
    assert answer(capsys, *argv) == found


def test_a_map_on_the_command_line_overrides_that_of_the_drive(
    capsys: Capture, write: Write
) -> None:
    drive = write(BOUGHT | {"columns": {"T": "torque_mNm"}})
    rows = "".join(f"{i},{i % 40},{1e-5 * (i % 40)}\n" for i in range(200))
    data = write("time_s,T,lost_motion_rad\n" + rows, "data.csv")
    # A thousandth of the torque: the map in the drive file is refused, and the message has its
    # correction.
    assert main(["compare", str(drive), str(data)]) == 2
    assert "--map T=torque_Nm" in capsys.readouterr().err
    found = answer(capsys, "compare", str(drive), str(data), "--map", "T=torque_Nm")
    assert found["explained_share"] > 0.99


@pytest.mark.parametrize(
    ("argv", "parts"),
    [
        (["predict"], ("DRIVE", "--help")),
        (["predict", "{bought}", "--torques", "1"], ("unrecognized arguments",)),
        (["predikt"], ("invalid choice: 'predikt'",)),
        (["predict", "none.toml"], ("none.toml", "no such file", "a drive file")),
        (["predict", "{bought}", "--torque", "1:2"], ("--torque", "'1:2'", "MIN:MAX:N")),
        (["predict", "{bought}", "--torque", "2:1:5"], ("--torque", "MIN below MAX")),
        (["predict", "{bought}", "--torque", "1:2:1"], ("--torque", "'1:2:1'", "N from 2")),
        (["predict", "{bought}", "--torque", "a:2:5"], ("--torque", "'a'", "a number")),
        (["predict", "{bought}", "--torque", "nan:2:5"], ("--torque", "'nan'", "a number")),
        (["predict", "{drawn}", "--phase-deg", "x"], ("--phase-deg", "'x'", "a number")),
        (["predict", "{bought}", "--json", "none/a.json"], ("--json", "none/a.json", "not exist")),
        (["predict", "{bought}", "--json", "."], ("--json", "the folder '.'")),
        (["predict", "{bought}", "--json", "{bought}"], ("--json", "the input", "a separate file")),
        (
            ["predict", "{bought}", "--json", "a", "--report", "./a"],
            ("--report", "file of --json"),
        ),
        (["predict", "{bought}", "--torque", "-2e6:1:5"], ("--torque", "-2e6", "1e+06")),
        (["predict", "{bought}", "--torque", "0:5e-324:9"], ("--torque", "MIN below MAX")),
        (["predict", "{drawn}", "--phase-deg", "361"], ("--phase-deg", "'361'", "-360 to 360")),
        (["clearances", "{drawn}", "--angles-deg", "91"], ("--angles-deg", "'91'", "-90 to 90")),
        (
            ["compare", "{bought}", "{real}", "--seed", "-1"],
            ("--seed", "'-1'", "an integer from 0"),
        ),
        (
            ["fit", "{bought}", "{real}", "-o", "none/f.toml", "--report", "r.html"],
            ("--output", "'none/f.toml'", "not exist"),
        ),
        (
            ["fit", "{bought}", "{real}", "-o", "{bought}"],
            ("--output", "the input", "a separate file"),
        ),
        (
            ["export", "{bought}", "-o", "a.h", "--json", "a.h"],
            ("--json", "the file of --output, 'a.h'", "a separate file"),
        ),
        (["compare", "{bought}", ""], ("no such file", "a recording or a folder")),
        (["diagnose", "{bought}", ""], ("no such file", "a recording or a folder")),
        (["check", ""], ("no such file", "a recording or a folder")),
        (["clearances", "{bought}"], ("bought.toml", "design", "the geometry")),
        (["clearances", "{drawn}", "--angles-deg", "1,,2"], ("--angles-deg", "''", "a number")),
        (["compare", "{bought}", "none.csv"], ("none.csv", "no such file")),
        (
            ["compare", "{bought}", "{real}"],
            ("time_s, torque_Nm, lost_motion_rad: found no such column (there are TIME, POSITION",),
        ),
        (["compare", "{bought}", "{real}", "--map", "x"], ("--map", "x", "COLUMN=NAME_UNIT")),
    ],
)
def test_bad_input_is_one_line_on_standard_error_and_status_2(
    capsys: Capture,
    drawn_file: str,
    bought_file: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    argv: list[str],
    parts: tuple[str, ...],
) -> None:
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.iterdir())
    places = {
        "bought": bought_file,
        "drawn": drawn_file,
        "real": str(REAL / "base_onyx_runin5.csv"),
    }
    assert main([word.format(**places) for word in argv]) == 2
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1
    for part in parts:
        assert part in captured.err
    assert sorted(tmp_path.iterdir()) == before


def test_work_that_fails_is_status_1(
    capsys: Capture, bought_file: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise LibraryError(7, "no pair of teeth can touch")

    monkeypatch.setattr(predict_command, "predict", fail)
    assert main(["predict", bought_file]) == 1
    assert capsys.readouterr().err == "lostmotion: no pair of teeth can touch\n"


def test_an_interrupt_is_status_130(
    capsys: Capture, bought_file: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(predict_command, "predict", interrupt)
    assert main(["predict", bought_file]) == 130
    assert "interrupted" in capsys.readouterr().err


def test_no_command_shows_the_help_and_is_bad_usage(capsys: Capture) -> None:
    assert main([]) == 2
    captured = capsys.readouterr()
    assert "predict" in captured.out
    assert captured.err.startswith("lostmotion: COMMAND: found none, expected ")
    assert captured.err.count("\n") == 1


def test_the_version_is_that_of_the_project(capsys: Capture) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"lostmotion {__version__}\n"
    top = (Path(__file__).parents[2] / "CMakeLists.txt").read_text()
    assert f"project(lostmotion VERSION {__version__} " in top


LIGHT = {
    "lostmotion",
    "lostmotion.cli",
    "lostmotion.commands",
    "lostmotion.commands.parser",
    "lostmotion.errors",
    "lostmotion.files",
    "lostmotion.first_use",
    "lostmotion.friction",
}
"""Modules of the package that help, version and error messages may import."""

HEAVY = {
    *("numpy", "scipy", "cffi", "threadpoolctl", "shtab"),
    *("pyarrow", "pandas", "dask", "distributed", "nicegui", "starlette", "plotly"),
}
"""Modules that take longer to import than these may take."""


def imported_by(*argv: str) -> tuple[int, set[str]]:
    """Status of a command in a separate Python process, and all that it imported."""
    code = (
        "import json, sys; from lostmotion.cli import main; status = main(sys.argv[1:]);"
        "print(json.dumps([status, sorted(sys.modules)]))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, *argv], capture_output=True, text=True, check=True
    )
    status, modules = json.loads(done.stdout.splitlines()[-1])
    return status, set(modules)


@pytest.mark.parametrize(
    ("argv", "status"),
    [
        (["--version"], 0),
        (["--help"], 0),
        (["diagnose", "--help"], 0),
        ([], 2),
        (["nonsense"], 2),
        (["predict"], 2),
        (["export", "drive.toml", "-o", "params.h", "--profile", "nonsense"], 2),
        (["predict", "drive.toml", "--json", "/"], 2),
    ],
)
def test_help_version_and_complaints_about_usage_import_nothing_heavy(
    argv: list[str], status: int
) -> None:
    found, modules = imported_by(*argv)
    assert found == status
    assert not modules & HEAVY
    assert {name for name in modules if name.split(".")[0] == "lostmotion"} == LIGHT


def test_the_package_alone_leads_to_its_modules() -> None:
    code = (
        "import lostmotion\n"
        "import sys\n"
        "assert not {'numpy', 'lostmotion.drives'} & set(sys.modules)\n"
        "assert {'read_drive', 'predict', '__version__'} <= set(dir(lostmotion))\n"
        "for name in lostmotion.MODULES:\n"
        "    assert getattr(lostmotion, name) is sys.modules[f'lostmotion.{name}']\n"
        "try:\n"
        "    lostmotion.read_dirve\n"
        "except AttributeError as error:\n"
        "    print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "module 'lostmotion' has no attribute 'read_dirve'\n"


def test_a_prediction_imports_nothing_of_fits_searches_and_pages(bought_file: str) -> None:
    _, modules = imported_by("predict", bought_file, "--quiet")
    assert "numpy" in modules
    assert not modules & (HEAVY - {"numpy", "cffi"})
    for room in ("demo", "design", "discover", "report", "workbench"):
        assert f"lostmotion.{room}" not in modules


def test_every_command_names_what_runs_it() -> None:
    for name, parser in commands().items():
        module, _, function = parser.get_default("run").partition(":")
        assert callable(getattr(importlib.import_module(module), function)), name


def test_the_choices_of_the_parser_are_those_of_what_runs() -> None:
    assert PROFILES == export.PROFILES
    assert JOINS == joining.JOINS
    assert SIDES == protocol.SIDES
    assert set(SHELLS) <= set(shtab.SUPPORTED_SHELLS)


def test_the_module_runs_as_a_command_and_survives_a_closed_pipe(drawn_file: str) -> None:
    command = [sys.executable, "-m", "lostmotion", "clearances", drawn_file]
    whole = subprocess.run(command, capture_output=True, text=True, check=True)
    assert len(whole.stdout.splitlines()) > 50
    read, write = os.pipe()
    os.close(read)
    closed = subprocess.run(command, stdout=write, stderr=subprocess.PIPE, text=True, check=False)
    os.close(write)
    assert closed.returncode == 1
    assert closed.stderr == ""


@pytest.mark.skipif(
    not Path("/dev/full").exists(), reason="no /dev/full on this system: no disk to be full"
)
def test_a_full_disk_behind_standard_output_is_one_line_and_status_1(drawn_file: str) -> None:
    command = [sys.executable, "-m", "lostmotion", "predict", drawn_file]
    with open("/dev/full", "w") as full:
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert (done.returncode, done.stderr) == (1, "lostmotion: No space left on device\n")


def test_too_little_memory_is_one_line_that_names_the_input(
    capsys: Capture, bought_file: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise MemoryError

    monkeypatch.setattr(predict_command, "predict", fail)
    assert main(["predict", bought_file]) == 2
    found = f"lostmotion: {bought_file}: found not enough memory to process it, expected "
    error = capsys.readouterr().err
    assert error.startswith(found)
    assert error.count("\n") == 1


def test_an_interrupted_process_leaves_with_130_and_no_file(tmp_path: Path) -> None:
    out = tmp_path / "a.json"
    drive = tmp_path / "drive.toml"
    os.mkfifo(drive)
    process = subprocess.Popen(
        [sys.executable, "-m", "lostmotion", "predict", str(drive), "--json", str(out)],
        stderr=subprocess.PIPE,
        text=True,
    )
    # Opening the pipe waits until the command reads from it: then the command is running.
    # A signal at a moment in which Python cannot raise is lost, as with a key: it is sent again.
    with drive.open("w"):
        for _ in range(6):
            process.send_signal(signal.SIGINT)
            with contextlib.suppress(subprocess.TimeoutExpired):
                _, error = process.communicate(timeout=10)
                break
    assert process.returncode == 130
    assert error == "lostmotion: interrupted\n"
    assert not out.exists()


def test_progress_is_drawn_on_a_terminal_only(
    capsys: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    with terminal.Progress("comparing") as progress:
        progress(1, 2)
    assert "comparing [###############...............] 1/2" in capsys.readouterr().err
    argv = ["replay", str(REAL / "drive.toml"), str(REAL)]
    assert main(argv) == 0
    assert "replaying [" in capsys.readouterr().err
    assert main([*argv, "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("command", sorted(commands()))
def test_every_command_has_help_with_an_example_json_quiet_and_verbose(
    capsys: Capture, command: str
) -> None:
    assert main([command, "--help"]) == 0
    said = capsys.readouterr().out
    assert f"example: lostmotion {command} " in said
    for option in ("--json", "--quiet", "--verbose"):
        assert option in said


def test_quiet_prints_nothing_but_the_json_that_was_asked_for(
    capsys: Capture, bought_file: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "answer.json"
    assert main(["predict", bought_file, "--quiet", "--json", str(out)]) == 0
    assert capsys.readouterr() == ("", "")
    assert json.loads(out.read_text())["drive"] == "joint 2"
    assert main(["predict", bought_file, "-q", "--json", "-"]) == 0
    assert json.loads(capsys.readouterr().out)["drive"] == "joint 2"
    assert main(["predict", "none.toml", "-q"]) == 2
    assert "no such file" in capsys.readouterr().err
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    with terminal.Progress("comparing", quiet=True) as progress:
        progress(1, 2)
    assert capsys.readouterr() == ("", "")
    assert main(["predict", bought_file, "-q", "-v"]) == 2
    assert "not allowed with" in capsys.readouterr().err


def test_verbose_states_on_standard_error_what_is_read_and_written(
    capsys: Capture, write: Write, bought_file: str, tmp_path: Path
) -> None:
    rows = "".join(f"{i},{i % 40},{1e-5 * (i % 40)},7\n" for i in range(200))
    data = write("time_s,torque_Nm,lost_motion_rad,extra\n" + rows, "data.csv")
    out = tmp_path / "answer.json"
    argv = ["compare", bought_file, str(data), "--json", str(out)]
    assert main([*argv, "--verbose"]) == 0
    loud = capsys.readouterr()
    for words in (
        f"read {bought_file}: joint 2, bought",
        f"read {data}: 200 rows in 1 runs",
        "extra: ignored column x 1: not used",
        f"wrote {out}",
    ):
        assert words in loud.err
    assert main(argv) == 0
    plain = capsys.readouterr()
    assert plain.err == ""
    assert plain.out == loud.out


@pytest.mark.parametrize("argv", [["--help"], ["predict", "--help"], ["predict", "{}"], ["x"]])
def test_nothing_is_coloured_in_a_pipe(bought_file: str, argv: list[str]) -> None:
    environment = {**os.environ, "TERM": "xterm-256color"}
    environment.pop("NO_COLOR", None)
    command = [sys.executable, "-m", "lostmotion", *(word.format(bought_file) for word in argv)]
    done = subprocess.run(command, capture_output=True, env=environment, check=False)
    assert b"\x1b" not in done.stdout + done.stderr


@pytest.mark.parametrize("shell", SHELLS)
def test_completion_scripts_contain_every_command(capsys: Capture, shell: str) -> None:
    found = answer(capsys, "completion", shell)
    assert found["shell"] == shell
    for command in commands():
        assert command in found["script"]
    assert main(["completion", shell]) == 0
    assert capsys.readouterr().out == found["script"] + "\n"


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash to complete in: apt install bash")
def test_bash_completes_commands_options_and_files(
    capsys: Capture, tmp_path: Path, bought_file: str
) -> None:
    assert main(["completion", "bash"]) == 0
    (tmp_path / "script").write_text(capsys.readouterr().out)

    def complete(*words: str) -> set[str]:
        quoted = " ".join(f"'{word}'" for word in words)
        text = (
            f"source ./script; COMP_WORDS=({quoted}); COMP_CWORD={len(words) - 1};"
            f" COMP_LINE='{' '.join(words)}'; COMP_POINT=${{#COMP_LINE}};"
            " _shtab_lostmotion lostmotion; printf '%s\\n' \"${COMPREPLY[@]}\""
        )
        done = subprocess.run(
            ["bash", "-c", text], capture_output=True, text=True, cwd=tmp_path, check=True
        )
        return set(done.stdout.split())

    assert complete("lostmotion", "pre") == {"predict"}
    assert "--torque" in complete("lostmotion", "predict", "--to")
    assert complete("lostmotion", "predict", "bou") == {"bought.toml"}
    assert "zsh" in complete("lostmotion", "completion", "z")
    (tmp_path / "bolts").mkdir()
    assert complete("lostmotion", "drawing", "-o", "bo") == {"bolts"}
    assert "bought.toml" in complete("lostmotion", "calibrate", bought_file, "bo")


@pytest.mark.parametrize("option", ["--plan", "--effects"])
def test_an_answer_does_not_go_where_a_plan_or_an_effect_is_read(
    capsys: Capture, tmp_path: Path, bought_file: str, option: str
) -> None:
    data, read = tmp_path / "data.csv", tmp_path / "read"
    read.write_text("kept")
    words = ["next", bought_file, str(data), "--plan", "plan.csv", option, str(read)]
    assert main([*words, "--json", str(read)]) == 2
    assert f"--json: found the input '{read}'" in capsys.readouterr().err
    assert read.read_text() == "kept"
