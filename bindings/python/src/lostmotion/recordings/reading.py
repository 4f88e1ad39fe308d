"""Reading: files and folders become one campaign."""

from __future__ import annotations

import logging
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from lostmotion.errors import InputError
from lostmotion.files import reason
from lostmotion.recordings.bags import (
    HEADER_STAMP,
    RECEIVE_TIME,
    STORAGES,
    bag_columns,
    is_bag,
    list_columns,
    read_channels,
)
from lostmotion.recordings.campaign import Campaign, Run
from lostmotion.recordings.columns import check_map, counters_of, in_si, resolve_columns, unused
from lostmotion.recordings.encoders import bring_together
from lostmotion.recordings.findings import UNUSED, Finding
from lostmotion.recordings.joining import Join, join_channels
from lostmotion.recordings.protocol import FREE, Protocol
from lostmotion.recordings.quantities import QUANTITIES
from lostmotion.recordings.soundness import check_ratio, check_sign, sound_run
from lostmotion.recordings.tables import read_table
from lostmotion.recordings.wild import set_wild_aside

FloatArray = npt.NDArray[np.float64]

LOG = logging.getLogger(__name__)

SUFFIXES = (".csv", ".csv.gz", ".parquet", *STORAGES)
"""File names that are read as recordings."""

RATIO_EXPECTED = (
    "the ratio, which a drive file has and a blob has not (in Python ratio=), or lost_motion_rad"
)
"""What a recording of two angles needs."""

LEADING = {"torque", "input_angle", "output_angle", "lost_motion", "motor_torque", "motor_current"}
"""Quantities of which the slowest gives the rows of joined columns."""

MISSING_ACTION = "only other runs have the column; not used"
"""What is done about a quantity that some runs have."""

WHOLE_MAX = 2.0**53
"""Below this a float holds every integer, and a run label that is a whole number stays one."""


def by_number(path: Path) -> list[tuple[int, str]]:
    """Order of names in which numbers count as numbers: ``run_2`` before ``run_10``."""
    parts = re.split(r"([0-9]+)", path.name)
    return [(int(part) if i % 2 else 0, part) for i, part in enumerate(parts)]


def recording_files(paths: Iterable[str | Path]) -> list[Path]:
    """List the recordings that a set of files and folders stands for, folders as `by_number` says.

    Raises
    ------
    InputError
        When a path does not exist, is of another kind, or a folder holds no recording.
    """
    found: list[Path] = []
    for given in paths:
        path = Path(given)
        try:
            inside = sorted(path.iterdir(), key=by_number) if path.is_dir() and str(given) else None
            inside = [path] if inside is not None and is_bag(path) else inside
            there, regular = path.exists(), path.is_file()
        except OSError as error:
            wanted = "a recording or a folder of them"
            raise InputError(path, "", reason(error), wanted) from None
        if inside is not None:
            inside = [p for p in inside if p.name.lower().endswith(SUFFIXES) or is_bag(p)]
            if not inside:
                raise InputError(path, "", "no recording", "files ending in " + ", ".join(SUFFIXES))
            found.extend(inside)
        elif not regular:
            what = "something that is no file" if there and str(given) else "no such file"
            raise InputError(given, "", what, "a recording or a folder of them")
        elif not path.name.lower().endswith(SUFFIXES):
            raise InputError(path, "", f"a file '{path.name}'", "a name in " + ", ".join(SUFFIXES))
        else:
            found.append(path)
    if not found:
        raise InputError("DATA", "", "no file", "at least one recording")
    return found


def read_campaign(
    paths: str | Path | Iterable[str | Path],
    *,
    ratio: float | None = None,
    mapping: Mapping[str, str] | None = None,
    protocol: Protocol = FREE,
    join: Join | None = None,
) -> Campaign:
    """Read recordings into one campaign.

    Parameters
    ----------
    paths : path or paths
        Files and folders; files as given, those of a folder by their names, ``run_2`` before
        ``run_10``.
    ratio : float, optional
        Input turns for one output turn; needed where only the two angles were recorded.
    mapping : mapping, optional
        From a foreign column name to ``NAME_UNIT``; ``-NAME_UNIT`` turns its sign round,
        ``NAME_UNIT/NUMBER`` divides (``input_angle_rev/4096``: counts), and
        ``NAME_UNIT/NUMBER%COUNTS`` says after how many counts the column begins anew. It counts in
        the files that have the column, where it goes before a column that has the name already.
    protocol : Protocol, optional
        Which side was locked, and the motor's torque constant; by default neither side.
    join : {"nearest", "linear"}, optional
        How columns of a ROS 2 bag whose messages have other stamps become rows; without it they are
        refused.

    Returns
    -------
    Campaign
        Runs in file order; within a file in the order in which their labels first appear.

    Raises
    ------
    InputError
        Names file, column, what was found and what was expected.
    """
    if isinstance(paths, (str, Path)):
        paths = [paths]
    files = recording_files(paths)
    check_map(files, mapping or {})
    findings: list[Finding] = []
    runs: list[Run] = []
    for file in files:
        found = _read_file(file, dict(mapping or {}), ratio, findings, protocol, join)
        LOG.info("read %s: %d rows in %d runs", file, sum(map(len, found)), len(found))
        runs.extend(found)
    name_apart(runs)
    campaign = Campaign(runs, findings)
    note_missing(campaign)
    set_wild_aside(campaign)
    check_ratio(campaign, ratio)
    bring_together(campaign, ratio)
    check_sign(campaign)
    for finding in findings:
        LOG.info("%s", finding)
    return campaign


