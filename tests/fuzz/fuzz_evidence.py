"""Evidence from other sources: values changed under a correct checksum, then merged and evaluated.

Every case is refused in one line or gives finite numbers. Prints how many there were.
"""

from __future__ import annotations

import argparse
import io
import json
import math
import random
import sys
import time
import traceback
import warnings
from collections import Counter
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

sys.path.insert(0, str(Path(__file__).parent))
from damage import NUMBERS, odd_value
from sound_files import made

from lostmotion.discover.merged_verdict import judge_body
from lostmotion.effects.library import library
from lostmotion.errors import InputError
from lostmotion.evidence.file import body_of
from lostmotion.evidence.merging import merge_bodies

Saved = dict[str, npt.NDArray[Any]]

KEPT = ("asymmetric_stiffness", "creep", "thermal_gap", "torque_offset", "gap by temperature")
"""Candidates that are kept: with few columns a case takes a millisecond."""

FIXED_KEPT = 6
"""Columns of the baseline model that are kept."""


@cache
def sound() -> Saved:
    """Small sound evidence: that of a campaign, cut down to some of its columns."""
    with np.load(io.BytesIO(made("evidence")["one.npz"]), allow_pickle=False) as data:
        saved = {name: data[name] for name in data.files if name != "checksum"}
    names = saved["names"].tolist()
    kept = [name for name in names if name in KEPT]
    fixed = saved["fixed"][:FIXED_KEPT]
    blocks = [saved[f"block_{names.index(name)}"] for name in kept]
    keep = np.concatenate([fixed, saved["scatter"], *blocks, [saved["response"]]])
    out: Saved = {n: a for n, a in saved.items() if not n.startswith("block_")}
    for kind in ("white", "plain"):
        out[kind] = saved[kind][:, keep[:, None], keep]
        out[f"{kind}_scale"] = saved[f"{kind}_scale"][keep]
        out[f"{kind}_precision"] = saved[f"{kind}_precision"][:FIXED_KEPT]
    out["point"] = saved["point"][:FIXED_KEPT]
    at = 0
    for name, places in (
        ("fixed", fixed),
        ("scatter", saved["scatter"]),
        *((f"block_{i}", b) for i, b in enumerate(blocks)),
    ):
        out[name] = np.arange(at, at + places.size)
        at += places.size
    out["response"] = np.array(at)
    out["names"] = np.array(kept)
    about = json.loads(str(saved["about"]))
    about["candidates"] = [one for one in about["candidates"] if one["name"] in kept]
    about["candidates"].sort(key=lambda one: kept.index(one["name"]))
    out["about"] = np.array(json.dumps(about))
    return out


def damaged(dice: random.Random) -> tuple[Saved, str]:
    """Return the evidence with one to three changes, and their description."""
    saved = {name: values.copy() for name, values in sound().items()}
    said = []
    for _ in range(dice.choice([1, 1, 1, 2, 3])):
        said.append(damage_about(dice, saved) if dice.random() < 0.4 else damage_array(dice, saved))
    return saved, "; ".join(said)


def damage_array(dice: random.Random, saved: Saved) -> str:
    """Change an array: a value, all values, its kind or its shape."""
    name = dice.choice(sorted(saved))
    values = saved[name]
    kind = dice.randrange(10)
    if kind <= 4 and values.size and values.dtype.kind in "fi":
        place = dice.randrange(values.size)
        flat = values.reshape(-1).copy()
        old = flat[place]
        new = dice.choice(
            [dice.choice(NUMBERS), -old, old * (1 + 1e-3 * dice.random()), 0, old + 1, old - 1]
        )
        try:
            flat[place] = new
        except (OverflowError, ValueError):
            flat[place] = 0
        saved[name] = flat.reshape(values.shape)
        return f"{name}[{place}] {old} -> {flat[place]}"
    if kind == 5:
        del saved[name]
        return f"without {name}"
    if kind == 6:
        saved[name] = values[..., :-1] if values.ndim and values.shape[-1] else values[None]
        return f"{name} shorter"
    if kind == 7:
        saved[name] = np.concatenate((values, values)) if values.ndim else np.array([values])
        return f"{name} twice"
    if kind == 8:
        wanted = dice.choice(["float32", "int32", "complex128", "U3", "bool", "S2", "M8[s]"])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                saved[name] = values.astype(wanted)
            except (ValueError, TypeError, RuntimeError):  # NumPy has no such cast
                saved[name] = np.zeros(values.shape, wanted)
        return f"{name} as {wanted}"
    if values.dtype.kind == "f":
        saved[name] = values * dice.choice([0, -1, 1e-200, 1e90, 1e-30, 2])
        return f"{name} times something"
    saved[name] = values.T.copy() if values.ndim else values
    return f"{name} turned"


