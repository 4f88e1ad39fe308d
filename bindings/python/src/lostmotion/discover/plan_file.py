"""Planned runs, read like recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from lostmotion import units
from lostmotion.errors import InputError
from lostmotion.recordings import QUANTITIES, Campaign, Run, recording_files
from lostmotion.recordings.bags import is_bag
from lostmotion.recordings.columns import check_range, parse_column
from lostmotion.recordings.protocol import REPLACED
from lostmotion.recordings.reading import run_codes
from lostmotion.recordings.soundness import check_steps
from lostmotion.recordings.tables import numbers_of, read_table

FloatArray = npt.NDArray[np.float64]


def read_plan(
    paths: Sequence[str | Path], ratio: float, mapping: Mapping[str, str] | None = None
) -> Campaign:
    """Read planned runs: like recordings, but what will be measured may be left out.

    Raises
    ------
    InputError
        As for recordings; time and torque must be there.
    """
    runs: list[Run] = []
    for file in recording_files(paths):
        if is_bag(file):
            raise InputError(file, "", "a ROS 2 bag", "a plan as CSV or Parquet")
        table = read_table(file)
        columns: dict[str, FloatArray] = {}
        labels = None
        for header in table:
            name = parse_column(str(file), header, (mapping or {}).get(header, header))
            if name is None or name.quantity.name in REPLACED:
                continue
            if name.quantity.name == "run":
                labels = table[header]
                continue
            values = name.factor * numbers_of(str(file), header, table[header])
            if name.unit is not None:
                values = units.convert(values, name.unit.symbol, name.quantity.unit)
            check_range(str(file), header, values, name.quantity)
            unknown = np.flatnonzero(~np.isfinite(values))
            if unknown.size:
                found = f"{values[unknown[0]]} in row {unknown[0] + 1}"
                raise InputError(file, header, found, "a number: a plan is known in full")
            columns[name.quantity.name] = values
        lacking = [
            QUANTITIES[needed].column for needed in ("time", "torque") if needed not in columns
        ]
        if lacking:
            nothing = f"no such column (there are {', '.join(table)})"
            raise InputError(file, ", ".join(lacking), nothing, " and ".join(lacking))
        rows = columns["torque"].size
        if "input_angle" in columns and "output_angle" not in columns:
            columns["output_angle"] = columns["input_angle"] / ratio
        columns.setdefault("lost_motion", np.zeros(rows))
        if labels is None:
            codes = np.zeros(rows, dtype=np.intp)
            names: list[int | str] = [file.name.split(".")[0]]
        else:
            codes, names = run_codes(str(file), "run", labels)
        for code, label in enumerate(names):
            at = codes == code
            check_steps(str(file), columns["time"][at])
            runs.append(Run(label, str(file), {k: v[at] for k, v in columns.items()}))
        if rows == 0:
            raise InputError(file, "", "no rows", "a planned run")
    return Campaign(runs)
