"""Files that failed for their owners have the answers of their clean copies.

The files are not part of the repository: `LOSTMOTION_CASES` names their folder, by default
``../shared/cases``. Without it the tests are skipped; `table.py` has logs with the same faults that
are always tested. The clean copy of most files is the first rows of `s_clean.csv`, so the expected
answer is computed from that file.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from .judge import COMMANDS, Outcome, numbers, refused_well, run

CASES = Path(os.environ.get("LOSTMOTION_CASES", Path(__file__).parents[3] / "shared" / "cases"))
CLEAN = "01-torque-dropout/s_clean.csv"
BOUGHT = "01-torque-dropout/size_25.toml"
RATIO = 100

pytestmark = pytest.mark.skipif(
    not CASES.is_dir(),
    reason="files of their owners, not in the repository: set LOSTMOTION_CASES to their folder",
)


@dataclass(frozen=True)
class Case:
    """A file with the same answer as `rows` rows of its clean copy.

    Attributes
    ----------
    file : str
        The file.
    rows : int, optional
        Number of rows of the clean copy; all of them by default.
    finding : str
        Words that a finding contains, in the order of the sentence.
    maps : tuple of str
        Words after ``--map``.
    drive, clean : str
        Drive file and clean copy.
    """

    file: str
    rows: int | None = None
    finding: str = ""
    maps: tuple[str, ...] = ()
    drive: str = BOUGHT
    clean: str = CLEAN


SAME = [
    Case("01-torque-dropout/s_tq0.csv", finding="torque_Nm (run 3 at 43 s): wild x 1"),
    Case("01-torque-dropout/s_tq655.csv", finding="torque_Nm (run 3 at 45.7 s): wild x 1"),
    Case("04-thousands/thou2.csv", 200, "separates thousands", ("ENC=lost_motion_urad",)),
    Case("05-delimiter/v_pipe.csv", 59),
    Case("05-delimiter/v_semi_header_with_comma.csv", 59, "note, free"),
    Case("05-delimiter/v_sep_line.csv", 58),
    Case("06-preamble/v_labview_header.csv", 55),
    Case("06-preamble/v_metadata_lines.csv", 55),
    Case("06-preamble/v_percent_comment.csv", 58),
    Case("07-units-row/v_units_row.csv", 58),
    Case("08-encoding/v_cp1252_deg.csv", 400),
    Case("09-duplicate-columns/v_dup_header.csv", 59, "the columns spare"),
    Case("09-duplicate-columns/v_dup_unmapped_foreign.csv", 59, "the columns effort"),
    Case("09-duplicate-columns/v_empty_headers.csv", 59),
    Case("10-torn-lines/v_mid_garbage.csv", 400, "line 52 ('ESP_ERROR: brownout detected')"),
    Case("10-torn-lines/v_nul_tail.csv", 400, "line 402 ('NUL bytes')"),
    Case("10-torn-lines/v_rows_trailing_comma.csv", 400),
    Case("10-torn-lines/v_truncated_last.csv", 399, "line 401 ('2,39.900,-3.76')"),
    Case("11-iso-time/v_T_hms_mapped.csv", 59),
    Case("11-iso-time/v_T_hms_mapped.csv", 59, maps=("Time=time_s",)),
    Case("11-iso-time/v_T_iso_Z_mapped.csv", 59),
    Case("11-iso-time/v_T_iso_Z_mapped.csv", 59, maps=("timestamp=time_s",)),
    Case("12-ros-stamp/v_ros2_sec_nanosec.csv", 59,
         maps=("effort=torque_Nm", "lm=lost_motion_rad")),
    Case("29-bad-temperature/k_temp85_1.csv.gz",
         finding="temperature_C (run 17 at 106.814 s): wild x 1",
         drive="29-bad-temperature/joint.toml", clean="29-bad-temperature/k_clean.csv.gz"),
]  # fmt: skip


def four(file: Path, drive: str, maps: tuple[str, ...] = ()) -> dict[str, Outcome]:
    """Outcome of every command."""
    return {
        command: run(command, [file], maps, drive=CASES / drive, add=()) for command in COMMANDS
    }


def text_of(outcomes: dict[str, Outcome]) -> str:
    """Findings of ``check`` in one text."""
    return "; ".join(map(str, outcomes["check"].answer["findings"]))


def first_rows(name: str, rows: int, folder: Path) -> Path:
    """First rows of a clean copy."""
    file = folder / "clean.csv"
    file.write_text("".join((CASES / name).read_text().splitlines(keepends=True)[: rows + 1]))
    return file


@pytest.mark.parametrize("case", SAME, ids=lambda case: case.file + "".join(case.maps))
def test_a_file_has_the_answer_of_its_clean_copy(case: Case, tmp_path: Path) -> None:
    clean = CASES / case.clean if case.rows is None else first_rows(case.clean, case.rows, tmp_path)
    found, right = four(CASES / case.file, case.drive, case.maps), four(clean, case.drive)
    for command in COMMANDS:
        assert (found[command].status, found[command].trace) == (0, ""), found[command].error
        values, same = numbers(command, found[command].answer)
        expected, expected_same = numbers(command, right[command].answer)
        assert same == expected_same, command
        assert values == pytest.approx(expected, rel=0.02), command
    assert case.finding in text_of(found)
    assert bool(found["check"].answer["findings"]) == bool(case.finding)


def test_a_column_without_a_unit_is_refused_in_one_line() -> None:
    for name in ("04-thousands/thou2.csv", "14-int16-overflow/ovf.csv"):
        for command, outcome in four(CASES / name, BOUGHT).items():
            assert not (bad := refused_well(outcome, ["ENC"])), (name, command, bad)


def test_overflows_of_16_bits_are_removed_and_nothing_else_is_found() -> None:
    found = four(CASES / "14-int16-overflow/ovf.csv", BOUGHT, ("ENC=input_angle_rev/4000",))
    assert [outcome.status for outcome in found.values()] == [0] * 4
    assert "wrap x 12: overflows of 2^16 counts (16.384 turns each) removed" in text_of(found)
    assert found["check"].answer["samples"] == 6000
    # One count of the input encoder is 3.2 arcsec of lost motion; the loop has 200.
    assert found["compare"].answer["rms_arcsec"] < 3.2
    assert found["diagnose"].answer["effects"] == []


def test_fifteen_points_of_a_torque_wrench_are_inconclusive_and_one_is_refused() -> None:
    found = four(CASES / "20-hand-test/wrench.csv", BOUGHT)
    assert [outcome.status for outcome in found.values()] == [0] * 4
    assert found["diagnose"].answer["verdict"] == "inconclusive"
    few = four(CASES / "20-hand-test/few.csv", BOUGHT)
    for command in COMMANDS[1:]:
        assert not (bad := refused_well(few[command], ["torque_Nm"])), (command, bad)


def test_rows_without_torque_are_counted() -> None:
    found = four(CASES / "22-replay-dropout/rn.csv", BOUGHT)
    assert [outcome.status for outcome in found.values()] == [0] * 4
    assert "torque_Nm (run rn): nan x 99" in text_of(found)
    assert found["check"].answer["samples"] == 1901
    assert found["diagnose"].answer["effects"] == []


def test_an_operator_without_load_dependence_needs_no_effect() -> None:
    found = four(CASES / "28-play-outside/play_12_8_12.csv", BOUGHT)
    answer = found["diagnose"].answer
    assert (answer["verdict"], answer["effects"]) == ("complete", [])


def test_encoders_of_several_turns_are_not_changed() -> None:
    found = four(CASES / "30-multi-turn-dwell/cont.csv", "30-multi-turn-dwell/d100.toml")
    assert [outcome.status for outcome in found.values()] == [0] * 4
    assert not text_of(found)
    assert found["compare"].answer["rms_arcsec"] < 0.01
    assert found["diagnose"].answer["effects"] == []


def test_one_run_with_a_temperature_is_inconclusive() -> None:
    found = four(CASES / "31-one-run-temperature/crash.csv", "31-one-run-temperature/drive.toml")
    assert [(outcome.status, outcome.trace) for outcome in found.values()] == [(0, "")] * 4
    assert found["diagnose"].answer["verdict"] == "inconclusive"


def test_a_dead_zone_that_depends_on_temperature_is_named() -> None:
    folder = "32-dead-zone-temperature"
    found = four(CASES / folder / "bench.csv.gz", f"{folder}/joint.toml")
    assert [outcome.status for outcome in found.values()] == [0] * 4
    answer: dict[str, Any] = found["diagnose"].answer
    assert (answer["effects"], answer["events"]) == (["thermal_gap"], [])
