"""Damaged inputs: a correct result, or status 2 with one clear line and no output file.

The cases come from tests/fuzz/damaged_inputs.py, which runs any number of them. Below them is each
kind of damage that once had another result.
"""

from __future__ import annotations

import contextlib
import gc
import gzip
import os
from collections.abc import Callable
from pathlib import Path

import damaged_inputs
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import sound_files

from conftest import BOUGHT, DRAWN
from lostmotion.cli import main
from lostmotion.drives import format_toml, read_drive
from lostmotion.errors import InputError, one_line
from lostmotion.files import check_place, write_whole
from lostmotion.recordings import read_campaign

CHUNKS, CHUNK = 4, 40
HEADER = "time_s,torque_Nm,lost_motion_rad\n"

Write = Callable[..., Path]


@pytest.mark.parametrize("chunk", range(CHUNKS))
def test_damaged_inputs_are_refused_or_answered_rightly(tmp_path: Path, chunk: int) -> None:
    numbers = range(chunk * CHUNK, (chunk + 1) * CHUNK)
    wrong = [
        f"case {number}: {' '.join(case.argv)} ({case.damage}): {complaint}"
        for number, case, complaint, _ in damaged_inputs.failures(7, numbers, tmp_path)
        if complaint
    ]
    assert not wrong, "\n".join(wrong)


def test_damaged_inputs_as_processes_of_their_own(tmp_path: Path) -> None:
    for number, case, complaint, _ in damaged_inputs.failures(8, range(6), tmp_path, 1):
        assert not complaint, (number, case, complaint)


def test_the_judge_finds_tracebacks_warnings_and_written_files(tmp_path: Path) -> None:
    case = damaged_inputs.Case(["predict"], "none", harmless=True)
    before = damaged_inputs.snapshot(tmp_path)

    def judge(status: int | str, error: str = "", warned: str = "", trace: str = "") -> str:
        outcome = damaged_inputs.Outcome(status, error, [warned] if warned else [], trace)
        return damaged_inputs.judge(case, "predict", outcome, before, tmp_path, {})

    line = "lostmotion: a.toml: found x, expected y\n"
    assert judge("ValueError", trace="Traceback").startswith("Traceback")
    assert judge(0, warned="RuntimeWarning") == "RuntimeWarning"
    assert judge(1, line).startswith("status 1")
    assert judge(2, line + line).startswith("2 lines")
    assert judge(2, "lostmotion: no\n").startswith("not a clear line")
    assert judge(2, line).startswith("harmless, but refused")
    assert judge(0) == "no answer"
    (tmp_path / "left.json").write_text("")
    assert judge(2, line) == "status 2, but files were written"
    assert "add up" in damaged_inputs.judge_prediction(
        {"total_arcmin": [0.0, 2.0], "parts_arcmin": {"torsion": [0.0, 1.0]}}
    )
    assert "falls" in damaged_inputs.judge_prediction(
        {"total_arcmin": [1.0, 0.0], "parts_arcmin": {"torsion": [1.0, 0.0]}}
    )


@pytest.mark.parametrize(
    ("damage", "expected"),
    [
        ("x = " + "[" * 2000 + "]" * 2000, "tables nested too deeply"),
        ("x = " + "9" * 5000, "digits"),
        ("\ud800", "not UTF-8"),
    ],
)
def test_a_drive_file_that_breaks_the_toml_reader_is_refused(
    tmp_path: Path, damage: str, expected: str
) -> None:
    file = tmp_path / "drive.toml"
    file.write_bytes((damage + "\n" + format_toml(BOUGHT)).encode(errors="surrogatepass"))
    with pytest.raises(InputError, match=expected):
        read_drive(file)


def test_a_byte_order_mark_before_a_drive_file_is_ignored(tmp_path: Path) -> None:
    file = tmp_path / "drive.toml"
    file.write_bytes(b"\xef\xbb\xbf" + format_toml(BOUGHT).replace("\n", "\r\n").encode())
    assert read_drive(file).document == BOUGHT


def test_the_kind_of_a_chain_member_may_not_be_a_table(write: Write) -> None:
    design = {**DRAWN["design"], "radial_chain": [{"kind": {"ball": 1}}]}
    with pytest.raises(InputError, match=r"radial_chain\[0\]\.kind: found a table"):
        read_drive(write(DRAWN | {"design": design}))


