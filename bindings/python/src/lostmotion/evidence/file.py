"""The evidence of a campaign, or of several merged, and the file that contains it.

Evidence is saved as one Gram matrix per run: of the derivatives of the baseline model, the
scattering columns, every effect and shape, and the residual, whitened and unwhitened; with the
sudden events found. No samples are saved.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from lostmotion.arrays import FloatArray
from lostmotion.errors import InputError, one_line
from lostmotion.evidence.checks import SAMPLES_MAX, check_about, check_arrays
from lostmotion.evidence.gram import Evidence
from lostmotion.files import write_whole

SCHEMA = "lostmotion.campaign_evidence/6"
"""Name and version of the saved form."""


@dataclass
class Body:
    """Evidence of a campaign, or of several.

    Attributes
    ----------
    white, plain : Evidence
        Gram matrices of the same columns: whitened, and unwhitened in arc seconds.
    point : ndarray
        Values of the baseline parameters at which the columns are derivatives.
    spread, rows : ndarray
        Noise within each run in arc seconds, and its samples.
    about : dict
        Metadata: grid, candidates, labels, sudden events, sources.
    """

    white: Evidence
    plain: Evidence
    point: FloatArray
    spread: FloatArray
    rows: FloatArray
    about: dict[str, Any]

    def save(self, file: str | Path) -> None:
        """Write it to an ``.npz`` file atomically."""
        out = io.BytesIO()
        names = list(self.white.blocks)
        blocks: dict[str, Any] = {
            f"block_{i}": self.white.blocks[name] for i, name in enumerate(names)
        }
        arrays: dict[str, Any] = {
            "schema": np.array(SCHEMA),
            "about": np.array(json.dumps(self.about)),
            "point": self.point,
            "spread": self.spread,
            "rows": self.rows,
            "white": self.white.gram,
            "plain": self.plain.gram,
            "white_scale": self.white.scale,
            "plain_scale": self.plain.scale,
            "fixed": self.white.fixed,
            "scatter": self.white.scatter,
            "response": np.array(self.white.response),
            "white_precision": self.white.precision,
            "plain_precision": self.plain.precision,
            "names": np.array(names),
            **blocks,
        }
        np.savez_compressed(out, **arrays, checksum=np.array(checksum(arrays)))
        write_whole(file, out.getvalue())


def checksum(arrays: Mapping[str, Any]) -> str:
    """Checksum of all saved data, because damaged numbers may still be consistent."""
    digest = hashlib.sha256()
    for name in sorted(arrays):
        values = np.ascontiguousarray(arrays[name])
        digest.update(f"{name} {values.dtype.str} {np.shape(arrays[name])}\n".encode())
        digest.update(values.tobytes())
    return digest.hexdigest()


def load_body(file: str | Path) -> Body:
    """Read what `Body.save` wrote.

    Raises
    ------
    InputError
        If the file is not evidence of this version, or is damaged.
    """
    try:
        with open(file, "rb") as stream, np.load(stream, allow_pickle=False) as data:
            saved = {name: data[name] for name in data.files}
        schema, summed = str(saved["schema"]), str(saved.pop("checksum", "none"))
    except Exception as error:  # NumPy raises several types for other files
        found = one_line(str(error)) or "no evidence"
        if isinstance(error, FileNotFoundError):
            found = "no such file"
        elif os.path.isfile(file) and not zipfile.is_zipfile(file):
            found = "no .npz archive"
        raise InputError(file, "", found, "evidence by diagnose --save-evidence") from None
    if schema != SCHEMA:
        raise InputError(file, "schema", schema, SCHEMA)
    if summed != checksum(saved):
        raise InputError(
            file, "checksum", summed, f"{checksum(saved)}, the checksum of the contents"
        )
    return body_of(file, saved)


def exact(digits: str) -> int | float:
    """Read an integer; as a float if an array of floats cannot hold it exactly."""
    number = int(digits)
    return number if abs(number) <= SAMPLES_MAX else float(digits)


def body_of(file: str | Path, saved: Mapping[str, npt.NDArray[Any]]) -> Body:
    """Make evidence from saved arrays after checking each value.

    Raises
    ------
    InputError
        Names the array or the entry.
    """
    check_arrays(file, saved)
    blocks = {str(n): saved[f"block_{i}"] for i, n in enumerate(saved["names"])}
    white, plain = (
        Evidence(
            saved[kind],
            saved[f"{kind}_scale"],
            saved["fixed"],
            saved["scatter"],
            dict(blocks),
            int(saved["response"]),
            saved[f"{kind}_precision"],
        )
        for kind in ("white", "plain")
    )
    try:
        about = json.loads(str(saved["about"]), parse_int=exact)
    except (ValueError, RecursionError) as error:
        found = one_line(str(error)) or "something else"
        raise InputError(file, "about", found, "JSON") from None
    sizes = {name: int(places.size) for name, places in blocks.items()}
    check_about(file, about, white.runs, sizes)
    return Body(white, plain, saved["point"], saved["spread"], saved["rows"], about)
