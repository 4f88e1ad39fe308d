"""Recordings: other names by a map, units converted, and every fault reported."""

from __future__ import annotations

import gzip
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from conftest import DATA
from lostmotion.arrays import FloatArray
from lostmotion.errors import InputError
from lostmotion.recordings import Campaign, check_scale, parse_map, read_campaign
from lostmotion.recordings.encoders import unwrap
from lostmotion.recordings.gate import check_encoders
from lostmotion.sample import sample_campaign
from lostmotion.units import ARCMIN, convert

Write = Callable[..., Path]

HEAD = "time_s,torque_Nm,lost_motion_rad"
ROWS = "0,0,0\n0.1,1,1e-4\n0.2,2,2e-4\n0.3,1,1.2e-4\n"


def kinds(campaign: Campaign) -> dict[str, int]:
    return {finding.kind: finding.count for finding in campaign.findings}


def test_a_plain_file_is_one_run_named_after_it(write: Write) -> None:
    campaign = read_campaign(write(f"{HEAD}\n{ROWS}", "cold.csv"))
    (run,) = campaign.runs
    assert (run.label, len(run), campaign.findings) == ("cold", 4, [])
    np.testing.assert_allclose(run.torque_Nm, [0, 1, 2, 1])
    np.testing.assert_allclose(run.lost_motion_rad, [0, 1e-4, 2e-4, 1.2e-4])
    assert campaign.quantities() == ("time", "torque", "lost_motion")


def test_a_folder_is_read_by_the_numbers_in_its_names(write: Write) -> None:
    folder = write(f"{HEAD}\n{ROWS}", "run_10.csv").parent
    for name in ("run_9.csv", "run_2.csv", "run_2b.csv", "note_11.csv", "run_1.csv"):
        write(f"{HEAD}\n{ROWS}", name)
    labels = [run.label for run in read_campaign(folder).runs]
    assert labels == ["note_11", "run_1", "run_2", "run_2b", "run_9", "run_10"]


def test_units_in_the_suffix_are_converted(write: Write) -> None:
    text = "time_ms,torque_mNm,lost_motion_arcmin,temperature_K,tilt_moment_Ncm\n" + (
        "0,1000,1,293.15,100\n1000,2000,2,303.15,200\n"
    )
    (run,) = read_campaign(write(text, "a.csv")).runs
    np.testing.assert_allclose(run.time_s, [0, 1])
    np.testing.assert_allclose(run.torque_Nm, [1, 2])
    np.testing.assert_allclose(run.lost_motion_rad, [ARCMIN, 2 * ARCMIN])
    np.testing.assert_allclose(run.columns["temperature"], [20, 30])
    np.testing.assert_allclose(run.columns["tilt_moment"], [1, 2])


def test_units_in_brackets_are_units(write: Write) -> None:
    head = "Time [ms],Torque (N·m),Lost motion [arcmin],Temperature [°C],Motor [A],Input-angle [°]"
    campaign = read_campaign(write(f"{head}\n0,1,2,3,4,90\n10,2,3,4,5,180\n", "a.csv"))
    (run,) = campaign.runs
    np.testing.assert_allclose(run.time_s, [0, 0.01])
    np.testing.assert_allclose(run.torque_Nm, [1, 2])
    np.testing.assert_allclose(run.lost_motion_rad, [2 * ARCMIN, 3 * ARCMIN])
    np.testing.assert_allclose(run.columns["temperature"], [3, 4])
    np.testing.assert_allclose(run.columns["input_angle"], [np.pi / 2, np.pi])
    assert kinds(campaign)["ignored_column"] == 1
    with pytest.raises(InputError, match=r"Torque \[kg\].*unit 'kg'"):
        read_campaign(write("Time [s],Torque [kg],Lost motion [rad]\n0,1,1\n", "b.csv"))


def test_lost_motion_is_output_minus_input_over_ratio(write: Write) -> None:
    text = "time_s,torque_Nm,input_angle_rev,output_angle_deg\n0,1,0,0\n1,2,0.5,-1\n2,3,1,-2\n"
    (run,) = read_campaign(write(text, "a.csv"), ratio=-100).runs
    # -1 deg - 0.5 * 360 deg / -100 = 0.8 deg
    np.testing.assert_allclose(np.degrees(run.lost_motion_rad), [0, 0.8, 1.6], atol=1e-12)