def test_integers_beyond_those_of_the_library_are_refused(write: Write) -> None:
    link = {"kind": "hole", "zone": "teeth", "it_grade": 10**12, "nominal_mm": 36}
    design = {**DRAWN["design"], "tolerance": [link]}
    with pytest.raises(InputError, match="it_grade: found 1000000000000, expected an integer"):
        read_drive(write(DRAWN | {"design": design}))


def test_a_design_whose_teeth_end_before_they_meet_is_bad_input(
    capsys: pytest.CaptureFixture[str], write: Write
) -> None:
    teeth = {**DRAWN["design"]["teeth"], "rigid_shift": 5.914}
    file = write(DRAWN | {"design": {**DRAWN["design"], "teeth": teeth}})
    assert main(["predict", str(file)]) == 2
    error = capsys.readouterr().err
    assert f"{file}: design.teeth.tooth_height: found " in error
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("name", "content", "expected"),
    [
        (
            "a.csv",
            HEADER + "0,1e300,0\n",
            r"torque_Nm: found 1e\+300 Nm in line 2, expected -1e\+06",
        ),
        ("a.csv", HEADER + "0,1,0\n1e300,2,0\n", r"time_s: found 1e\+300 s in line 3"),
        ("a.csv", "x" * 200_000 + "," + HEADER + "1,0,1,0\n", "field larger than field limit"),
        ("a.csv", "time_s,torque_Nm,lost_motion_rad,temperature_F\n0,1,0,-500\n", "temperature_F"),
    ],
)
def test_recordings_beyond_any_drive_are_refused(
    tmp_path: Path, name: str, content: str, expected: str
) -> None:
    (tmp_path / name).write_text(content)
    with pytest.raises(InputError, match=expected):
        read_campaign(tmp_path / name)


@pytest.mark.parametrize("label", ["1e300", "-1e20", "9007199254740993"])
def test_run_labels_beyond_integers_stay_what_they_are(tmp_path: Path, label: str) -> None:
    (tmp_path / "a.csv").write_text(f"run,{HEADER}{label},0,1,0\n1.0,0,1,0\n")
    assert len(read_campaign(tmp_path / "a.csv").runs) == 2


def test_runs_whose_torque_never_moves_are_compared_without_a_warning(tmp_path: Path) -> None:
    table = sound_files.recording()
    for row in table[1:82]:
        row[2] = "-1.0"
    drive = sound_files.bought()
    (tmp_path / "drive.toml").write_text(format_toml(drive))
    (tmp_path / "data.csv").write_text(sound_files.csv_text(table))
    words = ["compare", str(tmp_path / "drive.toml"), str(tmp_path / "data.csv"), "-q"]
    outcome = damaged_inputs.run_here(words)
    assert (outcome.status, outcome.warnings, outcome.error) == (0, [], "")


def test_a_fit_on_no_run_at_all_is_refused(tmp_path: Path, write: Write) -> None:
    data = tmp_path / "data.csv"
    data.write_text(sound_files.csv_text(sound_files.recording()))
    outcome = damaged_inputs.run_here(["compare", str(write(BOUGHT)), str(data), "--fit-on", ""])
    assert (outcome.status, outcome.trace) == (2, "")
    assert outcome.error == "lostmotion: --fit-on: found no such run, expected one of 0, 1, 2\n"


def test_a_plan_without_rows_is_refused(tmp_path: Path, write: Write) -> None:
    plan = tmp_path / "plan.parquet"
    header, *_ = sound_files.recording()
    pq.write_table(pa.table({name: pa.array([], pa.float64()) for name in header}), plan)
    outcome = damaged_inputs.run_here(["forecast", str(write(BOUGHT)), str(plan)])
    assert (outcome.status, outcome.trace) == (2, "")
    assert outcome.error == f"lostmotion: {plan}: found no rows, expected a planned run\n"


def test_a_gzip_with_a_turned_bit_is_refused(tmp_path: Path) -> None:
    packed = bytearray(
        gzip.compress((HEADER + "".join(f"{i},1,2\n" for i in range(99))).encode(), mtime=0)
    )
    for bit in range(8 * len(packed)):
        packed[bit // 8] ^= 1 << bit % 8
        (tmp_path / "a.csv.gz").write_bytes(packed)
        packed[bit // 8] ^= 1 << bit % 8
        with contextlib.suppress(InputError):
            assert read_campaign(tmp_path / "a.csv.gz").rows == 99


@pytest.mark.parametrize("path", ["a\0b", "n" * 300, "folder", "none/a.json", "file/a.json", ""])
def test_places_that_cannot_be_written_to_are_refused_before_any_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, path: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="--json"):
        check_place("--json", path)


def test_a_folder_without_leave_to_write_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "access", lambda *_: False)
    with pytest.raises(InputError, match="cannot be written to"):
        check_place("--json", tmp_path / "a.json")


