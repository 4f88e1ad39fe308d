"""The column table: what each column is taken as, by the rules of the reader and of ``--map``."""

from __future__ import annotations

from pathlib import Path

import pytest

from lostmotion.errors import InputError
from lostmotion.recordings import parse_map, read_campaign
from lostmotion.recordings.column_table import Choice, ColumnTable

OWN_NAMES = """TIME;POSITION;Load cell;ENC;notes
0.0;0.001;1.5;4096;a
0.1;0.002;2.5;4097;b
0.2;0.003;3.5;4098;c
"""


@pytest.fixture
def table(tmp_path: Path) -> ColumnTable:
    file = tmp_path / "own.csv"
    file.write_text(OWN_NAMES)
    return ColumnTable.of_files([file], {})


def taken(table: ColumnTable) -> dict[str, str]:
    """Columns that are used, as ``NAME_UNIT``."""
    rows, _ = table.rows()
    return {r.name: f"{r.quantity}_{r.unit}".rstrip("_") for r in rows if r.quantity}


def test_every_column_has_its_first_values_and_nothing_is_guessed(table: ColumnTable) -> None:
    rows, lacking = table.rows()
    assert [row.name for row in rows] == ["TIME", "POSITION", "Load cell", "ENC", "notes"]
    assert rows[2].first == ("1.5", "2.5", "3.5")
    assert taken(table) == {}
    assert len(lacking) == 3


def test_choices_make_the_map_that_the_reader_takes(table: ColumnTable, tmp_path: Path) -> None:
    table = table.with_choice("TIME", Choice("time", "s"))
    table = table.with_choice("Load cell", Choice("torque", "Ncm", reversed=True))
    table = table.with_choice("POSITION", Choice("lost_motion", "deg"))
    assert table.rows()[1] == []
    pasted = [f"{column}={entry}" for column, entry in table.mapping.items()]
    assert pasted == ["TIME=time_s", "Load cell=-torque_Ncm", "POSITION=lost_motion_deg"]
    campaign = read_campaign(tmp_path / "own.csv", mapping=parse_map(pasted))
    assert list(campaign.column("torque")) == pytest.approx([-0.015, -0.025, -0.035])
    undone = table.with_choice("TIME", Choice())
    assert "TIME" not in undone.entries
    assert undone.rows()[1] == ["missing: time_s, or --map TIME=time_s, or order, a running number"]


@pytest.mark.parametrize(
    ("column", "choice", "said"),
    [
        ("TIME", Choice("time"), "no unit; expected a time"),
        ("TIME", Choice("time", "Nm"), "unit 'Nm', a torque"),
        ("ENC", Choice("torque", "Nm"), "torque a second time (first 'Load cell')"),
        ("ENC", Choice("input_angle", "rev", divisor="0"), "'/0' in --map"),
        ("ENC", Choice("input_angle", "rev", divisor="many"), "unknown unit 'rev/many'"),
    ],
)
def test_a_refused_choice_states_the_reason_in_its_row(
    table: ColumnTable, column: str, choice: Choice, said: str
) -> None:
    table = table.with_choice("Load cell", Choice("torque", "Nm")).with_choice(column, choice)
    rows = {row.name: row for row in table.rows()[0]}
    assert rows[column].fault
    assert said in rows[column].remark
    assert taken(table) == {"Load cell": "torque_Nm"}  # the other choices stay
    assert table.choice(column) == choice


@pytest.mark.parametrize(
    "entry",
    [
        "time_s",
        "time_iso",
        "-torque_Nm",
        "run",
        "input_angle_rev/4096",
        "-input_angle_rev/4000%10000",
        "torque_Nm/12.5",
    ],
)
def test_the_parts_of_an_entry_make_the_entry(entry: str) -> None:
    assert Choice.of_entry(entry).entry() == entry


def test_the_map_of_the_drive_file_applies_and_stays(tmp_path: Path) -> None:
    (tmp_path / "own.csv").write_text(OWN_NAMES)
    files, stated = [tmp_path / "own.csv"], {"TIME": "time_s", "absent": "torque_Nm"}
    table = ColumnTable.of_files(files, {"gone": "run", "POSITION": "lost_motion_rev"}, stated)
    assert taken(table) == {"TIME": "time_s", "POSITION": "lost_motion_rev"}
    assert table.without_absent().entries == {"POSITION": "lost_motion_rev"}
    assert table.with_choice("TIME", Choice("time", "s")).entries == table.entries


def test_files_of_one_campaign_share_the_table(tmp_path: Path) -> None:
    first, second = tmp_path / "a.csv", tmp_path / "b.csv"
    first.write_text("time_s,torque_Nm,lost_motion_rad\n0,1,2\n1,2,3\n")
    second.write_text("time_s,torque,lost_motion_rad\n0,1,2\n1,2,3\n")
    table = ColumnTable.of_files([first, second], {})
    rows = {row.name: row for row in table.rows()[0]}
    assert list(rows) == ["time_s", "torque_Nm", "lost_motion_rad", "torque"]
    assert rows["torque"].fault
    with pytest.raises(InputError, match="torque: found no unit"):
        read_campaign([first, second])


def test_a_doubted_clock_of_dates_is_shown_with_its_kind(tmp_path: Path) -> None:
    file = tmp_path / "dated.csv"
    file.write_text(
        "stamp,torque_Nm,lost_motion_rad\n2026-03-01 10:00:00,1,2\n2026-03-01 10:00:01,2,3\n"
    )
    assert taken(ColumnTable.of_files([file], {}))["stamp"] == "time_iso"