@pytest.mark.parametrize(
    ("head", "parts"),
    [
        ("torque_Nm,lost_motion_rad", ("time_s", "no such column", "--map COLUMN=time_s")),
        (
            "time_s,lost_motion_rad",
            ("torque_Nm", "no such column (there are time_s, lost_motion_rad)"),
        ),
        (
            "time_s,torque_Nm",
            ("lost_motion_rad: found no such column (there are time_s", "input_angle_rad and"),
        ),
        (
            "t,temperature_C",
            (
                "time_s, torque_Nm, lost_motion_rad: found no such column (there are t, temp",
                "expected time_s, or --map COLUMN=time_s; torque_Nm, or --map COLUMN=torque_Nm; "
                "input_",
            ),
        ),
        (
            "time,torque,angle_rad",
            ("time, torque, lost_motion_rad: found time: no unit; torque: no unit; lost_motion_r",),
        ),
        ("time_s,torque_Nm,input_angle_rad", ("lost_motion_rad", "only input_angle")),
        ("time_s,torque,lost_motion_rad", ("torque:", "no unit", "--map torque=torque_Nm")),
        ("time_s,torque_rad,lost_motion_rad", ("torque_rad", "unit 'rad'", "an angle", "a torque")),
        ("time_s,torque_Nmx,lost_motion_rad", ("torque_Nmx", "unknown unit 'Nmx'", "a torque")),
        ("time_s,torque_Nm,torque_mNm,lost_motion_rad", ("torque_mNm", "a second time", "once")),
        ("time_s,torque_Nm,torque_Nm,lost_motion_rad", ("torque_Nm", "the column twice")),
        ("time_s,torque_Nm,lost_motion_rad,cycles_rev", ("cycles_rev", "unit 'rev'", "no unit")),
        ("time_s,torque_Nm,lost_motion_rad,temperature", ("temperature", "no unit", "C, K or F")),
        (
            "time_s,torque_Nm,lost_motion_rad,temperature_setpoint",
            (
                "unknown unit 'setpoint'",
                "C, K or F); if the column is another quantity, --map temperature_setpoint=unused",
            ),
        ),
        (
            "time_s,brake torque [Nm],sensor torque [Nm],lost_motion_rad",
            ("--map COLUMN=torque_Nm in its unit ('brake torque [Nm]', 'sensor torque [Nm]')",),
        ),
        (
            "time [s],a [Nm],b [Nm],c [Nm],d [Nm],e [Nm],v [rad],w [rad],x [rad],y [rad],z [rad]",
            (
                "in its unit ('a [Nm]', 'b [Nm]', 'c [Nm]', 'd [Nm]' and 1 more)",
                "(angles: 'v [rad]', 'w [rad]', 'x [rad]', 'y [rad]' and 1 more)",
            ),
        ),
    ],
)
def test_a_wrong_header_names_file_column_and_what_was_expected(
    write: Write, head: str, parts: tuple[str, ...]
) -> None:
    columns = head.count(",") + 1
    file = write(head + "\n" + ",".join("1" * columns) + "\n", "bad.csv")
    with pytest.raises(InputError) as caught:
        read_campaign(file)
    message = str(caught.value)
    assert message.startswith(str(file))
    for part in parts:
        assert part in message


@pytest.mark.parametrize("read", [read_campaign, sample_campaign])
@pytest.mark.parametrize("name", ["motor_torque_command", "temperature_setpoint"])
def test_a_column_of_another_quantity_can_be_left_out(
    write: Write, read: Callable[..., Campaign], name: str
) -> None:
    """A torque of the motor is only needed with a locked output; others a map leaves out."""
    file = write(f"{HEAD},{name}\n0,1,1e-4,7\n1,2,2e-4,7\n", "a.csv")
    mapping = {} if name.startswith("motor") else parse_map([f"{name}=unused"])
    campaign = read([file], mapping=mapping)
    assert campaign.runs[0].columns.keys() == {"time", "torque", "lost_motion"}
    assert f"{file}: {name}: ignored column x 1: not used" in map(str, campaign.findings)


def test_two_angles_need_the_ratio(write: Write) -> None:
    text = "time_s,torque_Nm,input_angle_rad,output_angle_rad\n0,1,2,3\n"
    with pytest.raises(InputError, match="no ratio, expected the ratio, which a drive file states"):
        read_campaign(write(text, "a.csv"))


@pytest.mark.parametrize(
    ("content", "part"),
    [
        ("", "an empty file"),
        ("# only a comment\n\n", "an empty file"),
        (f"{HEAD}\n", "no rows"),
        ("-0.5\n-14.2\n0.6\n", r"one number in a line \(line 1\), expected a line for every"),
        (f"{HEAD}\n0,1\n", r"2 fields in line 2, expected 3, as in the header \(line 1\)"),
        (f"{HEAD}\n0,1,2\n0,x,2\n", "torque_Nm: found 'x' in line 3, expected a number"),
        (f"{HEAD}\n0,,2\n1,,3\n", "no row with numbers"),
        (f"run,{HEAD}\n1,0,1,2\n,0,1,2\n", "run: found no label in line 3"),
    ],
)
def test_a_broken_file_is_refused(write: Write, content: str, part: str) -> None:
    with pytest.raises(InputError, match=part):
        read_campaign(write(content, "bad.csv"))


@pytest.mark.parametrize(
    ("name", "content", "part"),
    [
        ("a.csv.gz", b"not gzip", "unreadable gzip"),
        ("a.csv", b"\xff\xfe\x00", "an empty file"),
        ("a.parquet", b"PAR0", "unreadable Parquet"),
        ("a.xlsx", b"", "a file 'a.xlsx'"),
    ],
)
def test_bytes_of_another_kind_are_refused(
    tmp_path: Path, name: str, content: bytes, part: str
) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=part):
        read_campaign(tmp_path / name)


def test_missing_files_and_empty_folders_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_campaign(tmp_path / "none.csv")
    with pytest.raises(InputError, match="no recording"):
        read_campaign(tmp_path)
    with pytest.raises(InputError, match="at least one recording"):
        read_campaign([])


