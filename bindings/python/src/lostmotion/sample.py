"""Recordings larger than memory: a sample of every run, in passes of bounded memory.

Fits and tests are limited by the differences between runs, not by the number of rows, so a sample
of the rows of every run is sufficient. Every k-th row of each run is used, with k such that all
runs together stay within a number of rows, and in addition the rows at torque reversals, on which
friction depends. Samples are not averaged, because means of neighbours would have different noise.

Two passes go over the files in pieces (a row group of a Parquet file, or a whole CSV file): the
first counts the rows of every run, the second takes the sample. Turns lost by encoders are
restored, and rows without numbers counted, over all rows. The pieces are independent, so they may
be read by threads, by Dask on this machine, or by a Dask cluster.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import TypeVar

import numpy as np

from lostmotion.arrays import BoolArray, FloatArray, IntArray
from lostmotion.cluster import connect, no_dask
from lostmotion.errors import InputError, one_line
from lostmotion.on_progress import OnProgress
from lostmotion.recordings import (
    QUANTITIES,
    Campaign,
    Finding,
    Protocol,
    Run,
    read_campaign,
    recording_files,
)
from lostmotion.recordings.bags import is_bag
from lostmotion.recordings.columns import ColumnName, check_map, resolve_columns
from lostmotion.recordings.conversion import Numbers, in_si, indices_of, integers, read_numbers
from lostmotion.recordings.encoders import WRAP_SLACK, unwrap
from lostmotion.recordings.joining import Join
from lostmotion.recordings.opening import open_table
from lostmotion.recordings.parquet import ParquetTable, is_parquet, open_parquet
from lostmotion.recordings.protocol import FREE, REPLACED
from lostmotion.recordings.reading import (
    RATIO_EXPECTED,
    judged,
    note_columns,
    rows_of_runs,
    run_codes,
)
from lostmotion.recordings.soundness import (
    BACKWARD_ACTION,
    DUPLICATE_ACTION,
    sound_run,
)
from lostmotion.threads import cores
from lostmotion.torsion_curve import run_plays

Label = int | str
Item = TypeVar("Item")
Answer = TypeVar("Answer")

ROWS = 120_000
"""Rows of a sample. A diagnosis keeps some 300 columns with this number of rows in memory."""

BATCH_ROWS = 1 << 18
"""Rows of a Parquet file that are in memory at a time, for each worker."""

TURN_SHARE = 0.02
"""A torque reversal counts if the torque goes back by this share of the largest torque."""

TURN = 2 * np.pi


@dataclass(frozen=True)
class Piece:
    """A part of a file that is read at once: a row group, or None for a whole file."""

    file: str
    group: int | None


@dataclass
class Part:
    """Rows of one run in a piece.

    Attributes
    ----------
    rows : int
        All rows of the run in this piece.
    largest_Nm : float
    columns : dict
        The rows that are kept, in SI.
    missing : dict
        Rows without a number, by quantity.
    first, last, turns : dict
        Of every angle: the first and last reading, and the whole turns restored within the piece;
        of the clock only the readings.
    wraps : dict
        Number of wraps found.
    duplicates, backward : int
        Steps of the clock that are zero or negative.
    findings : list of Finding
        Findings of reading the piece.
    """

    label: Label
    rows: int = 0
    largest_Nm: float = 0.0
    columns: dict[str, list[FloatArray]] = field(default_factory=dict)
    missing: dict[str, int] = field(default_factory=dict)
    first: dict[str, float] = field(default_factory=dict)
    last: dict[str, float] = field(default_factory=dict)
    turns: dict[str, float] = field(default_factory=dict)
    wraps: dict[str, int] = field(default_factory=dict)
    duplicates: int = 0
    backward: int = 0
    findings: list[Finding] = field(default_factory=list)


@dataclass(frozen=True)
class Task:
    """A piece to sample: number of previous rows of each run, and stride."""

    piece: Piece
    mapping: Mapping[str, str]
    protocol: Protocol
    ratio: float | None
    before: Mapping[Label, int]
    stride: Mapping[Label, int]
    turn_Nm: float


def pieces_of(files: Sequence[Path]) -> list[Piece]:
    """Cut files into pieces."""
    found = []
    for file in files:
        if is_parquet(file):
            opened = open_parquet(file)
            if opened.metadata.num_rows == 0:
                raise InputError(file, "", "no rows", "at least one sample")
            found += [Piece(str(file), group) for group in range(opened.num_row_groups)]
        else:
            found.append(Piece(str(file), None))
    return found


def recorded_rows(files: Sequence[Path]) -> int:
    """Number of rows of the Parquet files, from their footers."""
    parquet = [file for file in files if is_parquet(file)]
    return sum(open_parquet(file).metadata.num_rows for file in parquet)


def batches(
    piece: Piece,
    mapping: Mapping[str, str],
    protocol: Protocol,
    ratio: float | None,
    wanted: Sequence[str] | None,
) -> Iterator[tuple[IntArray, list[Label], Numbers]]:
    """Yield the rows of a piece: run of every row, labels of the runs, and columns in SI."""
    file = Path(piece.file)
    table = open_table(file, mapping)
    chosen, _ = resolve_columns(table.header, mapping, protocol)
    if wanted is not None:
        kept = {*wanted, *REPLACED}
        chosen = {name: column for name, column in chosen.items() if name in kept}
    if isinstance(table, ParquetTable) and piece.group is not None:
        zero = first_stamp(table, chosen)
        used = sorted(indices_of(chosen))
        pieces: Iterator[Numbers] = (
            in_si(piece.file, rows, chosen, protocol, ratio, zero)
            for rows in table.batches(piece.group, used, BATCH_ROWS)
        )
    else:
        pieces = iter([read_numbers(table, chosen, protocol, ratio)])
    for numbers in pieces:
        if numbers.run is not None:
            column = chosen["run"][0]
            codes, labels = run_codes(
                piece.file, column, numbers.run, numbers.place, numbers.findings
            )
        else:
            rows = numbers.quantities["torque"].size
            codes, labels = np.zeros(rows, dtype=np.intp), [file.name.split(".")[0]]
        yield codes, labels, numbers


def first_stamp(table: ParquetTable, chosen: Mapping[str, tuple[str, ColumnName]]) -> int | None:
    """First stamp of an integer clock that counts from an epoch, common to its batches."""
    if "time" not in chosen or chosen["time"][1].fraction is not None:
        return None
    index = chosen["time"][1].index
    for rows in table.batches(None, [index], 1):
        column = rows.columns[index]
        if not str(column.type).startswith(("timestamp", "duration", "int", "uint")):
            return None
        values, known = integers(column)
        seconds = in_si(table.header.file, rows, {"time": chosen["time"]}).quantities["time"]
        return int(values[0]) if known[0] and seconds[0] == 0.0 and values[0] else None
    return None


def count_piece(work: tuple[Piece, Mapping[str, str], Protocol, float | None]) -> list[Part]:
    """Count the rows of every run in a piece."""
    parts: dict[Label, Part] = {}
    for codes, labels, numbers in batches(*work, ("run", "torque")):
        for label, at in zip(labels, rows_of_runs(codes, len(labels)), strict=True):
            torque = numbers.quantities["torque"][at]
            part = parts.setdefault(label, Part(label))
            part.rows += torque.size
            finite = torque[np.isfinite(torque)]
            if finite.size:
                part.largest_Nm = max(part.largest_Nm, float(np.max(np.abs(finite))))
    return list(parts.values())


def sample_piece(task: Task) -> list[Part]:
    """Take the sample of every run in a piece."""
    parts: dict[Label, Part] = {}
    for codes, labels, numbers in batches(
        task.piece, task.mapping, task.protocol, task.ratio, None
    ):
        told = numbers.findings
        for label, at in zip(labels, rows_of_runs(codes, len(labels)), strict=True):
            part = parts.setdefault(label, Part(label))
            part.findings += told
            told = []
            columns = {name: values[at] for name, values in numbers.quantities.items()}
            for name in single_angle(columns):
                columns[name] = unwrap_on(part, name, columns[name])
            keep = kept_rows(
                columns["torque"],
                task.before[label] + part.rows,
                task.stride[label],
                task.turn_Nm,
            )
            part.rows += columns["torque"].size
            follow_clock(part, columns["time"])
            for name, values in columns.items():
                missing = int(np.count_nonzero(~np.isfinite(values)))
                part.missing[name] = part.missing.get(name, 0) + missing
                part.columns.setdefault(name, []).append(values[keep])
    return list(parts.values())


def kept_rows(torque: FloatArray, before: int, stride: int, turn_Nm: float) -> BoolArray:
    """Mark every n-th row of a run, and the torque reversals."""
    keep = (np.arange(before, before + torque.size) % stride) == 0
    if stride == 1 or turn_Nm <= 0:
        return np.asarray(keep)
    good = np.flatnonzero(np.isfinite(torque))
    if good.size < 2:
        return np.asarray(keep)
    t = torque[good]
    move = np.sign(np.diff(t + run_plays(np.array([turn_Nm]), t)[:, 0], prepend=t[0]))
    moving = np.flatnonzero(move)
    turned = moving[np.flatnonzero(np.diff(move[moving]) != 0) + 1] if moving.size else moving
    edges = np.concatenate(([0], turned, [t.size]))
    for a, b in pairwise(edges):
        # The reversal itself precedes the row at which it is detected.
        keep[good[a + int(np.argmax(t[a:b]))]] = True
        keep[good[a + int(np.argmin(t[a:b]))]] = True
    return np.asarray(keep)


def unwrap_on(part: Part, name: str, angle: FloatArray) -> FloatArray:
    """Restore the turns that an encoder lost, continuing from the previous batch."""
    good = np.flatnonzero(np.isfinite(angle))
    if good.size == 0:
        return angle
    raw = angle[good]
    part.first.setdefault(name, float(raw[0]))
    before = part.last.get(name, float(raw[0]))
    whole, wraps = unwrap(np.concatenate(([before], raw)))
    out = angle.copy()
    out[good] = whole[1:] + part.turns.get(name, 0.0)
    part.turns[name] = float(out[good[-1]] - raw[-1])
    part.last[name] = float(raw[-1])
    part.wraps[name] = part.wraps.get(name, 0) + wraps
    return out


def follow_clock(part: Part, time_s: FloatArray) -> None:
    """Count zero and negative steps of the clock, continuing from the previous batch."""
    good = time_s[np.isfinite(time_s)]
    if good.size == 0:
        return
    part.first.setdefault("time", float(good[0]))
    count_steps(part, np.diff(good, prepend=part.last.get("time", np.nan)))
    part.last["time"] = float(good[-1])


def count_steps(part: Part, step: FloatArray) -> None:
    """Add steps of a clock to the counts of a part."""
    part.duplicates += int(np.count_nonzero(step == 0))
    part.backward += int(np.count_nonzero(step < 0))


def strides_for(rows: Sequence[int], budget: int) -> list[int]:
    """Stride of each run such that all runs together stay within the budget.

    Short runs are used completely; long ones share the rest equally.
    """
    left, share = float(budget), float(budget) / max(len(rows), 1)
    for number, count in enumerate(sorted(rows)):
        share = left / (len(rows) - number)
        if count > share:
            break
        left -= count
    return [max(1, -(-count // max(int(share), 1))) for count in rows]


def sample_campaign(
    paths: Sequence[str | Path],
    *,
    ratio: float | None = None,
    mapping: Mapping[str, str] | None = None,
    protocol: Protocol = FREE,
    rows: int = ROWS,
    dask: str | None = None,
    progress: OnProgress | None = None,
) -> Campaign:
    """Read a sample of recordings that need not fit into memory.

    Parameters
    ----------
    paths, ratio, mapping, protocol
        As for `lostmotion.recordings.read_campaign`.
    rows : int
        Approximate number of rows of the sample.
    dask : str, optional
        Address of a Dask scheduler, or ``local`` for Dask on this machine; by default threads. The
        workers of a cluster must see the files under the same names.
    progress : callable, optional
        ``progress(done, of, step)``, see `lostmotion.on_progress`.

    Returns
    -------
    Campaign
        With `recorded_rows` set and a finding of the kind ``sampled``.
    """
    files = recording_files(paths)
    names = dict(mapping or {})
    check_map(files, names)
    pieces = pieces_of(files)
    if progress is not None:
        progress(0, 2, "counting the rows")
    counted = run_pieces(count_piece, [(piece, names, protocol, ratio) for piece in pieces], dask)
    if progress is not None:
        progress(1, 2, "sampling the rows")
    totals: dict[tuple[str, Label], int] = {}
    before: list[dict[Label, int]] = []
    largest = 0.0
    for piece, parts in zip(pieces, counted, strict=True):
        before.append({part.label: totals.get((piece.file, part.label), 0) for part in parts})
        for part in parts:
            totals[piece.file, part.label] = totals.get((piece.file, part.label), 0) + part.rows
            largest = max(largest, part.largest_Nm)
    strides = dict(zip(totals, strides_for(list(totals.values()), rows), strict=True))
    tasks = [
        Task(
            piece,
            names,
            protocol,
            ratio,
            of_runs,
            {label: strides[piece.file, label] for label in of_runs},
            TURN_SHARE * largest,
        )
        for piece, of_runs in zip(pieces, before, strict=True)
    ]
    sampled = run_pieces(sample_piece, tasks, dask)
    if progress is not None:
        progress(2, 2, "")
    found: dict[tuple[str, Label], list[Part]] = {}
    for piece, parts in zip(pieces, sampled, strict=True):
        for part in parts:
            found.setdefault((piece.file, part.label), []).append(part)
    findings = [finding for file in files for finding in note_ignored(file, names, protocol)]
    runs = []
    for (file, label), parts in found.items():
        run = join_parts(file, label, parts, ratio, findings)
        if run is not None:
            runs.append(run)
    if not runs:
        raise InputError(
            files[0], "torque_Nm", "no row with numbers for torque and angle", "at least one"
        )
    campaign = judged(runs, findings, ratio)
    campaign.recorded_rows = sum(totals.values())
    if max(strides.values()) > 1:
        note_sample(campaign)
    return campaign


def note_ignored(file: Path, mapping: Mapping[str, str], protocol: Protocol) -> list[Finding]:
    """Report the unused columns of a file, and quantities from its protocol."""
    found: list[Finding] = []
    note_columns(open_table(file, mapping), mapping, protocol, found)
    return found


def join_parts(
    file: str, label: Label, parts: Sequence[Part], ratio: float | None, findings: list[Finding]
) -> Run | None:
    """Join the parts of a run."""
    columns = {
        name: [np.concatenate(part.columns[name]) for part in parts] for name in parts[0].columns
    }
    for name in single_angle(columns):
        turns, last, wraps = 0.0, None, 0
        for i, part in enumerate(parts):
            if name not in part.first:
                continue
            if last is not None:
                step = (part.first[name] - last) / TURN
                lost = round(step)
                if lost and abs(step - lost) < WRAP_SLACK:
                    turns -= lost * TURN
                    wraps += 1
            columns[name][i] = columns[name][i] + turns
            turns += part.turns[name]
            last = part.last[name]
            wraps += part.wraps[name]
        if wraps:
            column = QUANTITIES[name].column
            findings.append(Finding("wrap", file, column, label, wraps, "whole turns restored"))
    for name in columns:
        missing = sum(part.missing[name] for part in parts)
        if missing:
            column = QUANTITIES[name].column
            findings.append(Finding("nan", file, column, label, missing, "not used for these rows"))
    for part in parts:
        findings += part.findings
    for one, other in pairwise([part for part in parts if "time" in part.first]):
        count_steps(one, np.array([other.first["time"] - one.last["time"]]))
    for kind, count, action in (
        ("duplicate_time", sum(part.duplicates for part in parts), DUPLICATE_ACTION),
        ("backward_time", sum(part.backward for part in parts), BACKWARD_ACTION),
    ):
        if count:
            findings.append(Finding(kind, file, "time_s", label, count, action))
    joined = {name: np.concatenate(values) for name, values in columns.items()}
    if "lost_motion" not in joined and "input_angle" in joined and ratio is None:
        raise InputError(file, "input_angle_rad", "no ratio", RATIO_EXPECTED)
    # Unusable rows were counted over all rows, and the sample's clock has gaps by design; a dead or
    # frozen sensor is also dead or frozen in the sample.
    of_sample: list[Finding] = []
    run = sound_run(file, label, joined, ratio, of_sample)
    kinds = ("stuck", "wild", *(("wrap", "jump") if not single_angle(columns) else ()))
    findings += [finding for finding in of_sample if finding.kind in kinds]
    return run


def single_angle(columns: Collection[str]) -> list[str]:
    """Return the angle without a second encoder: its turns are restored over all rows.

    Two encoders check each other, in the sample as well as in all rows.
    """
    angles = [name for name in ("input_angle", "output_angle") if name in columns]
    return angles if len(angles) == 1 else []


def thin_campaign(campaign: Campaign, rows: int = ROWS) -> Campaign:
    """Sample a campaign in memory; returned unchanged if it has few enough rows."""
    if campaign.rows <= rows:
        return campaign
    largest = campaign.largest_torque_Nm
    runs = []
    for run, stride in zip(
        campaign.runs, strides_for([len(run) for run in campaign.runs], rows), strict=True
    ):
        keep = kept_rows(run.torque_Nm, 0, stride, TURN_SHARE * largest)
        columns = {name: values[keep] for name, values in run.columns.items()}
        runs.append(Run(run.label, run.file, columns, run.begins, sources=run.sources))
    thinned = Campaign(runs, list(campaign.findings), campaign.rows)
    note_sample(thinned)
    return thinned


def note_sample(campaign: Campaign) -> None:
    """State that a campaign is a sample."""
    recorded = campaign.recorded_rows or campaign.rows
    if recorded > campaign.rows:
        campaign.findings.append(
            Finding(
                "sampled",
                campaign.runs[0].file,
                "all columns",
                None,
                recorded,
                f"{campaign.rows} rows are used: every n-th row of each run, and the torque "
                "reversals",
            )
        )


def read_or_sample(
    paths: Sequence[str | Path],
    *,
    ratio: float | None = None,
    mapping: Mapping[str, str] | None = None,
    protocol: Protocol = FREE,
    join: Join | None = None,
    dask: str | None = None,
    rows: int = ROWS,
    progress: OnProgress | None = None,
) -> Campaign:
    """Read recordings completely, or a sample of them if they have too many rows.

    Parquet files state how many rows they hold before they are read.
    """
    files = recording_files(paths)
    whole = any(is_bag(file) for file in files)
    if not whole and (dask is not None or recorded_rows(files) > rows):
        return sample_campaign(
            paths,
            ratio=ratio,
            mapping=mapping,
            protocol=protocol,
            rows=rows,
            dask=dask,
            progress=progress,
        )
    campaign = read_campaign(paths, ratio=ratio, mapping=mapping, protocol=protocol, join=join)
    return thin_campaign(campaign, rows)


def run_pieces(
    function: Callable[[Item], Answer], items: Sequence[Item], dask: str | None
) -> list[Answer]:
    """Call a function on every item, in threads, by Dask on this machine, or on a cluster."""
    workers = cores()
    if dask is None:
        with ThreadPoolExecutor(workers) as pool:
            return list(pool.map(function, items))
    if dask == "local":
        try:
            import dask as local
        except ImportError:
            raise no_dask() from None
        made = [local.delayed(function, pure=False)(item) for item in items]
        return list(local.compute(*made, scheduler="threads", num_workers=workers))
    with connect(dask) as client:
        try:
            return list(client.gather(client.map(function, items, pure=False)))
        except (OSError, TimeoutError) as error:
            raise InputError("--dask", dask, one_line(str(error)), "a Dask cluster") from None
