"""Planned runs, read like recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from lostmotion.errors import InputError
from lostmotion.recordings import QUANTITIES, Campaign, Run, recording_files
from lostmotion.recordings.bags import is_bag
from lostmotion.recordings.columns import choose_columns, refuse_faults
from lostmotion.recordings.conversion import read_numbers
from lostmotion.recordings.opening import open_table
from lostmotion.recordings.protocol import FREE, ORDER, Protocol
from lostmotion.recordings.reading import rows_of_runs, run_codes
from lostmotion.recordings.soundness import check_steps


def read_plan(
    paths: Sequence[str | Path],
    ratio: float,
    mapping: Mapping[str, str] | None = None,
    protocol: Protocol = FREE,
) -> Campaign:
    """Read planned runs: like recordings, but measured columns may be missing.

    With a locked side the torque may be that of the motor, as in recordings.

    Raises
    ------
    InputError
        As for recordings; time and torque are required.
    """
    runs: list[Run] = []
    for file in recording_files(paths):
        if is_bag(file):
            raise InputError(file, "", "a ROS 2 bag", "a plan as CSV or Parquet")
        table = open_table(file, mapping or {})
        chosen, _, doubts = choose_columns(table.header, mapping or {})
        idle = {*protocol.unused(chosen), ORDER}
        chosen = {name: column for name, column in chosen.items() if name not in idle}
        refuse_faults(str(file), [doubt for _, doubt in doubts])
        there = chosen.keys() | protocol.supplies(chosen)
        lacking = [QUANTITIES[name].column for name in ("time", "torque") if name not in there]
        if lacking:
            nothing = f"no such column ({table.header.there_are()})"
            raise InputError(file, ", ".join(lacking), nothing, " and ".join(lacking))
        read = read_numbers(table, chosen, protocol, ratio)
        columns = read.quantities
        for quantity, values in columns.items():
            unknown = np.flatnonzero(~np.isfinite(values))
            if unknown.size:
                found = f"{values[unknown[0]]} in {read.place(int(unknown[0]))}"
                expected = "a number: a plan has no missing values"
                column = chosen[quantity][0] if quantity in chosen else QUANTITIES[quantity].column
                raise InputError(file, column, found, expected)
        rows = columns["torque"].size
        if rows == 0:
            raise InputError(file, "", "no rows", "a planned run")
        if "input_angle" in columns and "output_angle" not in columns:
            columns["output_angle"] = columns["input_angle"] / ratio
        columns.setdefault("lost_motion", np.zeros(rows))
        if read.run is None:
            codes = np.zeros(rows, dtype=np.intp)
            names: list[int | str] = [file.name.split(".")[0]]
        else:
            codes, names = run_codes(str(file), "run", read.run, read.place)
        for label, at in zip(names, rows_of_runs(codes, len(names)), strict=True):
            check_steps(str(file), columns["time"][at])
            runs.append(Run(label, str(file), {k: v[at] for k, v in columns.items()}))
    return Campaign(runs)