def test_a_map_reads_foreign_columns_and_can_turn_a_sign(write: Write) -> None:
    text = "TIME;POSITION;TORQUE;test_nr\n0;0;0;1\n1;-0.25;-2;1\n2;-0.5;-4;2\n3;-0.5;-4;2\n"
    mapping = parse_map(
        ["TIME=time_s", "POSITION=-lost_motion_rev", "TORQUE=-torque_Nm", "test_nr=run"]
    )
    campaign = read_campaign(write(text, "a.csv"), mapping=mapping)
    assert [run.label for run in campaign.runs] == [1, 2]
    np.testing.assert_allclose(campaign.column("torque"), [0, 2, 4, 4])
    np.testing.assert_allclose(campaign.column("lost_motion"), [0, np.pi / 2, np.pi, np.pi])


def test_a_map_reads_the_counts_of_an_encoder(write: Write) -> None:
    text = "T,MOTOR,OUT,M\n0,4000,0.35,1\n1,4090,0.4292,2\n2,90,0.5137,3\n"
    entries = ["T=time_s", "MOTOR=-input_angle_rev/4.096e3"]
    entries += ["OUT=output_angle_deg", "M=torque_Nm"]
    campaign = read_campaign(write(text, "a.csv"), mapping=parse_map(entries), ratio=-100)
    turns = campaign.column("input_angle") / (-2 * np.pi)
    np.testing.assert_allclose(turns, np.array([4000, 4090, 4186]) / 4096)
    assert kinds(campaign) == {"wrap": 1}


@pytest.mark.parametrize(
    ("entries", "part"),
    [
        (["TORQUE"], "no COLUMN=NAME_UNIT"),
        (["T=torque_Nm", "T=time_s"], "the column twice"),
    ],
)
def test_a_wrong_map_entry_is_refused(entries: list[str], part: str) -> None:
    with pytest.raises(InputError, match=part):
        parse_map(entries)


@pytest.mark.parametrize(
    ("entry", "part"),
    [
        ("torqe=torque_Nm", "no such column .*did you mean 'torque'"),
        ("torque=torque", "no unit"),
        ("torque=torque_Nm/0", "'/0' in --map"),
        ("torque=torque_Nm/1e999", "'/1e999' in --map"),
        ("torque=torque_Nm/x", "unknown unit 'Nm/x'"),
        ("torque=torque_deg", "unit 'deg'"),
        ("torque=torqe_Nm", "did you mean 'torque_Nm'"),
    ],
)
def test_a_map_to_nothing_known_is_refused(write: Write, entry: str, part: str) -> None:
    file = write("time_s,torque,lost_motion_rad\n0,1,2\n", "a.csv")
    with pytest.raises(InputError, match=part):
        read_campaign(file, mapping=parse_map([entry]))


@pytest.mark.parametrize("read", [read_campaign, sample_campaign])
def test_a_map_counts_in_the_files_that_have_its_column(
    write: Write, read: Callable[..., Campaign]
) -> None:
    folder = write(f"{HEAD}\n0,1,1e-4\n1,2,2e-4\n", "a.csv").parent
    write("time_s,TRQ,lost_motion_rad\n0,3000,3e-4\n1,4000,4e-4\n", "b.csv")
    write("time_s,M,lost_motion_rad\n0,-5,5e-4\n1,-6,6e-4\n", "c.csv")
    mapping = parse_map(["TRQ=torque_mNm", "M=-torque_Nm"])
    campaign = read([folder], mapping=mapping)
    np.testing.assert_allclose(campaign.column("torque"), [1, 2, 3, 4, 5, 6])
    assert campaign.findings == []


@pytest.mark.parametrize("read", [read_campaign, sample_campaign])
def test_a_map_of_a_column_that_no_file_has_is_refused(
    write: Write, read: Callable[..., Campaign]
) -> None:
    folder = write(f"{HEAD},temp\n{ROWS.replace(chr(10), ',20' + chr(10))}", "a.csv").parent
    write(f"{HEAD}\n{ROWS}", "b.csv")
    with pytest.raises(InputError) as caught:
        read([folder], mapping=parse_map(["temo=temperature_C"]))
    assert str(caught.value) == (
        f"{folder / 'a.csv'} and 1 more file: temo: found no such column (there are time_s, "
        "torque_Nm, lost_motion_rad, temp), expected the column that the map temo=temperature_C "
        "names (did you mean 'temp'?)"
    )


def test_a_file_with_neither_the_column_nor_the_map_s_source_is_refused(write: Write) -> None:
    folder = write("time_s,TRQ,lost_motion_rad\n0,3,3e-4\n1,4,4e-4\n", "a.csv").parent
    write("time_s,TORQ,lost_motion_rad\n0,3,3e-4\n1,4,4e-4\n", "b.csv")
    with pytest.raises(InputError) as caught:
        read_campaign(folder, mapping={"TRQ": "torque_Nm"})
    assert str(caught.value) == (
        f"{folder / 'b.csv'}: torque_Nm: found no such column (there are time_s, TORQ, "
        "lost_motion_rad), expected torque_Nm, TRQ by the map, or --map TORQ=torque_Nm"
    )


