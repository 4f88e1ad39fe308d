"""Common to all commands: help with an example, JSON, verbosity, exit status, no colours."""

from __future__ import annotations

import argparse
import json
import re
import shlex
from pathlib import Path

import pytest

from lostmotion.cli import join_signed, main, make_parser, repeat_options

DATA = Path(__file__).parents[1] / "data"
DRIVE = DATA / "drives" / "size_25.toml"
DRAWN = DATA / "drives" / "reference_a.toml"
LOOPS = DATA / "cycloidal_locked_output"


def commands() -> dict[str, argparse.ArgumentParser]:
    (choices,) = (
        action.choices
        for action in make_parser()._actions
        if isinstance(action, argparse._SubParsersAction)
    )
    return dict(choices)


NAMES = sorted(commands())

QUICK = {
    "predict": [DRIVE],
    "clearances": [DRAWN],
    "check": [LOOPS / "base_onyx_runin5.csv", "--map", "POSITION=lost_motion_rev",
              "--map", "TORQUE=torque_Nm", "--map", "TIME=time_s", "--map", "test_nr=run"],
    "compare": [LOOPS / "drive.toml", LOOPS],
    "replay": [LOOPS / "drive.toml", LOOPS],
    "export": [DRIVE, "-o", "params.h"],
    "effects": ["thermal_gap"],
    "completion": ["bash"],
}  # fmt: skip
"""Commands that answer at once, and their arguments."""


def test_every_command_of_the_interface_is_there() -> None:
    expected = (
        "new predict clearances compare diagnose fit effects design export replay check forecast "
        "next workbench demo completion"
    )
    assert set(NAMES) >= set(expected.split())


@pytest.mark.parametrize("name", NAMES)
def test_help_ends_with_an_example_that_the_parser_takes(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([name, "--help"]) == 0
    out = capsys.readouterr().out
    example = re.search(r"example: (lostmotion .*)\n?\Z", out)
    assert example, out
    words = shlex.split(example[1].partition(" > ")[0])
    assert words[:2] == ["lostmotion", name]
    parsed = make_parser().parse_args(join_signed(words[1:]))
    assert parsed.command == name


@pytest.mark.parametrize("name", NAMES)
def test_bad_usage_is_one_line_and_status_2(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([name, "--nonsense"]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert error.startswith(f"lostmotion {name}: ") or error.startswith("lostmotion: ")
    assert main([name, "--quiet", "--verbose"]) == 2
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize("name", sorted(QUICK))
def test_answers_have_no_colours_json_is_json_and_quiet_is_quiet(
    name: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)

    def run(*more: str) -> tuple[str, str]:
        assert main([name, *map(str, QUICK[name]), *more]) == 0
        said = capsys.readouterr()
        return said.out, said.err

    plain, error = run()
    assert plain
    assert error == ""
    if name != "completion":  # a script may contain anything
        assert "\033" not in plain
    answer = json.loads(run("--json", "-")[0])
    assert answer["schema"].startswith("lostmotion.")
    assert run("--quiet", "--json", "answer.json") == ("", "")
    assert json.loads((tmp_path / "answer.json").read_text())["schema"] == answer["schema"]
    loud, said = run("--verbose")
    assert "\033" not in said
    assert loud == plain


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("fit d.toml a.csv --add wear creep -o f", "fit d.toml a.csv --add wear --add creep -o f"),
        ("fit --add wear creep there d.toml", "fit --add wear --add creep there d.toml"),
        ("fit --add=wear creep --add free_play", "fit --add=wear --add creep --add free_play"),
        ("fit --add wear d.toml a", "fit --add wear d.toml a"),
        (
            "check --map A=time_s B=-torque_Nm a.csv",
            "check --map A=time_s --map B=-torque_Nm a.csv",
        ),
        ("check a.csv --map A=time_s B", "check a.csv --map A=time_s B"),
        ("check --map", "check --map"),
        ("fit --add --json -", "fit --add --json -"),
        ("predict d.toml --torque -1:1:3", "predict d.toml --torque -1:1:3"),
    ],
)
def test_an_option_of_several_values_may_be_given_them_at_once(
    words: str, expected: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there").mkdir()
    assert repeat_options(words.split()) == expected.split()


def test_several_maps_behind_one_option_are_all_read(capsys: pytest.CaptureFixture[str]) -> None:
    maps = [str(word) for word in QUICK["check"] if "=" in str(word)]
    assert main(["check", str(LOOPS / "base_onyx_runin5.csv"), "--map", *maps]) == 0
    assert "samples" in capsys.readouterr().out


@pytest.mark.parametrize("command", ["design spec.toml", "demo", "export drive.toml"])
def test_no_name_is_not_the_folder_at_hand(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main([*command.split(), "-o", ""]) == 2
    assert not list(tmp_path.iterdir())
