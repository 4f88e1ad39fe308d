"""Checks of saved evidence: every value is in its range before it is used.

A file may come from any source, and its checksum detects damage, not manipulation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from lostmotion.arrays import FloatArray
from lostmotion.errors import InputError

RUNS_MAX, COLUMNS_MAX = 100_000, 10_000
"""Largest number of runs and columns of evidence; chosen: a thousand times that of a campaign."""

SIZE_MAX = 1e100
"""Largest magnitude of a number, so that products of squares do not overflow."""

SAMPLES_MAX = 2.0**53
"""Largest number of samples of a run that a float represents exactly."""

LIKE = 1e-6
"""Largest relative asymmetry of a Gram matrix; each of its terms is computed to 1e-16."""

NUMBERS = (
    *("point", "spread", "rows", "white", "plain", "white_scale", "plain_scale"),
    *("white_precision", "plain_precision"),
)
"""Arrays of numbers."""

Saved = Mapping[str, npt.NDArray[Any]]


def check_arrays(file: str | Path, saved: Saved) -> None:
    """Refuse arrays of wrong type or shape, indices out of range and invalid numbers.

    Raises
    ------
    InputError
        Names the array.
    """

    def refuse(name: str, found: str, expected: str) -> InputError:
        return InputError(file, name, found, expected)

    texts = ("schema", "about", "names")
    for name in (*NUMBERS, "fixed", "scatter", "response", *texts):
        if name not in saved:
            raise refuse(name, "no such array", "evidence by diagnose --save-evidence")
    for name in NUMBERS:
        values = saved[name]
        if values.dtype != np.float64:
            raise refuse(name, f"{values.dtype} values", "float64")
        if not np.all(np.abs(values) <= SIZE_MAX):
            raise refuse(name, "a value that is not a number or too large", "finite numbers")
    gram = saved["white"]
    runs, columns = gram.shape[0] if gram.ndim else 0, gram.shape[-1] if gram.ndim else 0
    if not (0 < runs <= RUNS_MAX and 0 < columns <= COLUMNS_MAX):
        raise refuse("white", f"{runs} runs of {columns} columns", "evidence of a campaign")
    names = saved["names"]
    if names.ndim != 1 or names.dtype.kind != "U" or len(set(names.tolist())) != names.size:
        raise refuse("names", "something else", "a list of different names")
    blocks = [f"block_{i}" for i in range(names.size)]
    for name in ("fixed", "scatter", "response", *blocks):
        if name not in saved or saved[name].dtype.kind != "i":
            raise refuse(name, "values that are not integers", "places of columns")
        if saved[name].ndim != (0 if name == "response" else 1):
            raise refuse(name, f"an array of shape {saved[name].shape}", "a list of places")
    used = [np.ravel(saved[name]) for name in ("fixed", "scatter", *blocks, "response")]
    if not np.array_equal(np.sort(np.concatenate(used)), np.arange(columns)):
        raise refuse("fixed, scatter, names", "places of other columns", f"each of {columns} once")
    fixed = saved["fixed"].size
    shapes = {
        "plain": (runs, columns, columns),
        "white": (runs, columns, columns),
        "white_scale": (columns,),
        "plain_scale": (columns,),
        "white_precision": (fixed,),
        "plain_precision": (fixed,),
        "spread": (runs,),
        "rows": (runs,),
    }
    for name, shape in shapes.items():
        if saved[name].shape != shape:
            raise refuse(name, f"an array of shape {saved[name].shape}", f"{shape}")
    if saved["point"].ndim != 1 or saved["point"].size > fixed:
        raise refuse("point", f"an array of shape {saved['point'].shape}", f"up to {fixed} values")
    for name in ("white_scale", "plain_scale"):
        if not np.all(saved[name] >= 1 / SIZE_MAX):
            raise refuse(name, "a value of zero or less, or too small", "scales")
    for name in ("white_precision", "plain_precision", "spread"):
        if not np.all(saved[name] >= 0):
            raise refuse(name, "a negative value", "zero or more")
    rows = saved["rows"]
    if not np.all((rows >= 1) & (rows <= SAMPLES_MAX) & (rows == np.floor(rows))):
        raise refuse("rows", "something else", "samples of each run, 1 or more")
    for name in ("white", "plain"):
        if not all(map(is_gram, saved[name])):
            raise refuse(
                name, "a matrix of no columns", "Gram matrices: symmetric, x_ij^2 <= x_ii x_jj"
            )
    mean = saved["scatter"][-1:]
    if not np.all(saved["plain"][:, mean, mean].sum() > 0):
        raise refuse("plain", "zeros in the column that removes the mean", "its number of samples")


def is_gram(matrix: FloatArray) -> bool:
    """Whether a matrix can hold the products of columns with each other."""
    size = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    room = LIKE * np.outer(size, size) + np.finfo(np.float64).tiny
    return bool(
        np.all(np.diag(matrix) >= 0)
        and np.all(np.abs(matrix - matrix.T) <= room)
        and np.all(np.abs(matrix) <= np.outer(size, size) + room)
    )


# --- metadata
# -------------------------------------------------------------

Check = Callable[[Any], bool]


def finite_number(value: Any) -> bool:
    """A finite number."""
    kind = isinstance(value, (int, float)) and not isinstance(value, bool)
    return kind and abs(value) <= SIZE_MAX and math.isfinite(value)


def positive(value: Any) -> bool:
    """A number above zero."""
    return finite_number(value) and value > 0


def text(value: Any) -> bool:
    """A text."""
    return isinstance(value, str)


def listed(check: Check) -> Check:
    """Make a check of every entry of a list."""
    return lambda value: isinstance(value, list) and all(map(check, value))


def named(check: Check) -> Check:
    """Make a check that applies another check to every value of a table."""
    return lambda value: isinstance(value, dict) and all(map(check, value.values()))


def table(**checks: Check) -> Check:
    """Make a check of a table with at least these keys."""
    return lambda value: (
        isinstance(value, dict)
        and all(key in value and check(value[key]) for key, check in checks.items())
    )


ABOUT: dict[str, Check] = {
    "rated_torque_Nm": positive,
    "ratio": lambda value: finite_number(value) and abs(value) > 1,
    "knots_Nm": lambda value: listed(positive)(value) and len(value) > 0,
    "radius_Nm": lambda value: listed(positive)(value) and len(value) > 0,
    "effects": listed(text),
    "candidates": listed(
        table(
            name=text,
            named=lambda value: isinstance(value, bool),
            covariate=text,
            shape=text,
            starts=listed(listed(finite_number)),
            start_of=listed(lambda value: isinstance(value, int) and not isinstance(value, bool)),
            kind=text,
            of_form=lambda value: isinstance(value, bool),
        )
    ),
    "closed": named(text),
    "swing_arcsec": listed(lambda value: finite_number(value) and value >= 0),
    "given_arcsec": named(finite_number),
    "runs": lambda value: listed(text)(value) and len(set(value)) == len(value),
    "events": listed(
        table(run=text, time_s=finite_number, size_arcsec=finite_number, score=finite_number)
    ),
    "data_fingerprints": lambda value: listed(text)(value) and len(value) > 0,
    "run_fingerprints": listed(text),
    "alone": listed(table(verdict=text, effects=listed(text))),
}
"""Metadata and their checks."""


def check_about(file: str | Path, about: Any, runs: int, sizes: Mapping[str, int]) -> None:
    """Refuse metadata of a wrong type, or inconsistent with the arrays.

    Parameters
    ----------
    file : str or Path
        For messages.
    about : object
        Metadata as parsed from JSON.
    runs : int
    sizes : mapping
        Columns of each candidate.

    Raises
    ------
    InputError
        Names the entry.
    """
    if not isinstance(about, dict):
        raise InputError(file, "about", "something else", "a table")
    for key, check in ABOUT.items():
        if key not in about or not check(about[key]):
            found = "a value of another kind, or out of range" if key in about else "no such entry"
            raise InputError(file, key, found, "what diagnose --save-evidence writes")
    for key in ("runs", "run_fingerprints", "swing_arcsec"):
        if len(about[key]) != runs:
            raise InputError(
                file, key, f"{len(about[key])} entries", f"one for each of {runs} runs"
            )
    for event in about["events"]:
        if event["run"] not in about["runs"]:
            raise InputError(file, "events", f"run {event['run']}", "one of the runs")
    missing = sorted(set(about["effects"]) - set(about["given_arcsec"]))
    if missing:
        raise InputError(
            file, "given_arcsec", f"no entry for {missing[0]}", "the size of each effect"
        )
    told = [one["name"] for one in about["candidates"]]
    if sorted(told) != sorted(sizes):
        raise InputError(file, "candidates", "other names", "those of the columns, each once")
    for one in about["candidates"]:
        starts = len(one["starts"])
        columns = sizes[one["name"]] if one["named"] else len(one["start_of"])
        fits = len(one["start_of"]) == columns and set(one["start_of"]) <= set(range(starts))
        if not fits:
            raise InputError(
                file, f"candidates, {one['name']}", "starts of other columns", "one per column"
            )