def _read_file(
    file: Path,
    mapping: dict[str, str],
    ratio: float | None,
    findings: list[Finding],
    protocol: Protocol,
    join: Join | None,
) -> list[Run]:
    if is_bag(file):
        table: dict[str, npt.NDArray[Any]] = dict(read_bag(file, mapping, protocol, join, findings))
    else:
        table = read_table(file)
    name = str(file)
    chosen, ignored = resolve_columns(name, list(table), mapping, protocol)
    findings += protocol.findings(name, chosen)
    for column in ignored:
        findings.append(Finding("ignored_column", name, column, None, 1, unused(column, chosen)))
    for quantity in protocol.unused(chosen):
        findings.append(Finding("ignored_column", name, chosen[quantity][0], None, 1, UNUSED))
    numbers = in_si(name, table, chosen, protocol, ratio)
    rows = len(numbers["torque"])
    if rows == 0:
        raise InputError(name, "", "no rows", "at least one sample")
    if ratio is None and protocol.locked == "input" and "input_angle" not in chosen:
        ratio = 1.0  # of an input that stands still, whatever it is
    if "lost_motion" not in numbers and ratio is None:
        raise InputError(name, "input_angle_rad", "no ratio", RATIO_EXPECTED)

    if "run" in chosen:
        codes, labels = run_codes(name, chosen["run"][0], table[chosen["run"][0]])
    else:
        codes, labels = np.zeros(rows, dtype=np.intp), [file.name.split(".")[0]]
    runs = []
    for code, label in enumerate(labels):
        index = np.flatnonzero(codes == code)
        if index[-1] - index[0] + 1 != index.size:
            pieces = int(np.count_nonzero(np.diff(index) > 1)) + 1
            findings.append(
                Finding("split_run", name, "run", label, pieces, "pieces joined in file order")
            )
        columns = {quantity: values[index] for quantity, values in numbers.items()}
        run = sound_run(name, label, columns, ratio, findings, counters_of(chosen))
        if run is not None:
            runs.append(run)
    if not runs:
        raise InputError(name, "torque_Nm", "no row with numbers for torque and angle", "some")
    return runs


def read_bag(
    file: Path,
    mapping: Mapping[str, str],
    protocol: Protocol,
    join: Join | None,
    findings: list[Finding],
) -> dict[str, FloatArray]:
    """Read the columns of a ROS 2 bag that a map names, joined to rows, with ``time_s``."""
    name = str(file)
    wanted = bag_columns(file, mapping)
    if not wanted:
        found = "a ROS 2 bag, and no map that names its columns"
        raise InputError(file, "", found, f"--map COLUMN=NAME_UNIT; columns: {list_columns(file)}")
    try:
        chosen, _ = resolve_columns(name, ["time_s", *wanted], mapping, protocol)
    except InputError as error:
        expected = f"{error.expected}; columns: {list_columns(file)}"
        raise InputError(file, error.key, error.found, expected) from None
    leading = {column for quantity, (column, _) in chosen.items() if quantity in LEADING}
    clock = next((column for column in (RECEIVE_TIME, HEADER_STAMP) if column in mapping), None)
    return join_channels(file, read_channels(file, wanted), leading, join, clock, findings)


def note_missing(campaign: Campaign) -> None:
    """Note the quantities that were recorded in some runs only, in which nothing can use them."""
    for name, quantity in QUANTITIES.items():
        without = [run for run in campaign.runs if name not in run.columns]
        if len(without) == len(campaign.runs):
            continue
        for run in without:
            campaign.findings.append(
                Finding("missing", run.file, quantity.column, run.label, len(run), MISSING_ACTION)
            )


def name_apart(runs: Sequence[Run]) -> None:
    """Put the file before labels that several files use.

    Where a file numbers its runs anew, a sitting begins: the drive may have moved in between.
    """
    labels = [run.label for run in runs]
    if len(set(labels)) != len(labels):
        told: set[int | str] = set()
        for before, run in zip((None, *runs), runs, strict=False):
            if before is not None and before.file != run.file:
                run.begins = run.label in told
            told.add(run.label)
        for run, label in zip(runs, labels, strict=True):
            if labels.count(label) > 1:
                run.label = f"{Path(run.file).name.split('.')[0]}:{label}"


def run_codes(
    file: str, column: str, values: npt.NDArray[Any]
) -> tuple[npt.NDArray[np.intp], list[int | str]]:
    """Number the runs in the order of their first appearance."""
    missing = (
        ~np.isfinite(values)
        if values.dtype.kind == "f"
        else np.char.equal(values.astype(np.str_), "")
    )
    if np.any(missing):
        row = int(np.flatnonzero(missing)[0]) + 1
        raise InputError(file, column, f"no label in row {row}", "an integer or text")
    whole = values.dtype.kind == "f" and bool(np.all(values == np.round(values)))
    if whole and np.max(np.abs(values), initial=0.0) < WHOLE_MAX:
        values = values.astype(np.int64)
    unique, first, inverse = np.unique(values, return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(order.size)
    labels: list[int | str] = [
        int(unique[i]) if unique.dtype.kind in "iu" else str(unique[i]) for i in order
    ]
    return rank[inverse].astype(np.intp), labels