@pytest.mark.parametrize("read", [read_campaign, sample_campaign])
def test_a_quantity_that_only_some_runs_have_is_reported(
    write: Write, read: Callable[..., Campaign]
) -> None:
    folder = write(f"{HEAD},temperature_C\n0,1,1e-4,20\n1,2,2e-4,21\n", "a.csv").parent
    write(f"{HEAD}\n{ROWS}", "b.csv")
    campaign = read([folder])
    assert campaign.quantities() == ("time", "torque", "lost_motion")
    assert list(map(str, campaign.findings)) == [
        f"{folder / 'b.csv'}: temperature_C (run b): missing x 4: only other runs have the column; "
        "not used"
    ]


def test_a_map_wins_over_a_column_of_that_name(write: Write) -> None:
    file = write("time_s,torque_Nm,command_Nm,lost_motion_rad\n0,1,5,0\n1,2,6,1\n", "a.csv")
    campaign = read_campaign(file, mapping={"command_Nm": "torque_Nm"})
    np.testing.assert_allclose(campaign.column("torque"), [5, 6])
    assert kinds(campaign) == {"ignored_column": 1}


def test_columns_that_are_not_used_are_listed(write: Write) -> None:
    file = write(f"{HEAD},note,torque_raw,temperature_motor_C\n0,1,2,hot,7,8\n", "a.csv")
    campaign = read_campaign(file)
    names = [f.column for f in campaign.findings if f.kind == "ignored_column"]
    assert sorted(names) == ["note", "temperature_motor_C", "torque_raw"]


