"""Runs whose labels begin anew, and columns that are used otherwise than their owner expects."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lostmotion.errors import InputError
from lostmotion.recordings import read_campaign, say_findings

from .clean import HIDDEN, RATIO, RUNS, Sheet, clean
from .dresses_of_runs import channel_a_row
from .judge import run

AGAIN = {2: "1", 3: "2", 6: "3", 9: "4", 13: "5", 14: "1", 15: "2", 19: "3", 28: "4"}
"""Labels of a logger that was restarted after five runs."""


def relabelled(sheet: Sheet) -> Sheet:
    return sheet.put("run", [AGAIN[int(label)] for label in sheet.cells("run")])


def saved(folder: Path, sheet: Sheet) -> Path:
    file = folder / "log.csv"
    file.write_text(sheet.text())
    return file


def test_labels_that_begin_anew_with_the_clock_are_runs_of_their_own(tmp_path: Path) -> None:
    file = saved(tmp_path, relabelled(clean()))
    campaign = read_campaign(file, ratio=RATIO)
    labels = [str(one.label) for one in campaign.runs]
    assert labels == ["1", "2", "3", "4", "5", "1 (2)", "2 (2)", "3 (2)", "4 (2)"]
    assert [one.begins for one in campaign.runs] == [i == 5 for i in range(len(RUNS))]
    assert any("read as run 1 (2)" in line for line in say_findings(campaign.findings))
    answer = run("diagnose", [file]).answer
    assert (answer["verdict"], answer["effects"]) == ("missing-effect", [HIDDEN])


def test_labels_that_begin_anew_while_the_clock_continues_are_runs_of_their_own(
    tmp_path: Path,
) -> None:
    sheet = relabelled(clean())
    later = 5000.0 * (np.array(clean().cells("run"), int) >= 14)
    times = [f"{t:.4f}" for t in sheet.values("time_s") + later]
    campaign = read_campaign(saved(tmp_path, sheet.put("time_s", times)), ratio=RATIO)
    labels = [str(one.label) for one in campaign.runs]
    assert labels == ["1", "2", "3", "4", "5", "1 (2)", "2 (2)", "3 (2)", "4 (2)"]
    assert any("has a gap after other runs" in line for line in say_findings(campaign.findings))


def test_runs_of_one_clock_that_are_written_in_turns_are_joined(tmp_path: Path) -> None:
    runs = clean().by_run()
    size = min(len(runs["2"]), len(runs["3"]))
    turns = [
        (label, row)
        for begin in range(0, size, 20)
        for label in ("2", "3")
        for row in runs[label].rows()[begin : min(begin + 20, size)]
    ]
    text = "".join(f"{label},{','.join(row)}\n" for label, row in turns)
    file = tmp_path / "log.csv"
    file.write_text(f"run,{','.join(runs['2'].names)}\n{text}")
    assert [len(one) for one in read_campaign(file, ratio=RATIO).runs] == [size, size]


@pytest.mark.parametrize("label", ["2", "14"], ids=["at room temperature", "between the others"])
def test_a_run_in_fahrenheit_is_reported(label: str, tmp_path: Path) -> None:
    values = clean().values("temperature_C")
    of_run = np.array(clean().cells("run")) == label
    values[of_run] = 1.8 * values[of_run] + 32.0
    sheet = clean().put("temperature_C", [f"{value:.2f}" for value in values])
    (line,) = say_findings(read_campaign(saved(tmp_path, sheet), ratio=RATIO).findings)
    assert f"(run {label})" in line
    assert "Fahrenheit" in line


@pytest.mark.parametrize("warm_C", [40.0, 60.0, 90.0])
def test_a_plan_of_two_temperatures_is_not_reported(warm_C: float, tmp_path: Path) -> None:
    warm = np.array(clean().cells("run")) == "14"
    near_20 = 20.0 + 0.1 * clean().values("temperature_C")
    cells = [f"{value:.2f}" for value in np.where(warm, warm_C, near_20)]
    campaign = read_campaign(saved(tmp_path, clean().put("temperature_C", cells)), ratio=RATIO)
    assert not campaign.findings


def test_a_plan_of_even_temperatures_is_not_reported(tmp_path: Path) -> None:
    place = {label: i for i, label in enumerate(dict.fromkeys(clean().cells("run")))}
    cells = [f"{10.0 + 8.0 * place[label]:.1f}" for label in clean().cells("run")]
    campaign = read_campaign(saved(tmp_path, clean().put("temperature_C", cells)), ratio=RATIO)
    assert not campaign.findings


def test_the_only_run_at_the_highest_temperature_is_not_reported(tmp_path: Path) -> None:
    labels = list(dict.fromkeys(clean().cells("run")))
    warm = {label: (10.0, 20.0, 30.0, 40.0)[i % 4] + 0.3 * i for i, label in enumerate(labels)}
    for highest_C in (48.0, 53.0):
        warm[labels[-1]] = highest_C
        cells = [f"{warm[label]:.1f}" for label in clean().cells("run")]
        campaign = read_campaign(saved(tmp_path, clean().put("temperature_C", cells)), ratio=RATIO)
        assert not campaign.findings


def test_an_unused_column_of_a_quantity_states_its_map(tmp_path: Path) -> None:
    sheet = clean().renamed(temperature_C="Temperature motor [°F]")
    (line,) = say_findings(read_campaign(saved(tmp_path, sheet), ratio=RATIO).findings)
    assert line.endswith("--map 'Temperature motor [°F]=temperature_F'")


def test_a_temperature_that_a_spreadsheet_made_a_date_is_named(tmp_path: Path) -> None:
    sheet = clean().put("temperature_C", ["22. Mai"] * len(clean()))
    (line,) = say_findings(read_campaign(saved(tmp_path, sheet), ratio=RATIO).findings)
    assert "temperature_C: ignored column" in line
    assert line.endswith("text in its first cells, no numbers")


def test_channels_in_rows_of_their_own_are_joined_on_request(tmp_path: Path) -> None:
    file = tmp_path / "log.csv"
    file.write_text(channel_a_row(clean(), late_s=0.01))
    with pytest.raises(InputError, match=r"different rows .*--join linear, or --join nearest"):
        read_campaign(file, ratio=RATIO)
    joined = read_campaign(file, ratio=RATIO, join="linear")
    # The first torque comes before the first angle, and the last angle after the last torque.
    assert joined.rows == len(clean()) - len(RUNS)
    assert any("linear to the rows of the slowest" in one for one in say_findings(joined.findings))
    whole = read_campaign(saved(tmp_path, clean()), ratio=RATIO)
    for one, other in zip(joined.runs, whole.runs, strict=True):
        if np.ptp(one.columns["input_angle"]) > 1.0:
            continue  # the later stamps make it lag
        ends = slice(1, len(one) - 1)
        shifted = np.interp(one.time_s[ends], other.time_s + 0.01, other.lost_motion_rad)
        assert float(np.std(one.lost_motion_rad[ends] - shifted)) < 1e-2 * np.ptp(shifted)


def test_names_in_chinese_are_shown_with_their_map(tmp_path: Path) -> None:
    names = {"time_s": "时间(s)", "torque_Nm": "扭矩(N·m)", "input_angle_rad": "输入角(rad)"}
    file = tmp_path / "log.csv"
    file.write_bytes(clean().renamed(**names).text().encode("gb18030"))
    with pytest.raises(InputError, match=r"--map '扭矩\(N·m\)=torque_Nm'"):
        read_campaign(file, ratio=RATIO)


def test_a_clock_that_is_set_back_within_a_run_is_no_other_run(tmp_path: Path) -> None:
    one = clean().taken(np.array(clean().cells("run")) == "14").without("run")
    times = one.values("time_s")
    times[60:] -= 20.0
    file = saved(tmp_path, one.put("time_s", [f"{t:.4f}" for t in times]))
    assert len(read_campaign(file, ratio=RATIO).runs) == 1