def damage_about(dice: random.Random, saved: Saved) -> str:
    """Change an entry of the metadata."""
    if "about" not in saved or saved["about"].dtype.kind != "U":
        return "nothing"
    try:
        about = json.loads(str(saved["about"]))
    except ValueError:
        return "nothing"
    holders: list[tuple[Any, Any]] = []

    def walk(value: Any) -> None:
        items = value.items() if isinstance(value, dict) else enumerate(value)
        for key, inner in items:
            holders.append((value, key))
            if isinstance(inner, (dict, list)):
                walk(inner)

    if isinstance(about, (dict, list)):
        walk(about)
    if not holders:
        return "nothing"
    holder, key = dice.choice(holders)
    kind = dice.randrange(4)
    if kind == 0 and isinstance(holder, dict):
        del holder[key]
        said = f"about: without {key}"
    elif kind == 1 and isinstance(holder[key], list):
        holder[key] = holder[key] * 2 if dice.random() < 0.5 else holder[key][:-1]
        said = f"about: {key} of another length"
    else:
        new = odd_value(dice, holder[key])
        new = new if isinstance(new, (int, float, str, bool, list, dict)) else None
        holder[key] = new
        said = f"about: {key} -> {str(new)[:40]}"
    if isinstance(about, dict) and dice.random() < 0.1:
        event = {"run": "0", "time_s": 1.0, "size_arcsec": 5.0, "score": 9.0}
        event[dice.choice(sorted(event))] = dice.choice(NUMBERS)
        about["events"] = [event]
    try:
        saved["about"] = np.array(json.dumps(about))
    except (ValueError, RecursionError):
        saved["about"] = np.array("{")
    return said


def finite(value: Any) -> bool:
    """Whether an answer has finite numbers only."""
    if isinstance(value, dict):
        return all(map(finite, value.values()))
    if isinstance(value, (list, tuple)):
        return all(map(finite, value))
    return not isinstance(value, float) or math.isfinite(value)


def judge(saved: Saved, beside: Saved | None) -> str:
    """Merge a case, alone or with sound evidence; return its fault, or nothing."""
    files = ["case.npz", "sound.npz"]
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            bodies = [body_of(f, s) for f, s in zip(files, (saved, beside), strict=True) if s]
            answer = judge_body(merge_bodies(bodies, files[: len(bodies)]), library())
    except InputError as error:
        said = str(error)
        clear = ": found " in said and ", expected " in said and "\n" not in said
        return "" if clear else f"not a clear line: {said[:200]}"
    except Exception:
        return traceback.format_exc()
    return "" if finite(answer) else "a number that is not finite"


def other() -> Saved:
    """Give sound evidence of other recordings."""
    saved = dict(sound())
    about = json.loads(str(saved["about"]))
    about["data_fingerprints"] = ["sha256:other"]
    about["run_fingerprints"] = [f"sha256:{i}" for i in range(len(about["runs"]))]
    saved["about"] = np.array(json.dumps(about))
    return saved


def main() -> int:
    """Evaluate cases and print their numbers."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0)
    arguments = parser.parse_args()
    begin = time.monotonic()
    kinds: Counter[str] = Counter()
    examples: dict[str, str] = {}
    beside = other()
    assert judge(sound(), None) == "", judge(sound(), None)
    assert judge(sound(), beside) == "", judge(sound(), beside)
    for number in range(arguments.first, arguments.first + arguments.cases):
        dice = random.Random(arguments.seed * 1_000_000_007 + number)
        saved, said = damaged(dice)
        wrong = judge(saved, beside if dice.random() < 0.2 else None)
        if wrong:
            kind = " | ".join(line.strip() for line in wrong.strip().splitlines()[-3:])[:300]
            kinds[kind] += 1
            examples.setdefault(kind, f"case {number}: {said}")
    for kind, count in kinds.most_common(20):
        print(f"{count} x {kind}\n   {examples[kind]}")
    failed = sum(kinds.values())
    seconds = time.monotonic() - begin
    print(f"evidence: {arguments.cases} cases, {failed} failed, {seconds:.0f} s")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main())
