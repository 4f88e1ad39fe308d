"""Sufficient statistics: one Gram matrix of whitened columns for each run.

Everything after them (refit by one step, tests, scatter, leave-one-run-out, angles, next run) is
small dense algebra. They can be saved and combined without reading the recordings again.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from lostmotion.discover.noise import Noise
from lostmotion.errors import InputError, one_line
from lostmotion.files import write_whole

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.intp]

SCHEMA = "lostmotion.evidence/1"
"""Name and version of the saved form."""


@dataclass
class Evidence:
    """Gram matrices ``[run, column, column]`` of whitened, scaled columns.

    Attributes
    ----------
    gram : ndarray
        In units of the innovation variance.
    scale : ndarray
        What each column was divided by.
    fixed, scatter, response : ndarray or int
        Places of the base's columns, of the columns that scatter from run to run, of the residual.
    blocks : dict
        Places of each candidate's columns.
    precision : ndarray
        Prior precision of the fixed columns, scaled as they are.
    """

    gram: FloatArray
    scale: FloatArray
    fixed: IntArray
    scatter: IntArray
    blocks: dict[str, IntArray]
    response: int
    precision: FloatArray

    def save(self, file: str | Path) -> None:
        """Write everything to an ``.npz`` file, whole or not at all."""
        out = io.BytesIO()
        blocks: dict[str, Any] = {
            f"block_{i}": places for i, places in enumerate(self.blocks.values())
        }
        np.savez_compressed(
            out,
            schema=np.array(SCHEMA),
            gram=self.gram,
            scale=self.scale,
            fixed=self.fixed,
            scatter=self.scatter,
            response=np.array(self.response),
            precision=self.precision,
            names=np.array(list(self.blocks)),
            **blocks,
        )
        write_whole(file, out.getvalue())

    @property
    def runs(self) -> int:
        """Number of runs."""
        return int(self.gram.shape[0])

    def index(self, *blocks: str) -> IntArray:
        """Places of the base's columns and of some blocks, the residual last."""
        parts = [self.fixed, *(self.blocks[name] for name in blocks), np.array([self.response])]
        return np.concatenate(parts).astype(np.intp)


def load(file: str | Path) -> Evidence:
    """Read what `Evidence.save` wrote.

    Raises
    ------
    InputError
        When the file is not evidence of this version.
    """
    try:
        with np.load(file, allow_pickle=False) as data:
            if str(data["schema"]) != SCHEMA:
                raise InputError(file, "schema", str(data["schema"]), SCHEMA)
            names = [str(name) for name in data["names"]]
            return Evidence(
                data["gram"],
                data["scale"],
                data["fixed"],
                data["scatter"],
                {name: data[f"block_{i}"] for i, name in enumerate(names)},
                int(data["response"]),
                data["precision"],
            )
    except (OSError, ValueError, KeyError) as error:
        raise InputError(file, "", one_line(str(error)), "evidence by Evidence.save") from None


def merge(parts: Sequence[Evidence]) -> Evidence:
    """Combine evidence of several campaigns that was gathered at the same linearisation.

    Raises
    ------
    InputError
        When the parts do not have the same columns.
    """
    first = parts[0]
    grams = [first.gram]
    for number, part in enumerate(parts[1:], start=2):
        same = (
            part.gram.shape[1:] == first.gram.shape[1:]
            and list(part.blocks) == list(first.blocks)
            and all(np.array_equal(part.blocks[k], first.blocks[k]) for k in first.blocks)
        )
        if not same:
            raise InputError(f"evidence {number}", "", "other columns", "those of the first")
        ratio = part.scale / first.scale
        grams.append(part.gram * np.outer(ratio, ratio))
    return Evidence(
        np.concatenate(grams),
        first.scale,
        first.fixed,
        first.scatter,
        dict(first.blocks),
        first.response,
        first.precision,
    )


def gather(
    fixed: FloatArray,
    precision: FloatArray,
    scatter: FloatArray,
    blocks: Sequence[tuple[str, FloatArray]],
    response: FloatArray,
    noise: Noise,
    starts: IntArray,
) -> Evidence:
    """Whiten all columns and form the Gram matrix of each run.

    Parameters
    ----------
    fixed, scatter, blocks
        Columns ``[row, column]`` in arc seconds per unit.
    precision : ndarray
        Prior precision of the fixed columns.
    response : ndarray
        Residual about the linearised model, deviations put back.
    """
    parts = [fixed, scatter, *(columns for _, columns in blocks), response[:, None]]
    counts = [part.shape[1] for part in parts]
    offsets = np.concatenate(([0], np.cumsum(counts)))
    total = int(offsets[-1])
    scale = np.concatenate([np.sqrt(np.mean(part * part, axis=0)) for part in parts])
    scale[(scale == 0) | ~np.isfinite(scale)] = 1.0
    scale[-1] = 1.0
    runs = starts.size - 1
    gram = np.empty((runs, total, total))
    for r in range(runs):
        a, b = int(starts[r]), int(starts[r + 1])
        piece = np.empty((b - a, total), order="F")
        for part, at, count in zip(parts, offsets[:-1], counts, strict=True):
            piece[:, at : at + count] = part[a:b]
        piece /= scale
        white = noise.whiten(piece, r)
        gram[r] = white.T @ white
    places = [np.arange(offsets[i], offsets[i + 1], dtype=np.intp) for i in range(len(parts))]
    return Evidence(
        gram,
        scale,
        places[0],
        places[1],
        {name: place for (name, _), place in zip(blocks, places[2:-1], strict=True)},
        total - 1,
        precision / scale[places[0]] ** 2,
    )