def test_formats_and_names_do_not_change_the_fingerprint(tmp_path: Path) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    text = f"run,{HEAD}\n" + "".join(f"{i // 5},{i},{i % 3},{i * 1e-5!r}\n" for i in range(10))
    (tmp_path / "a.csv").write_text(text)
    (tmp_path / "b.csv.gz").write_bytes(gzip.compress(("\ufeff# made by hand\n" + text).encode()))
    columns = {
        "run": [i // 5 for i in range(10)],
        "time_s": [float(i) for i in range(10)],
        "torque_Nm": [i % 3 for i in range(10)],
        "lost_motion_rad": [i * 1e-5 for i in range(10)],
    }
    pq.write_table(pa.table(columns), tmp_path / "c.parquet")
    prints = {
        read_campaign(tmp_path / name).fingerprint() for name in ("a.csv", "b.csv.gz", "c.parquet")
    }
    assert len(prints) == 1
    (tmp_path / "a.csv").write_text(text.replace("9e-05", "9.1e-05"))
    assert read_campaign(tmp_path / "a.csv").fingerprint() not in prints


def test_parquet_may_hold_nulls_and_text(tmp_path: Path) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns = {
        "run": ["a", "a", "b"],
        "time_s": pa.array([0, 1, None], pa.int32()),
        "torque_Nm": pa.array([0.0, 1.0, 2.0], pa.float32()),
        "lost_motion_rad": [0.0, 1e-4, 2e-4],
        "tilt_moment_Nm": pa.nulls(3),
    }
    pq.write_table(pa.table(columns), tmp_path / "a.parquet")
    campaign = read_campaign(tmp_path / "a.parquet")
    assert [(run.label, len(run)) for run in campaign.runs] == [("a", 2)]
    columns["run"] = ["a", "a", None]
    pq.write_table(pa.table(columns), tmp_path / "a.parquet")
    with pytest.raises(InputError, match="no label in row 3"):
        read_campaign(tmp_path / "a.parquet")


@pytest.mark.parametrize("label", ["run", "time_s", "torque_Nm"])
@pytest.mark.parametrize("values", [[[0.0], [1.0, 2.0]], [b"\xff", b"\xfe"]])
def test_a_column_of_lists_or_bytes_in_parquet_is_refused(
    tmp_path: Path, label: str, values: list[Any]
) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns = {name: [0.0, 1.0] for name in ("run", *HEAD.split(","))}
    columns["note"] = pa.array(values)  # not used
    pq.write_table(pa.table(columns), tmp_path / "a.parquet")
    assert read_campaign(tmp_path / "a.parquet").rows == 2
    columns[label] = pa.array(values)
    pq.write_table(pa.table(columns), tmp_path / "a.parquet")
    with pytest.raises(InputError, match=rf"{label}: found values of type (list|binary)"):
        read_campaign(tmp_path / "a.parquet")


def test_a_folder_is_one_campaign_in_name_order(tmp_path: Path) -> None:
    for name in ("b.csv", "a.csv"):
        (tmp_path / name).write_text(
            f"run,{HEAD}\n" + ROWS.replace("\n", "\n1,")[:-2].join(["1,", ""])
        )
    (tmp_path / "notes.txt").write_text("not a recording")
    campaign = read_campaign(tmp_path)
    assert [run.label for run in campaign.runs] == ["a:1", "b:1"]
    np.testing.assert_array_equal(campaign.starts, [0, 4, 8])


def test_runs_keep_the_order_in_which_they_begin(write: Write) -> None:
    text = f"run,{HEAD}\n" + "".join(f"{r},{i},{i},{i}\n" for i, r in enumerate("zzaaz"))
    campaign = read_campaign(write(text, "a.csv"))
    assert [(run.label, len(run)) for run in campaign.runs] == [("z", 3), ("a", 2)]
    assert kinds(campaign) == {"split_run": 2}


def test_rows_without_numbers_are_left_out_and_counted(write: Write) -> None:
    file = write(f"{HEAD},temperature_C\n0,0,0,20\n1,nan,1,20\n2,2,,20\n3,3,3,\n", "a.csv")
    campaign = read_campaign(file)
    assert campaign.rows == 2
    found = {f.column: (f.count, f.action) for f in campaign.findings if f.kind == "nan"}
    assert found["torque_Nm"] == (1, "rows left out")
    assert found["lost_motion_rad"] == (1, "rows left out")
    assert found["temperature_C"][0] == 1
    assert "kept" in found["temperature_C"][1]


@pytest.mark.parametrize("delimiter", [";", "\t"])
def test_decimal_commas_are_read_where_commas_do_not_separate(write: Write, delimiter: str) -> None:
    rows = ("run,time_s,torque_Nm,lost_motion_rad", "1,0,-1.5,1e-3", "1,0.5,2,-2.5e-4", "1,1,,0.1")
    text = "\n".join(row.replace(",", delimiter).replace(".", ",") for row in rows)
    (run,) = read_campaign(write(text + "\n", "a.csv")).runs
    np.testing.assert_array_equal(run.time_s, [0, 0.5])
    np.testing.assert_array_equal(run.torque_Nm, [-1.5, 2])
    np.testing.assert_array_equal(run.lost_motion_rad, [1e-3, -2.5e-4])


@pytest.mark.parametrize(
    ("number", "separator"), [("1,5", ","), ("1.234,5", ";"), ("1,234.5", ";"), ("1,2,3", ";")]
)
def test_ambiguous_commas_are_refused(write: Write, number: str, separator: str) -> None:
    text = separator.join(HEAD.split(",")) + f'\n0{separator}"{number}"{separator}0\n'
    with pytest.raises(InputError, match=r"torque_Nm: found .* expected a number"):
        read_campaign(write(text, "a.csv"))


def test_a_clock_that_restarts_at_its_first_stamp_begins_a_run(write: Write) -> None:
    text = f"{HEAD}\n" + "".join(f"{i % 10},{i},{i}\n" for i in range(40))
    campaign = read_campaign(write(text, "a.csv"))
    assert [len(run) for run in campaign.runs] == [10, 10, 10, 10]
    (finding,) = campaign.findings
    assert (finding.kind, finding.count) == ("runs", 4)


def test_a_clock_that_goes_back_elsewhere_requires_a_column_of_runs(write: Write) -> None:
    text = f"{HEAD}\n" + "".join(f"{i % 10 + i // 10 * 5},{i},{i}\n" for i in range(40))
    (finding,) = read_campaign(write(text, "a.csv")).findings
    assert (finding.kind, finding.count) == ("backward_time", 3)
    assert "mark it in a column run" in str(finding)


def test_rows_that_were_swapped_are_sorted_by_time(write: Write) -> None:
    times = [0.1 * i for i in range(40)]
    times[20], times[21] = times[21], times[20]
    text = f"{HEAD}\n" + "".join(f"{t:.1f},{t:.1f},{i}\n" for i, t in enumerate(times))
    campaign = read_campaign(write(text, "a.csv"))
    (finding,) = campaign.findings
    assert (finding.kind, finding.count) == ("backward_time", 1)
    assert "sorted by time" in str(finding)
    assert np.all(np.diff(campaign.runs[0].columns["time"]) > 0)
    # A clock that is set back by half a step does not show that rows were swapped.
    times = [0.1 * i - (0.15 if i > 20 else 0.0) for i in range(40)]
    text = f"{HEAD}\n" + "".join(f"{t:.2f},{t:.2f},{i}\n" for i, t in enumerate(times))
    (finding,) = read_campaign(write(text, "b.csv")).findings
    assert "kept in file order" in str(finding)


def test_time_stamps_that_repeat_or_go_back_are_counted_and_kept(write: Write) -> None:
    times = [0, 1, 1, 2, 1.5, 3, 4, 50]
    text = f"{HEAD}\n" + "".join(f"{t},{i},{i}\n" for i, t in enumerate(times))
    campaign = read_campaign(write(text, "a.csv"))
    assert campaign.rows == 8
    assert kinds(campaign) == {"duplicate_time": 1, "backward_time": 1, "gap": 1}


def test_rows_that_repeat_another_in_every_column_count_once(write: Write) -> None:
    rows = [f"{i},{i % 3},{i}\n" for i in range(8)]
    campaign = read_campaign(write(f"{HEAD}\n" + "".join(rows + rows[2:6]), "a.csv"))
    assert campaign.rows == 8
    assert kinds(campaign) == {"duplicate_time": 4}


def test_equal_rows_of_a_clock_coarser_than_the_samples_are_kept(write: Write) -> None:
    text = f"{HEAD}\n" + "".join(f"{i // 4},{i // 2},{i // 2}\n" for i in range(16))
    campaign = read_campaign(write(text, "a.csv"))
    assert campaign.rows == 16


def test_a_folder_of_more_recordings_than_a_campaign_has_is_refused(tmp_path: Path) -> None:
    for i in range(2_001):
        (tmp_path / f"{i}.csv").touch()
    with pytest.raises(InputError, match="found 2001 recordings, expected 2000 at most"):
        read_campaign(tmp_path)


@pytest.mark.parametrize(("back", "found"), [(0.06, {"clock": 1}), (0.02, {})])
def test_a_regular_clock_that_is_set_back_by_less_than_a_step_is_reported(
    write: Write, back: float, found: dict[str, int]
) -> None:
    times = [0.1 * i - back * (i >= 70) for i in range(120)]
    text = f"{HEAD}\n" + "".join(f"{t:.3f},{i % 7},{i}\n" for i, t in enumerate(times))
    assert kinds(read_campaign(write(text, "a.csv"))) == found


def test_a_clock_that_starts_again_with_each_run_is_no_fault(write: Write) -> None:
    text = f"run,{HEAD}\n" + "".join(f"{i // 4},{i % 4},{i},{i}\n" for i in range(8))
    assert read_campaign(write(text, "a.csv")).findings == []


def test_a_frozen_sensor_is_reported_and_its_readings_left_out(write: Write) -> None:
    torque = np.sin(np.linspace(0, 12, 400))
    angle = np.where((np.arange(400) > 100) & (np.arange(400) < 200), 0.5, torque)
    text = f"{HEAD}\n" + "".join(
        f"{i},{t},{a}\n" for i, (t, a) in enumerate(zip(torque, angle, strict=True))
    )
    campaign = read_campaign(write(text, "a.csv"))
    assert kinds(campaign) == {"wild": 99, "gap": 1}
    assert campaign.findings[0].column == "lost_motion_rad"
    assert campaign.rows == 301


@pytest.mark.parametrize("dead", ["input_angle", "output_angle"])
def test_an_encoder_at_rest_while_the_other_turns_is_reported(write: Write, dead: str) -> None:
    output = 0.005 * np.arange(2000)
    torque = 30 * np.sin(0.02 * np.arange(2000))
    angles = {"input_angle": 100 * (output - torque / 3e4), "output_angle": output}
    sound = angles[dead].copy()
    angles[dead][900:] = sound[900]

    def campaign() -> Campaign:
        rows = zip(torque, angles["input_angle"], angles["output_angle"], strict=True)
        text = "time_s,torque_Nm,input_angle_rad,output_angle_rad\n" + "".join(
            f"{i},{t},{a},{b}\n" for i, (t, a, b) in enumerate(rows)
        )
        return read_campaign(write(text, "a.csv"), ratio=100)

    def read() -> dict[str, tuple[int, str]]:
        return {f.kind: (f.count, f.column) for f in campaign().findings}

    assert read() == {"stuck": (1100, f"{dead}_rad")}
    with pytest.raises(InputError, match=f"{dead}_rad: .*constant reading for 1100 of 2000 rows"):
        check_encoders(campaign(), 100)
    angles[dead][1200:] = sound[1200:]
    assert read() == {"wild": (299, f"{dead}_rad"), "gap": (1, "time_s")}
    angles[dead] = sound
    assert read() == {}


def test_a_dead_output_encoder_is_named_also_where_the_input_is_held(write: Write) -> None:
    torque = np.sin(np.linspace(0, 12, 400))
    angle = 0.01 * np.where((np.arange(400) > 100) & (np.arange(400) < 200), 0.5, torque)
    text = "time_s,torque_Nm,input_angle_rad,output_angle_rad\n" + "".join(
        f"{i},{t},7.5,{a}\n" for i, (t, a) in enumerate(zip(torque, angle, strict=True))
    )
    finding, _ = read_campaign(write(text, "a.csv"), ratio=100).findings
    assert (finding.kind, finding.column, finding.count) == ("wild", "output_angle_rad", 99)


def test_an_encoder_that_wraps_is_unwrapped_and_counted(write: Write) -> None:
    turns = np.linspace(0, 2.5, 101)
    text = "time_s,torque_Nm,input_angle_rev,output_angle_rad\n" + "".join(
        f"{i},{i},{t % 1.0},{0.1 * t}\n" for i, t in enumerate(turns)
    )
    campaign = read_campaign(write(text, "a.csv"), ratio=100)
    assert {"wrap": 2}.items() <= kinds(campaign).items()
    np.testing.assert_allclose(campaign.column("input_angle"), 2 * np.pi * turns, atol=1e-12)


@given(
    st.lists(st.floats(-0.2, 0.2), min_size=2, max_size=60),
    st.floats(-100, 100),
)
def test_unwrapping_a_wrapped_angle_gives_it_back(steps: list[float], begin: float) -> None:
    turn = 2 * np.pi
    angle = (begin + np.cumsum(steps)) * turn
    wrapped = np.mod(angle, turn)
    back, _ = unwrap(wrapped)
    np.testing.assert_allclose(np.diff(back), np.diff(angle), atol=1e-9)


def test_a_fast_recording_is_not_taken_for_wraps() -> None:
    angle = np.arange(20) * 0.9 * 2 * np.pi
    back, wraps = unwrap(angle)
    assert wraps == 0
    assert back is angle


def turning(turns: FloatArray, *, drop: Sequence[int] = (), lost_rad: float = 1e-3) -> str:
    """Write a drive of ratio 100 that turns; its motor's encoder wraps, rows have no torque."""
    rows = ["time_s,torque_Nm,input_angle_rev,output_angle_deg"]
    for i, turn in enumerate(turns):
        output = 3.6 * turn + math.degrees(lost_rad * math.sin(0.1 * i))
        torque = "nan" if i in drop else f"{math.sin(0.1 * i)}"
        rows.append(f"{i},{torque},{turn % 1.0},{output}")
    return "\n".join(rows) + "\n"


def test_no_turn_is_lost_where_rows_are_left_out(write: Write) -> None:
    # Without the third row the step across the wrap is longer than a quarter turn.
    turns = 0.55 + 0.15 * np.arange(60)
    campaign = read_campaign(write(turning(turns, drop=[3, 16, 30]), "a.csv"), ratio=100)
    np.testing.assert_allclose(
        campaign.column("lost_motion"),
        1e-3 * np.sin(0.1 * np.delete(np.arange(60), [3, 16, 30])),
        atol=1e-9,
    )


@pytest.mark.parametrize("speed", [0.3, -0.45, 0.5, 0.9, 1.7])
def test_a_fast_motor_is_followed_by_the_output(write: Write, speed: float) -> None:
    turns = 0.1 + speed * np.arange(80)
    campaign = read_campaign(write(turning(turns), "a.csv"), ratio=100)
    np.testing.assert_allclose(
        campaign.column("lost_motion") - campaign.column("lost_motion")[0],
        1e-3 * np.sin(0.1 * np.arange(80)),
        atol=1e-9,
    )
    assert kinds(campaign)["wrap"] == np.count_nonzero(np.diff(np.floor(turns)))


def test_another_ratio_does_not_make_turns(write: Write) -> None:
    turns = 0.1 + 0.3 * np.arange(80)
    campaign = read_campaign(write(turning(turns), "a.csv"), ratio=51)
    (finding,) = (finding for finding in campaign.findings if finding.kind == "wrap")
    assert "whole turns may be missing" in finding.action


@pytest.mark.parametrize(
    ("stated", "told"), [(-100, True), (101, True), (50, True), (100, False), (100.02, False)]
)
def test_a_wrong_ratio_is_reported_where_the_drive_turns(
    write: Write, stated: float, told: bool
) -> None:
    campaign = read_campaign(write(turning(0.05 * np.arange(900)), "a.csv"), ratio=stated)
    wrong = [finding for finding in campaign.findings if finding.kind == "ratio"]
    assert len(wrong) == told
    if told:
        assert "100 input turns for one output turn" in wrong[0].action
        assert "sign" not in kinds(campaign)


@pytest.mark.parametrize("ratio", [100, -50])
def test_runs_of_an_encoder_of_one_turn_have_one_zero(write: Write, ratio: float) -> None:
    # Both encoders are absolute within a turn; the drive moved before each run.
    lost = 1e-3 * np.sin(0.1 * np.arange(60))
    for number, begin in enumerate((0.3, 4.1, -2.2, 120.6)):
        turns = begin + 0.001 * np.arange(60)
        rows = "".join(
            f"{i},{math.sin(0.1 * i)},{(turn + 0.4) % 1.0},{angle % 360}\n"
            for i, (turn, angle) in enumerate(
                zip(turns, 360 * turns / ratio + np.degrees(lost), strict=True)
            )
        )
        file = write(f"time_s,torque_Nm,input_angle_rev,output_angle_deg\n{rows}", f"{number}.csv")
    campaign = read_campaign(file.parent, ratio=ratio)
    zeros = [run.lost_motion_rad - lost for run in campaign.runs]
    np.testing.assert_allclose(zeros, zeros[0][0], atol=1e-9)
    assert any("starts whole turns away" in finding.action for finding in campaign.findings)


def test_an_inverted_sign_is_suspected(write: Write) -> None:
    campaign = read_campaign(write(f"{HEAD}\n0,0,0\n1,1,-1\n2,2,-2\n", "a.csv"))
    (finding,) = campaign.findings
    assert finding.kind == "sign"
    assert "--map" in str(finding)


@pytest.mark.parametrize(
    ("torque", "angle", "says"),
    [
        ("Nm", "deg", "about the factor of degrees read as radians"),
        ("Nm", "arcmin", "about the factor of arc minutes read as radians"),
        ("Nm", "arcsec", "about the factor of arc seconds read as radians"),
        ("mNm", "rad", "about the factor of N mm read as N m"),
        ("Nm", "rad", None),
    ],
)
def test_units_taken_for_others_show_against_the_drive(
    write: Write, torque: str, angle: str, says: str | None
) -> None:
    applied = 40 * np.sin(np.arange(400) / 20)
    turned = 1.6 * applied / 29e3 + 3e-5 * np.sign(applied) + 0.01
    written = convert(applied, "Nm", torque), convert(turned, "rad", angle)
    rows = "".join(f"{t},{m:.9g},{a:.9g}\n" for t, (m, a) in enumerate(zip(*written, strict=True)))
    campaign = read_campaign(write(f"{HEAD}\n{rows}", "a.csv"))
    for _ in range(2):
        check_scale(campaign, lambda at: at / 29e3 * 1.7)
    if says is None:
        assert not campaign.findings
    else:
        (finding,) = campaign.findings
        assert finding.kind == "scale"
        assert says in str(finding)


def test_angles_at_the_end_of_the_floating_point_have_a_scale_too(write: Write) -> None:
    rows = "".join(f"{t},{1e3 * (-1) ** t},{5e-322 * (-1) ** t}\n" for t in range(100))
    campaign = read_campaign(write(f"{HEAD}\n{rows}", "a.csv"))
    check_scale(campaign, lambda at: at * 1e3)
    assert kinds(campaign) == {"scale": 100}


def test_noise_is_no_evidence_of_the_scale(write: Write) -> None:
    torque = 0.01 * np.sin(np.arange(400) / 20)
    angle = 1e-4 * np.random.default_rng(1).normal(size=400)
    rows = "".join(
        f"{t},{m:.9g},{a:.9g}\n" for t, (m, a) in enumerate(zip(torque, angle, strict=True))
    )
    campaign = read_campaign(write(f"{HEAD}\n{rows}", "a.csv"))
    check_scale(campaign, lambda at: at / 29e3)
    assert "scale" not in kinds(campaign)


def test_the_extract_of_real_recordings_reads_with_the_map_of_its_drive() -> None:
    from lostmotion.drives import read_drive

    folder = DATA / "cycloidal_locked_output"
    drive = read_drive(folder / "drive.toml")
    campaign = read_campaign(folder, mapping=drive.columns)
    assert [run.label for run in campaign.runs] == [0, 1, 2, 3, 4, 100, 101, 102]
    assert campaign.rows == 3914
    assert "sign" not in kinds(campaign)
    # Half the loop of the 40 N m cycles has about 290 arcmin in either direction.
    swing = np.ptp(campaign.runs[-1].lost_motion_rad) / ARCMIN
    assert swing == pytest.approx(574, abs=5)


@pytest.mark.parametrize("label", ["", "0", "nan", "15", "ovf"])
def test_a_few_rows_of_another_label_amid_a_run_are_rows_of_that_run(
    tmp_path: Path, label: str
) -> None:
    lines = ["run,time_s,torque_Nm,lost_motion_rad"]
    lines += [f"{1 + i // 40},{i},{i % 9},{(i % 9) * 1e-5}" for i in range(80)]
    lines[21] = lines[21].replace("1", label, 1)
    lines[60:63] = [line.replace("2", label, 1) for line in lines[60:63]]
    (tmp_path / "a.csv").write_text("\n".join(lines) + "\n")
    campaign = read_campaign(tmp_path / "a.csv")
    assert [(run.label, len(run)) for run in campaign.runs] == [(1, 40), (2, 40)]
    assert sum(f.count for f in campaign.findings if f.column == "run") == 4


def test_recordings_that_take_turns_row_by_row_stay_apart(tmp_path: Path) -> None:
    lines = ["run,time_s,torque_Nm,lost_motion_rad"]
    lines += [f"{1 + i % 2},{i},{i % 9},{(i % 9) * 1e-5}" for i in range(80)]
    (tmp_path / "a.csv").write_text("\n".join(lines) + "\n")
    assert [len(run) for run in read_campaign(tmp_path / "a.csv").runs] == [40, 40]


def test_a_run_of_one_sample_is_left_out_and_named(write: Write) -> None:
    text = f"run,{HEAD}\n1,0,0,0\n1,1,1,1\n2,0,2,2\n2,1,3,3\nMean,0.5,1.5,1.5\n"
    campaign = read_campaign(write(text, "a.csv"))
    assert [run.label for run in campaign.runs] == ["1", "2"]
    (found,) = campaign.findings
    assert (found.kind, found.run) == ("runs", "Mean")


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("cell", ["1e999999999", "-1e2147483648", "1.7e308"])
def test_a_number_beyond_the_range_of_64_bits_is_missing(write: Write, cell: str) -> None:
    rows = [f"{0.1 * i:.1f},{i % 9},{(i % 9) * 1e-5}" for i in range(40)]
    rows[20] = f"2.0,{cell},2e-5"
    text = "time_s,torque_kNm,lost_motion_rad\n" + "\n".join(rows) + "\n"
    campaign = read_campaign(write(text, "a.csv"))
    assert len(campaign.runs[0]) == 39
    assert kinds(campaign) == {"nan": 1}


def test_a_file_that_is_given_twice_counts_once(write: Write) -> None:
    angle = np.round(1e-5 * np.random.default_rng(1).normal(size=80), 9)
    rows = "".join(f"{0.1 * i:.1f},{i % 9},{x:.9f}\n" for i, x in enumerate(angle))
    file = write(f"{HEAD}\n{rows}", "a.csv")
    copy = write(f"{HEAD}\n{rows}", "b.csv")
    campaign = read_campaign([file, copy])
    assert [run.label for run in campaign.runs] == ["a"]
    (found,) = [finding for finding in campaign.findings if finding.kind == "runs"]
    assert (found.run, found.count) == ("b", 80)
    assert "run a of " in found.action


def test_readings_of_a_coarse_gauge_may_be_the_same_again(write: Write) -> None:
    text = f"{HEAD}\n{ROWS}"
    assert len(read_campaign([write(text, "a.csv"), write(text, "b.csv")]).runs) == 2
