"""The commissioning routine on sound and faulty axes: joints of the plant with random values."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import plant_table
import pytest

from lostmotion.cli import main

SOUND = 200
FAULTY = [*range(8), 28]  # 28: a torque fed forward reaches the bound of the sensed one
FAULTS = 45  # in commission.c


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The program; the blobs of the axes are in the same folder."""
    made = tmp_path_factory.mktemp("commission") / "commission"
    examples = plant_table.ROOT / "firmware_examples"
    sources = [
        plant_table.HERE / "commission.c",
        plant_table.HERE / "plant.c",
        examples / "commissioning" / "commissioning.c",
        examples / "joint" / "sine.c",
        *plant_table.LIBRARY,
    ]
    options = [*plant_table.FLAGS, f"-I{examples}", f"-I{examples / 'joint'}"]
    subprocess.run(["cc", *options, *map(str, sources), "-lm", "-o", made], check=True)
    return made


def blob_of(program: Path, seed: int) -> str:
    """SEED=BLOB of an axis: output of `export` for its catalogue sheet."""
    sheet, blob = program.parent / f"{seed}.toml", program.parent / f"{seed}.bin"
    if not blob.exists():
        done = subprocess.run([program, "sheet", str(seed)], capture_output=True, check=True)
        sheet.write_bytes(done.stdout)
        period = done.stdout.decode().split("period_us = ")[1].strip()
        options = ["--set", f"period_us={period}", "--quiet"]
        assert main(["export", str(sheet), "-o", str(blob), *options]) == 0
    return f"{seed}={blob}"


def say(program: Path, what: str, seeds: Iterable[int]) -> tuple[int, list[str]]:
    """Exit status, and one line per run."""
    command = [program, what, *(blob_of(program, seed) for seed in seeds)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.returncode, (done.stdout + done.stderr).splitlines()


def test_no_false_alarm_on_sound_axes(program: Path) -> None:
    status, lines = say(program, "sound", range(SOUND))
    assert len(lines) == SOUND
    assert status == 0, [line for line in lines if " ok " not in line]


def test_every_fault_is_found_and_named(program: Path) -> None:
    status, lines = say(program, "faults", FAULTY)
    assert len(lines) == FAULTS * len(FAULTY)
    assert status == 0, [line for line in lines if " ok " not in line]
