"""Commands accept the names that they print."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from conftest import DATA
from lostmotion import units
from lostmotion.calibrate import CONSTANTS
from lostmotion.cli import main
from lostmotion.commands.parser import make_parser
from lostmotion.drives import format_toml, read_drive
from lostmotion.effects.effect import Effect
from lostmotion.effects.library import library
from lostmotion.errors import InputError
from lostmotion.export import SETTINGS, make_controller, read_settings
from lostmotion.recordings import QUANTITIES
from lostmotion.recordings.columns import parse_column

DRIVES = sorted((DATA / "drives").glob("*.toml"))
DRIVE = DATA / "drives" / "size_25.toml"

NAMED = re.compile(r"^\s+(?P<name>[A-Za-z_][\w.]*) = (?P<value>\S+)", re.MULTILINE)
"""A name with its value, as printed by the commands."""

WORD = re.compile(r"(?<![\w./-])[A-Za-z]\w*_\w+(?![\w/-]*\.\w)")
"""A name of several parts in the output of a command."""


SEVERAL = ("radial_chain", "torsion_chain", "tolerance")
"""Arrays of tables in a drive file."""


def printed(capsys: pytest.CaptureFixture[str], *words: str | Path) -> str:
    assert main([str(word) for word in words]) == 0
    return capsys.readouterr().out


@pytest.fixture
def recordings(tmp_path: Path) -> Path:
    rng = np.random.default_rng(3)
    lines = ["run,time_s,torque_Nm,input_angle_rad,output_angle_rad,temperature_C"]
    for run in range(8):
        for k in range(100):
            time_s, torque = 0.02 * k, 50 * math.sin(0.2 * math.pi * k / 10)
            lost = torque / 4e4 + 1e-4 * (1 + 0.05 * run) * math.tanh(torque / 4)
            lost += 2e-6 * float(rng.standard_normal())
            angles = f"{2 * time_s!r},{0.02 * time_s + lost!r}"
            lines.append(f"{run},{time_s:.3f},{torque!r},{angles},{20 + 3 * run}")
    file = tmp_path / "recordings.csv"
    file.write_text("\n".join(lines) + "\n")
    return file


@pytest.mark.parametrize("profile", ["standard", "full", "gap"])
def test_every_limit_that_export_prints_is_taken_by_set(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], profile: str
) -> None:
    words = ["export", DRIVE, "-o", tmp_path / "params.h", "--profile", profile]
    text = printed(capsys, *words)
    limits = text[text.index("limits of the correction:") :].split("\n\n")[0]
    shown = {found["name"]: float(found["value"]) for found in NAMED.finditer(limits)}
    assert {"velocity_rad_s", "acceleration_rad_s2", "jerk_rad_s3"} <= set(shown)
    answer = json.loads(printed(capsys, *words, "--json", "-"))
    told = {**answer["limits"], **answer["watch"]}
    for names in (shown, told):
        for name, value in names.items():
            settings = read_settings([f"{name}={value!r}"])
            made = make_controller(read_drive(DRIVE), settings, profile=profile)  # type: ignore[arg-type]
            kept = {**vars(made.limits), **vars(made.watch)}
            assert kept[name] == pytest.approx(value, rel=1e-12), name
    every = [f"{name}={value!r}" for name, value in told.items()]
    again = json.loads(printed(capsys, *words, "--json", "-", "--set", *every))
    assert (again["limits"], again["watch"]) == (answer["limits"], answer["watch"])
    assert again["fingerprint"] == answer["fingerprint"]


def test_set_takes_its_own_keys_and_the_names_of_the_fields_in_c() -> None:
    for key in SETTINGS:
        for name in {key.written, key.written.replace("_per_", "_")}:
            if name.endswith("response_s"):
                continue  # the field is response_per_s: its unit has no angle
            assert read_settings([f"{name}=0.5"]) == {key.name: 0.5}


@pytest.mark.parametrize(
    ("short", "long"),
    [
        ("rad_s", "rad_per_s"),
        ("deg_s2", "deg_per_s2"),
        ("arcmin_s3", "arcmin_per_s3"),
        ("rev_min", "rpm"),
    ],
)
def test_an_angle_before_a_time_is_a_rate(short: str, long: str) -> None:
    one, other = units.unit(short), units.unit(long)
    assert one.dimension == other.dimension
    assert one.scale == pytest.approx(other.scale, rel=1e-15)
    # A torque times a time is a drag.
    assert units.unit("Nm_s").dimension[2] == 1


@pytest.mark.parametrize("file", DRIVES, ids=lambda file: file.stem)
def test_every_default_that_predict_prints_is_a_key_of_the_drive_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], file: Path
) -> None:
    text = printed(capsys, "predict", file)
    shown = [found for found in NAMED.finditer(text) if found["name"].startswith("design.")]
    document = tomllib_document(file)
    assert shown or "design" not in document
    for found in shown:
        *tables, key = found["name"].split(".")
        try:
            value = json.loads(found["value"])
        except json.JSONDecodeError:
            value = found["value"]
        if key in SEVERAL:
            continue  # printed as a sentence
        at = document
        for table in tables:
            at = at.setdefault(table, {})
        at[key] = value
    again = tmp_path / "again.toml"
    again.write_text(format_toml(document))
    read_drive(again)
    text = printed(capsys, "predict", again)
    left = {found["name"] for found in NAMED.finditer(text)}
    assert (
        not {n for found in shown if (n := found["name"]).rpartition(".")[2] not in SEVERAL} & left
    )


def tomllib_document(file: Path) -> dict:
    try:
        import tomllib
    except ImportError:
        import tomli as tomllib
    return tomllib.loads(file.read_text())


def kind_of(name: str) -> tuple[str, object]:
    """A name without its unit: gap_rad is not gap_rad_per_K."""
    base, unit = units.split_unit(name)
    return base, unit.dimension if unit else units.DIMENSIONLESS


def takes_effect(folder: Path, name: str, **values: float) -> None:
    """Read a drive file with one value of an effect, the others typical."""
    effect = library()[name]
    table: dict[str, object] = {"name": name}
    given = {kind_of(key) for key in values}
    for value in effect.values:
        if kind_of(value.name) not in given:
            table[value.name] = value.typical if value.typical else value.low
    document = tomllib_document(DRIVE)
    document["effect"] = [{**table, **values}]
    file = folder / "with_effect.toml"
    file.write_text(format_toml(document))
    make_controller(read_drive(file), profile="full")


@pytest.mark.parametrize("effect", library().values(), ids=lambda effect: effect.name)
def test_every_value_that_effects_prints_is_a_key_of_the_effect(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], effect: Effect
) -> None:
    text = printed(capsys, "effects", effect.name)
    for value in effect.values:
        assert value.name in text
        takes_effect(tmp_path, effect.name, **{value.name: value.typical or value.low})
    for name in re.findall(r"(?<=needs: ).*", text)[0].split(", "):
        if name in QUANTITIES or parsed(name):
            assert parsed(name), name


def test_every_size_that_forecast_prints_is_a_value_of_the_effect(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], recordings: Path
) -> None:
    answer = json.loads(printed(capsys, "forecast", DRIVE, recordings, "--json", "-"))
    told = [row for row in answer["effects"] if row["testable"] and row["parameter"] != "teeth"]
    assert len(told) > 10
    for row in told:
        unit = row["unit"].replace(" ", "_")
        name = row["parameter"] if unit == "-" else f"{row['parameter']}_{unit}"
        values = library()[row["name"]].values
        value = next(one for one in values if kind_of(one.name) == kind_of(name))
        told_in = units.split_unit(name)[1]
        kept_in = units.split_unit(value.name)[1]
        typical = value.typical or value.low
        if told_in is not None and kept_in is not None:
            typical = told_in.from_si(kept_in.to_si(typical))
        takes_effect(tmp_path, row["name"], **{name: typical})


def parsed(name: str) -> bool:
    """Whether a recording, or a map of its columns, may have the name."""
    try:
        return parse_column("file", name, name) is not None
    except InputError:
        return False


def test_every_column_that_check_and_forecast_request_is_one_that_they_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "bare.csv"
    rows = [f"{0.01 * k},{50 * math.sin(k / 20)!r},{1e-3 * math.sin(k / 20)!r}" for k in range(300)]
    file.write_text("\n".join(["time_s,torque_Nm,lost_motion_rad", *rows]) + "\n")
    for words in (("check", file), ("forecast", DRIVE, file), ("compare", DRIVE, file)):
        text = printed(capsys, *words)
        asked = set(re.findall(r"(?<=not testable with these columns: no )[\w, ]+", text))
        asked |= set(re.findall(r"(?<=  without )\w+", text))
        names = {name for group in asked for name in group.split(", ")}
        assert names, words
        for name in names:
            assert parsed(name), name


def test_the_table_of_replay_names_what_a_recording_names(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], recordings: Path
) -> None:
    table = tmp_path / "ticks.csv"
    printed(capsys, "replay", DRIVE, recordings, "--table", table)
    assert {"run", "time_s", "torque_Nm"} <= set(table.read_text().splitlines()[0].split(","))


def test_what_diagnose_and_fit_print_of_an_effect_is_what_its_table_takes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], recordings: Path
) -> None:
    fitted = tmp_path / "fitted.toml"
    words = ["fit", DRIVE, recordings, "--add", "thermal_gap", "-o", fitted]
    names = set(re.findall(r"^ *(\w+\.\w+)\b", printed(capsys, *words), re.MULTILINE))
    names |= set(
        re.findall(r"^ *(\w+\.\w+) =", printed(capsys, "diagnose", DRIVE, recordings), re.MULTILINE)
    )
    assert any(name.startswith("thermal_gap.") for name in names)
    for name in names:
        effect, _, value = name.partition(".")
        if effect in library():
            typical = next(v for v in library()[effect].values if v.name == value)
            takes_effect(tmp_path, effect, **{value: typical.typical or typical.low})
    # and the file itself is a drive
    read_drive(fitted)


def examples() -> Iterator[tuple[str, str]]:
    """Names with units in the help of every command."""
    parser = make_parser()
    commands = next(action for action in parser._actions if action.dest == "command")
    assert commands.choices is not None
    for command, one in commands.choices.items():  # type: ignore[union-attr]
        for word in sorted(set(WORD.findall(one.format_help()))):
            if units.split_unit(word)[1] is not None and word.lower() != word.upper():
                yield command, word


def test_every_name_with_a_unit_in_the_help_is_taken_somewhere() -> None:
    found = list(examples())
    assert {"period_us", "input_angle_rev", "lost_motion_rev"} <= {word for _, word in found}
    keys = {key.name for key in SETTINGS}
    for command, word in found:
        base, _ = units.split_unit(word)
        if base in keys:
            read_settings([f"{word}=0.5"])
        elif command == "calibrate" and word in CONSTANTS:
            continue  # of --constants, a key of the drive file
        else:
            assert parsed(word), (command, word)