def test_a_path_that_no_system_has_is_refused_by_reader_and_writer(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="null byte"):
        write_whole(tmp_path / "a\0b", "x")
    with pytest.raises(InputError, match=r"null byte|no such file"):
        read_drive(tmp_path / "a\0b")
    with pytest.raises(InputError, match=r"too long|no such file"):
        read_campaign(tmp_path / ("n" * 300 + ".csv"))
    os.mkfifo(tmp_path / "pipe.csv")
    with pytest.raises(InputError, match="neither a file nor a folder"):
        read_campaign(tmp_path / "pipe.csv")


def test_messages_can_be_shown_on_any_terminal() -> None:
    assert one_line("a\nb\tc") == "a b c"
    assert one_line("a\x1b[31m\x00\udcff") == r"a\x1b[31m\x00\udcff"
    error = InputError("f", "k", "x" * 10_000, "y")
    assert len(str(error)) < 400


def test_a_report_may_quote_a_file_name_that_is_no_text(tmp_path: Path) -> None:
    write_whole(tmp_path / "a.html", "in\udcffvalid")
    assert (tmp_path / "a.html").read_bytes() == rb"in\udcffvalid"


@pytest.mark.parametrize("command", ["diagnose", "fit", "forecast"])
@pytest.mark.parametrize(
    ("rows", "expected"),
    [
        ([(0.0, 1.0), (0.1, 2.0), (0.2, -1.0)], "found 3 samples, expected at least 50"),
        ([(0.1 * i, 3.0) for i in range(80)], "torque_Nm: found a constant 3 Nm"),
    ],
)
def test_recordings_that_no_base_can_be_fitted_to_are_refused(
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    write: Write,
    command: str,
    rows: list[tuple[float, float]],
    expected: str,
) -> None:
    data = tmp_path / "data.csv"
    data.write_text(HEADER + "".join(f"{t},{torque},{torque * 3e-5}\n" for t, torque in rows))
    words = [command, str(write(BOUGHT)), str(data)]
    if command == "fit":
        words += ["-o", str(tmp_path / "fitted.toml")]
    assert main(words) == 2
    assert expected in capsys.readouterr().err
    assert not (tmp_path / "fitted.toml").exists()


def test_runs_of_a_few_samples_among_others_are_no_harm(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, write: Write
) -> None:
    table = sound_files.recording()
    for row in table[-3:]:
        row[0] = "9"
    data = tmp_path / "data.csv"
    data.write_text(sound_files.csv_text(table))
    assert main(["diagnose", str(write(BOUGHT)), str(data), "--json", "-"]) == 0
    assert '"runs": 4' in capsys.readouterr().out


@pytest.mark.parametrize("name", ["n" * 300 + ".npz", "a\0b.npz", ".", "cut.npz", "none.npz"])
def test_evidence_that_cannot_be_read_is_refused_without_a_warning(
    tmp_path: Path, name: str
) -> None:
    whole = sound_files.made("evidence")["one.npz"]
    (tmp_path / "cut.npz").write_bytes(whole[: len(whole) // 2])
    outcome = damaged_inputs.run_here(["merge", f"{tmp_path}/{name}"])
    gc.collect()
    assert (outcome.status, outcome.warnings) == (2, [])
    assert outcome.error.count("\n") == 1


@pytest.mark.parametrize("length", [64, 250, 300])
def test_an_effect_whose_name_no_file_can_have_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, length: int
) -> None:
    monkeypatch.chdir(tmp_path)
    outcome = damaged_inputs.run_here(["effects", "new", "a" * length])
    assert outcome.status == 2, outcome
    assert outcome.error == (
        f"lostmotion: NAME: found one of {length} characters, expected a name of at most 63 "
        "characters\n"
    )
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix", [".py", ".so"])
@pytest.mark.parametrize("name", ["n" * 300, "none", "a\0b"])
def test_effects_that_cannot_be_read_are_refused(tmp_path: Path, name: str, suffix: str) -> None:
    outcome = damaged_inputs.run_here(["effects", "--effects", f"{tmp_path}/{name}{suffix}"])
    assert outcome.status == 2, outcome
    assert outcome.error.count("\n") == 1
