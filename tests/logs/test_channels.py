"""Channels in rows or files of their own: one after another, in memory, of other times."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from lostmotion.errors import InputError
from lostmotion.recordings import Campaign, read_campaign, say_findings
from lostmotion.recordings.joining import Join

from .clean import RATIO, Sheet, clean
from .dresses_of_channels import channels


def blocks(sheet: Sheet, late_s: float = 0.0) -> str:
    """Every channel of the sheet after the one before; the times of each are later by so much."""
    text = "time_s,variable,value\n"
    for number, name in enumerate(channels(sheet)):
        times = sheet.values("time_s") + number * late_s
        rows = zip(times, sheet.cells(name), strict=True)
        text += "".join(f"{time:.4f},{name},{cell}\n" for time, cell in rows)
    return text


def test_channels_one_after_another_are_no_runs(tmp_path: Path) -> None:
    (tmp_path / "wide.csv").write_text(clean().without("run").text())
    (tmp_path / "long.csv").write_text(blocks(clean()))
    wide, long = (read_campaign(tmp_path / f"{one}.csv", ratio=RATIO) for one in ("wide", "long"))
    assert len(wide.runs) > 1
    assert [run.label for run in long.runs] == [run.label for run in wide.runs]
    for run, other in zip(long.runs, wide.runs, strict=True):
        assert run.columns.keys() == other.columns.keys()
        for name, values in run.columns.items():
            assert np.array_equal(values, other.columns[name]), name


def test_channels_of_other_times_are_joined_on_request(tmp_path: Path) -> None:
    sheet = clean().by_run()["2"]
    (tmp_path / "long.csv").write_text(blocks(sheet, late_s=0.01))
    with pytest.raises(InputError, match=r"different rows .*--join linear, or --join nearest"):
        read_campaign(tmp_path / "long.csv", ratio=RATIO)
    joined = read_campaign(tmp_path / "long.csv", ratio=RATIO, join="linear")
    assert joined.rows == len(sheet) - 1


def test_a_channel_without_one_reading_is_filled_and_said(tmp_path: Path) -> None:
    sheet = clean().by_run()["2"]
    lines = blocks(sheet).splitlines()
    (row,) = [i for i, line in enumerate(lines) if "temperature_C" in line][70:71]
    lines[row] = lines[row].rsplit(",", 1)[0] + ",#N/A"
    (tmp_path / "long.csv").write_text("\n".join(lines) + "\n")
    campaign = read_campaign(tmp_path / "long.csv", ratio=RATIO)
    assert campaign.rows == len(sheet)
    said = [line for line in say_findings(campaign.findings) if "temperature_C" in line]
    assert any("nearest to the rows of the slowest" in line for line in said), said
    assert any(f"nan x 1: no number in line {row + 1}" in line for line in said), said


@pytest.mark.parametrize("mark", ["#N/A", "", "NaN"])
@pytest.mark.parametrize("join", [None, "linear"])
def test_readings_without_a_number_are_counted_and_left_out(
    tmp_path: Path, mark: str, join: Join | None
) -> None:
    """As in a table with a column for each channel: the other rows keep their values."""
    sheet = clean().by_run()["2"]
    lines = blocks(sheet).splitlines()
    gone = {"torque_Nm": [20, 70], "output_angle_rad": [40]}
    first = {name: next(i for i, one in enumerate(lines) if f",{name}," in one) for name in gone}
    for name, rows in gone.items():
        for row in rows:
            lines[first[name] + row] = lines[first[name] + row].rsplit(",", 1)[0] + "," + mark
    (tmp_path / "long.csv").write_text("\n".join(lines) + "\n")
    campaign = read_campaign(tmp_path / "long.csv", ratio=RATIO, join=join)
    said = "\n".join(say_findings(campaign.findings))
    for name, rows in gone.items():
        line = f"{name}: nan x {len(rows)}: no number in line {first[name] + rows[0] + 1}"
        assert line in said, said
    if join is None:
        kept = np.setdiff1d(np.arange(len(sheet)), [row for rows in gone.values() for row in rows])
        torque = sheet.values("torque_Nm")
        assert np.array_equal(campaign.column("torque"), torque[kept])


def test_files_of_single_channels_are_one_recording(tmp_path: Path) -> None:
    sheet = clean().by_run()["2"]
    files = [tmp_path / f"{name}.csv" for name in channels(sheet)[:3]]
    for file in files:
        file.write_text(sheet.ordered("time_s", file.stem).text())
    campaign = read_campaign(files, ratio=RATIO)
    assert len(campaign.runs) == 1
    assert any("one recording with" in line for line in say_findings(campaign.findings))
    (tmp_path / "whole.csv").write_text(sheet.without("temperature_C", "cycles").text())
    (run,) = read_campaign(tmp_path / "whole.csv", ratio=RATIO).runs
    assert np.array_equal(campaign.runs[0].lost_motion_rad, run.lost_motion_rad)

    files[0].write_text(sheet.ordered("time_s", "torque_Nm").text().replace("time_s", "time_ms"))
    with pytest.raises(InputError, match="time a second time"):
        read_campaign(files, ratio=RATIO)


def test_files_of_other_times_are_joined_on_request(tmp_path: Path) -> None:
    sheet = clean().by_run()["2"]
    thinned = sheet.taken(np.arange(len(sheet)) % 3 == 0)
    late = sheet.put("time_s", [f"{t + 1e4:.4f}" for t in sheet.values("time_s")])
    torque, angles = tmp_path / "torque.csv", tmp_path / "angles.csv"
    torque.write_text(thinned.ordered("time_s", "torque_Nm").text())
    angles.write_text(sheet.without("torque_Nm").text())
    with pytest.raises(InputError, match=r"different rows .*--join linear"):
        read_campaign([torque, angles], ratio=RATIO)
    joined = read_campaign([torque, angles], ratio=RATIO, join="linear")
    assert joined.rows == len(thinned)
    angles.write_text(late.without("torque_Nm").text())
    with pytest.raises(InputError, match="channels whose times overlap"):
        read_campaign([torque, angles], ratio=RATIO, join="linear")


def test_a_melted_frame_is_read_like_the_frame() -> None:
    sheet = clean()
    frame = pd.DataFrame({name: sheet.values(name) for name in sheet.names})
    melted = frame.melt(id_vars=["run", "time_s"])
    one, other = (Campaign.from_table(table, ratio=RATIO) for table in (frame, melted))
    assert one.rows == other.rows
    assert np.array_equal(one.runs[3].lost_motion_rad, other.runs[3].lost_motion_rad)


def test_rows_without_a_number_are_counted_with_their_line(tmp_path: Path) -> None:
    lines = blocks(clean().by_run()["2"]).splitlines()
    lines.insert(10, "1.2,state,running")
    (tmp_path / "long.csv").write_text("\n".join(lines) + "\n")
    campaign = read_campaign(tmp_path / "long.csv", ratio=RATIO)
    assert [line for line in say_findings(campaign.findings) if "no number in line 11" in line]


@pytest.mark.parametrize("names", ["time_s,state,Moment", "time_s,note,torque_Nm"])
def test_a_table_with_a_column_of_text_is_not_turned(names: str, tmp_path: Path) -> None:
    rows = "".join(f"{0.1 * i:.1f},ok,{i}\n" for i in range(20))
    (tmp_path / "log.csv").write_text(f"{names}\n{rows}")
    with pytest.raises(InputError, match=f"there are {', '.join(names.split(','))}|among"):
        read_campaign(tmp_path / "log.csv", ratio=RATIO)
