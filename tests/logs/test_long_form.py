"""Tables with one value in a row: channels one after another, in memory, and what is none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from lostmotion.errors import InputError
from lostmotion.recordings import Campaign, read_campaign, say_findings

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
