"""Evidence with a correct checksum and wrong values: one line, and no result."""

from __future__ import annotations

import json
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fuzz_evidence
import numpy as np
import pytest
from sound_files import made

from lostmotion.cli import main
from lostmotion.evidence.file import checksum

Saved = dict[str, Any]


def told(change: Callable[[dict[str, Any]], object]) -> Callable[[Saved], None]:
    """Change the metadata beside the arrays."""

    def make(saved: Saved) -> None:
        about = json.loads(str(saved["about"]))
        change(about)
        saved["about"] = np.array(json.dumps(about))

    return make


def put(name: str, place: Any, value: float) -> Callable[[Saved], None]:
    """Change one value of an array."""

    def make(saved: Saved) -> None:
        saved[name] = saved[name].copy()
        saved[name][place] = value

    return make


FINDINGS: dict[str, tuple[Callable[[Saved], None], str]] = {
    "a place out of bounds": (put("fixed", 0, 10_000), "fixed, scatter, names"),
    "a place below": (put("scatter", 1, -3), "fixed, scatter, names"),
    "a place twice": (put("block_0", 0, 0), "fixed, scatter, names"),
    "not a number": (put("white", (0, 1, 1), np.nan), "white"),
    "endless": (put("plain_scale", 3, np.inf), "plain_scale"),
    "a scale of nothing": (put("white_scale", 2, 1e-200), "white_scale"),
    "not symmetric": (put("plain", (1, 0, 2), 1e9), "plain"),
    "a negative square": (put("white", (2, 4, 4), -1.0), "white"),
    "samples of none": (put("rows", 0, 0.0), "rows"),
    "no mean": (lambda saved: saved.update(plain=0 * saved["plain"]), "plain"),
    "half a sample": (put("rows", 1, 2.5), "rows"),
    "noise below zero": (put("spread", 0, -1.0), "spread"),
    "no point": (lambda saved: saved.pop("point"), "point"),
    "fewer runs": (lambda saved: saved.update(spread=saved["spread"][:-1]), "spread"),
    "single precision": (lambda s: s.update(white=s["white"].astype(np.float32)), "white"),
    "nothing told": (lambda saved: saved.update(about=np.array("[]")), "about"),
    "told badly": (lambda saved: saved.update(about=np.array("{")), "about"),
    "no runs told": (told(lambda about: about.pop("runs")), "runs"),
    "a run too many": (told(lambda about: about["runs"].append("x")), "runs"),
    "an event of no run": (
        told(
            lambda about: about["events"].append(
                {"run": "no", "time_s": 0, "size_arcsec": 1, "score": 1}
            )
        ),
        "events",
    ),
    "a candidate of another name": (
        told(lambda about: about["candidates"][0].update(name="other")),
        "candidates",
    ),
    "a start that is not": (
        told(lambda about: about["candidates"][0].update(start_of=[7])),
        "candidates",
    ),
    "values of another effect": (
        told(lambda about: about["candidates"][0].update(starts=[[0.0, 1.0, 2.0]])),
        "asymmetric_stiffness",
    ),
    "two columns of one value": (
        told(lambda about: about["candidates"][2].update(start_of=[0, 0])),
        "thermal_gap",
    ),
    "a kind that is none": (
        told(lambda about: about["candidates"][0].update(kind="odd")),
        "asymmetric_stiffness",
    ),
    "a ratio of nothing": (told(lambda about: about.update(ratio=0)), "ratio"),
}
"""Found by fuzzing: each caused a traceback before the values were checked."""


@pytest.mark.parametrize("name", FINDINGS)
def test_a_value_out_of_range_is_refused_by_its_name(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    change, key = FINDINGS[name]
    saved = dict(fuzz_evidence.sound())
    change(saved)
    file = tmp_path / "one.npz"
    np.savez(file, **saved, checksum=np.array(checksum(saved)))
    assert main(["merge", str(file), "--json", str(tmp_path / "answer.json")]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert f": {key}" in error
    assert [p.name for p in tmp_path.iterdir()] == ["one.npz"]


def test_evidence_as_it_was_saved_is_taken(tmp_path: Path) -> None:
    file = tmp_path / "one.npz"
    file.write_bytes(made("evidence")["one.npz"])
    assert main(["merge", str(file), "--quiet"]) == 0


def test_sound_evidence_is_taken(tmp_path: Path) -> None:
    saved = dict(fuzz_evidence.sound())
    file = tmp_path / "one.npz"
    np.savez(file, **saved, checksum=np.array(checksum(saved)))
    assert main(["merge", str(file), "--quiet"]) == 0


@pytest.mark.parametrize("number", [3450, 6593, 7936, 13020])
def test_what_fuzzing_found_is_answered_or_refused(number: int) -> None:
    dice = random.Random(1_000_000_007 + number)
    saved, said = fuzz_evidence.damaged(dice)
    wrong = fuzz_evidence.judge(saved, fuzz_evidence.other() if dice.random() < 0.2 else None)
    assert not wrong, f"{said}: {wrong}"


def test_changed_evidence_never_ends_in_a_traceback() -> None:

    for number in range(150):
        saved, said = fuzz_evidence.damaged(random.Random(f"evidence {number}"))
        wrong = fuzz_evidence.judge(saved, fuzz_evidence.other() if number % 3 == 0 else None)
        assert not wrong, f"{number}: {said}: {wrong}"
