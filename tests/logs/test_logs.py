"""Every dress and every fault has the result of the clean copy, or is refused with a reason.

Here each dress is tested with `check`, every fourth also with `compare`, and every eighth fault
with both. `python -m logs`, a step of ``./dev check``, tests all with all four commands.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from .clean import HIDDEN, clean
from .combined import combined
from .dress import DRESSES, SAME
from .events import AT_S, RUN, Event, all_events
from .judge import COMMANDS, Verdict, right_answer, run
from .table import dresses, faults, verdict
from .walled import against, against_evidence

QUICK = ("check", "compare")


def print_table(lines: Sequence[Verdict]) -> str:
    """Print the lines; return those that are wrong."""
    print("\n" + "\n".join(line.line() for line in lines))
    return "\n".join(line.line() for line in lines if line.wrong)


def test_the_clean_copy_names_what_is_hidden() -> None:
    answer = right_answer("diagnose")
    assert (answer["verdict"], answer["effects"]) == ("missing-effect", [HIDDEN])


def test_there_are_sixty_dresses_and_twenty_faults_in_every_column() -> None:
    assert len([name for name in dresses() if DRESSES[name].expected == SAME]) >= 60
    for column in clean().names:
        assert len([name for name in faults() if name.startswith(f"{column}: ")]) >= 20, column


def test_every_dress_has_the_clean_copys_answer() -> None:
    lines = [
        verdict(name, ("check", "compare") if i % 4 == 3 else ("check",))
        for i, name in enumerate(dresses())
    ]
    assert not (wrong := print_table(lines)), "\n" + wrong


@pytest.mark.parametrize(
    ("dress", "damage"),
    [
        ("rows in no order, as a database returns them", "time_s: a digit that is a letter"),
        ("rows sorted by the torque", "time_s: full scale for 12 samples"),
        (
            "a file of the motor's encoder and one of the output's",
            "time_s: ten times too much",
        ),
        ("long form: time, channel and value (pandas melt)", "time_s: NaN"),
    ],
)
def test_rows_sorted_by_time_show_their_unusable_stamps(dress: str, damage: str) -> None:
    line = combined(dress, damage)
    assert line is not None
    assert not line.wrong, line.line()


def test_every_eighth_fault_is_found_and_changes_no_answer() -> None:
    lines = [verdict(name, QUICK) for i, name in enumerate(faults()) if i % 8 == 3]
    assert not (wrong := print_table(lines)), "\n" + wrong


@pytest.mark.parametrize("name", ["input_angle_rad: bit 14 turned"])
def test_a_remaining_fault_changes_no_diagnosis(name: str) -> None:
    line = verdict(name, ("diagnose",))
    assert not line.wrong, line.line()


def test_a_dress_and_a_refusal_go_through_commands_of_their_own_process() -> None:
    lines = [
        verdict("UTF-16 big endian with mark", COMMANDS, alone=True),
        verdict("no unit anywhere", QUICK, alone=True),
    ]
    assert not (wrong := print_table(lines)), "\n" + wrong


@pytest.mark.parametrize("event", all_events(), ids=lambda event: event.name)
def test_a_real_event_is_not_set_aside(event: Event, tmp_path: Path) -> None:
    file = tmp_path / "log.csv"
    file.write_text(event.text)
    outcome = run("check", [file])
    assert (outcome.status, outcome.answer["samples"]) == (0, len(clean()))


@pytest.mark.parametrize("command", ["compare", "diagnose"])
@pytest.mark.parametrize(
    "event", [event for event in all_events() if event.step_arcsec], ids=lambda event: event.name
)
def test_a_slip_is_placed_in_its_run_and_hides_no_effect(
    event: Event, command: str, tmp_path: Path
) -> None:
    file = tmp_path / "log.csv"
    file.write_text(event.text)
    outcome = run(command, [file])
    assert outcome.status == 0
    (found,) = outcome.answer["events"]
    assert (str(found["run"]), found["time_s"]) == (RUN, AT_S)
    assert found["size_arcsec"] == pytest.approx(event.step_arcsec, rel=0.05)
    if command == "diagnose":
        assert outcome.answer["effects"] == [HIDDEN]
        ladder, right = (a["ladder"] for a in (outcome.answer, right_answer("diagnose")))
        for rung, clean_rung in zip(ladder, right, strict=True):
            # The size of the step is fitted: it is not a fault that is set aside.
            assert rung["rms_arcsec"] == pytest.approx(clean_rung["rms_arcsec"], rel=0.05)


@pytest.mark.parametrize(
    "name",
    [
        "100000 columns with names, and those of a recording",
        "a hundred thousand runs of one sample",
        "one cell of 2 MB of text in the column of runs",
        "quotes alone",
        "random letters, digits and separators",
        "gzip of 3 GB of rows",
        "a link to /dev/zero",
    ],
)
def test_a_hostile_file_is_answered_within_10_s_and_2_GiB(name: str) -> None:
    outcome = against(name, "check")
    assert not outcome.wrong(), outcome


def test_runs_that_take_turns_are_compared_within_10_s_and_2_GiB() -> None:
    outcome = against("two runs that take turns at every row", "compare")
    assert (outcome.status, outcome.error) == (0, "")


def test_evidence_that_inflates_is_answered_within_10_s_and_2_GiB() -> None:
    outcome = against_evidence()
    assert not outcome.wrong(), outcome


@pytest.mark.parametrize("damage", ["torque_Nm: two cells run together", "run: ovf"])
@pytest.mark.parametrize(
    "dress", ["long form: time, channel and value (pandas melt)", "one file a run, in a folder"]
)
def test_a_finding_names_the_line_or_the_file(dress: str, damage: str) -> None:
    line = combined(dress, damage)
    assert line is not None
    assert not line.wrong, line.line()


def test_two_files_with_the_same_fault_are_both_named() -> None:
    line = combined("one file a run, in a folder", "cycles: wild in two runs")
    assert line is not None
    assert not line.wrong, line.line()
