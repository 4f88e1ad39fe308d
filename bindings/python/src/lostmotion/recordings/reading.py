"""Reading: read files and folders into one campaign."""

from __future__ import annotations

import hashlib
import logging
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from lostmotion.arrays import FloatArray, IntArray
from lostmotion.errors import InputError, shorten
from lostmotion.files import reason
from lostmotion.recordings.asynchronous import check_asynchronous, leave_out_repeated
from lostmotion.recordings.bags import (
    HEADER_STAMP,
    RECEIVE_TIME,
    STORAGES,
    bag_columns,
    is_bag,
    list_columns,
    read_channels,
)
from lostmotion.recordings.bursts import BURST
from lostmotion.recordings.campaign import Campaign, Run, set_table_reader
from lostmotion.recordings.cells import MISSING
from lostmotion.recordings.columns import (
    ColumnName,
    check_map,
    choose_columns,
    counters_of,
    holds_text,
    lacking,
    refuse_unmapped,
    resolve_columns,
    unused,
)
from lostmotion.recordings.conversion import Numbers, read_numbers
from lostmotion.recordings.encoders import bring_together
from lostmotion.recordings.findings import UNUSED, Finding
from lostmotion.recordings.from_arrow import integers_of, mask_of
from lostmotion.recordings.in_memory import MemoryTable, has_columns
from lostmotion.recordings.joining import JOINS, Join, join_channels, join_rows, stamps_aside
from lostmotion.recordings.long_form import in_columns
from lostmotion.recordings.opening import open_table
from lostmotion.recordings.protocol import FREE, Protocol
from lostmotion.recordings.quantities import QUANTITIES
from lostmotion.recordings.runs_agree import check_runs_agree
from lostmotion.recordings.soundness import GAP_FACTOR, check_ratio, check_sign, sound_run
from lostmotion.recordings.stacked import StackedTable, have_the_same_units
from lostmotion.recordings.tables import Header, Table
from lostmotion.recordings.wild import LEFT_OUT, set_wild_aside
from lostmotion.threads import one_thread

LOG = logging.getLogger(__name__)

SUFFIXES = (".csv", ".csv.gz", ".parquet", *STORAGES)
"""File names that are read as recordings, also out of a folder."""

OTHER_SUFFIXES = (
    *(".xlsx", ".xls", ".xlsm", ".ods", ".toml", ".json", ".yaml", ".yml", ".xml", ".html", ".htm"),
    *(".npz", ".npy", ".mat", ".h5", ".hdf5", ".tdms", ".mf4", ".mdf", ".pdf", ".png", ".jpg"),
    *(".zip", ".7z", ".tar", ".tgz", ".rar", ".svg", ".py", ".c", ".h", ".bin", ".so", ".exe"),
)
"""Suffixes of files that are not text with separators; all others are read if they are named
explicitly."""

RUNS_MAX = 2_000
"""Largest number of runs of a file, and of files of a campaign. Chosen: a day and more of loops of
a minute; a column with more labels counts something else, and every run is checked separately."""

LABEL_MAX = 200
"""Largest number of characters of a run label."""

RATIO_EXPECTED = (
    "the ratio, which a drive file states and a blob does not (in Python ratio=), or "
    "lost_motion_rad"
)
"""What a recording of two angles needs."""

LEADING = {"torque", "input_angle", "output_angle", "lost_motion", "motor_torque", "motor_current"}
"""Quantities of which the slowest defines the rows of joined columns."""

MOVING = {"torque", "input_angle", "output_angle", "lost_motion"}
"""Quantities that every row needs, as far as they are recorded."""

MISSING_ACTION = "only other runs have the column; not used"
"""Action for a quantity that only some runs have."""

COPY_ROWS_LEAST = 50
"""Least number of samples of a run that counts as a copy if it equals another run in every digit.
Chosen: a manual test has up to 30 readings, and a coarse gauge may show the same ones again."""

SINGLE_ACTION = "a run of one sample, left out: it contains no motion"

NEWEST_ACTION = "rows in order of decreasing time; order reversed"

STEPS_BACK_LEAST = 10
"""Least number of clock steps that identify its direction."""

WHOLE_MAX = 2.0**53
"""Below this a float holds every integer, and a run label that is a whole number stays one."""


def by_number(path: Path) -> list[tuple[int, str]]:
    """Sort key of names with numbers in numeric order: ``run_2`` before ``run_10``."""
    parts = re.split(r"([0-9]+)", path.name)
    return [(int(part) if i % 2 else 0, part) for i, part in enumerate(parts)]


def recording_files(paths: Iterable[str | Path]) -> list[Path]:
    """List the recordings in a set of files and folders, folders in the order of `by_number`.

    Raises
    ------
    InputError
        If a path does not exist, has a wrong type, or a folder contains no recording.
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
            what = "neither a file nor a folder" if there and str(given) else "no such file"
            raise InputError(given, "", what, "a recording or a folder of them")
        elif path.name.lower().endswith(OTHER_SUFFIXES):
            raise InputError(path, "", f"a file '{path.name}'", "a name in " + ", ".join(SUFFIXES))
        else:
            found.append(path)
    if not found:
        raise InputError("DATA", "", "no file", "at least one recording")
    return found


@one_thread()
def read_campaign(
    paths: str | Path | Iterable[str | Path] | Any,
    *,
    ratio: float | None = None,
    mapping: Mapping[str, str] | None = None,
    protocol: Protocol = FREE,
    join: Join | None = None,
) -> Campaign:
    """Read recordings into one campaign.

    Parameters
    ----------
    paths : path or paths, or a table
        Files and folders; files as given, those of a folder by their names, ``run_2`` before
        ``run_10``. Files in succession that each have other channels of a recording are put
        together. Or data in memory, as `Campaign.from_table` takes them.
    ratio : float, optional
        Input turns for one output turn; needed where only the two angles were recorded.
    mapping : mapping, optional
        From a column name to ``NAME_UNIT``; ``-NAME_UNIT`` reverses the sign, ``NAME_UNIT/NUMBER``
        divides (``input_angle_rev/4096``: counts), and ``NAME_UNIT/NUMBER%COUNTS`` states the
        number of counts until overflow. It applies to the files that have the column, and takes
        precedence over a column that already has the name.
    protocol : Protocol, optional
        Which side was locked, and the motor's torque constant; by default neither side.
    join : {"nearest", "linear"}, optional
        Resampling of channels with different stamps, in a ROS 2 bag, in different files or in
        different rows of a table; without it they are refused.

    Returns
    -------
    Campaign
        Runs in file order; within a file in the order of first appearance.

    Raises
    ------
    InputError
        Names file, column, what was found and what was expected.
    """
    if has_columns(paths):
        return campaign_of_table(paths, ratio=ratio, mapping=mapping, protocol=protocol, join=join)
    if isinstance(paths, (str, Path)):
        paths = [paths]
    paths = list(paths)
    files = recording_files(paths)
    if len(files) > RUNS_MAX:
        expected = f"{RUNS_MAX} at most, or --dask where a command has it"
        raise InputError(paths[0], "", f"{len(files)} recordings", expected)
    check_map(files, mapping or {})
    findings: list[Finding] = []
    runs: list[Run] = []
    for table in open_recordings(files, dict(mapping or {}), protocol, join, findings):
        file = Path(table.header.file)
        how = None if is_bag(file) else join
        only = file.name.split(".")[0]
        found = read_runs(table, only, dict(mapping or {}), ratio, findings, protocol, how)
        LOG.info("read %s: %d rows in %d runs", file, sum(map(len, found)), len(found))
        runs.extend(found)
    return judged(runs, findings, ratio)


@one_thread()
def campaign_of_table(
    data: Any,
    *,
    ratio: float | None = None,
    mapping: Mapping[str, str] | None = None,
    protocol: Protocol = FREE,
    join: Join | None = None,
    name: str = "table",
) -> Campaign:
    """Make a campaign of data in memory, as `Campaign.from_table` says."""
    names = dict(mapping or {})
    table = in_columns(MemoryTable(name, data), names)
    refuse_unmapped([table.header], 1, names)
    findings: list[Finding] = []
    runs = read_runs(table, Path(name).name.split(".")[0], names, ratio, findings, protocol, join)
    return judged(runs, findings, ratio)


def judged(runs: list[Run], findings: list[Finding], ratio: float | None) -> Campaign:
    """Make a campaign of runs, and report faults that appear only over all runs."""
    runs = without_copies(runs, findings)
    name_apart(runs)
    campaign = Campaign(without_single(runs, findings), findings)
    note_missing(campaign)
    leave_out_repeated(campaign)
    set_wild_aside(campaign)
    check_ratio(campaign, ratio)
    bring_together(campaign, ratio)
    check_sign(campaign)
    check_runs_agree(campaign, ratio)
    check_asynchronous(campaign)
    for finding in findings:
        LOG.info("%s", finding)
    return campaign


set_table_reader(campaign_of_table)


def open_recordings(
    files: Sequence[Path],
    mapping: dict[str, str],
    protocol: Protocol,
    join: Join | None,
    findings: list[Finding],
) -> Iterator[Table]:
    """Open files as tables; files in succession that have parts of a recording are one table."""
    parts: list[Table] = []
    held: set[str] = set()
    for file in files:
        table: Table
        if is_bag(file):
            table = read_bag(file, mapping, protocol, join, findings)
        else:
            table = open_table(file, mapping)
        part = channels_of_part(table, mapping, protocol)
        if parts and (not part or part & held or not have_the_same_units([*parts, table])):
            yield StackedTable(parts) if len(parts) > 1 else parts[0]
            parts, held = [], set()
        if part:
            parts.append(table)
            held |= part
        else:
            yield table
    if parts:
        yield StackedTable(parts) if len(parts) > 1 else parts[0]


def channels_of_part(table: Table, mapping: Mapping[str, str], protocol: Protocol) -> set[str]:
    """Return the channels of a file with a clock that lacks others; empty if it lacks none."""
    try:
        chosen, _, doubts = choose_columns(table.header, mapping)
    except InputError:
        return set()  # it is reported where the table is read
    if doubts or "time" not in chosen or not lacking(table.header, mapping, chosen, protocol):
        return set()
    return LEADING & chosen.keys()


def note_columns(
    table: Table, mapping: Mapping[str, str], protocol: Protocol, findings: list[Finding]
) -> dict[str, tuple[str, ColumnName]]:
    """Choose the columns of a table; report quantities from the protocol and unused columns."""
    name = table.header.file
    chosen, ignored = resolve_columns(table.header, mapping, protocol)
    findings += protocol.findings(name, chosen)
    for column in ignored:
        at = table.header.names.index(column)
        action = unused(column, chosen, holds_text(table.header.cells(at)))
        findings.append(Finding("ignored_column", name, shorten(column), None, 1, action))
    for quantity in protocol.unused(chosen):
        findings.append(Finding("ignored_column", name, chosen[quantity][0], None, 1, UNUSED))
    return chosen


def read_runs(
    table: Table,
    only: str,
    mapping: Mapping[str, str],
    ratio: float | None,
    findings: list[Finding],
    protocol: Protocol,
    join: Join | None,
) -> list[Run]:
    """Read the runs of a table; `only` is the label of the run if no column has labels."""
    name = table.header.file
    chosen = note_columns(table, mapping, protocol, findings)
    read = read_numbers(table, chosen, protocol, ratio)
    findings += read.findings
    numbers = read.quantities
    rows = len(numbers["torque"])
    if rows == 0:
        raise InputError(name, "", "no rows", "at least one sample")
    if "lost_motion" not in numbers and "input_angle" in numbers and ratio is None:
        raise InputError(name, "input_angle_rad", "no ratio", RATIO_EXPECTED)

    if read.run is not None:
        column = chosen["run"][0]
        codes, labels = run_codes(name, column, read.run, read.place, findings)
    else:
        codes, labels = runs_of_blocks(name, only, read, findings)
    scrambled = in_no_order(codes)
    if scrambled and all(isinstance(label, int) for label in labels):
        # The first appearance means nothing; the numbers state the order.
        order = sorted(range(len(labels)), key=lambda code: labels[code])
        labels, codes = [labels[code] for code in order], np.argsort(order)[codes]
    if newest_first(numbers["time"], codes):
        numbers = {quantity: values[::-1] for quantity, values in numbers.items()}
        present, codes = first_appearance(codes[::-1])
        labels = [labels[code] for code in present]
        findings.append(Finding("backward_time", name, "time_s", None, rows, NEWEST_ACTION))
    again: set[int | str] = set()
    apart = in_different_rows(numbers)
    if not apart:  # otherwise a run is written once for every channel
        codes, labels, again = begun_again(codes, labels, numbers["time"], name, findings)
    counters = counters_of(chosen)
    runs = []
    gaps: dict[str, list[tuple[float, int, int]]] = {}
    for label, index in zip(labels, rows_of_runs(codes, len(labels)), strict=True):
        if index[-1] - index[0] + 1 != index.size and not apart:
            pieces = int(np.count_nonzero(np.diff(index) > 1)) + 1
            findings.append(
                Finding("split_run", name, "run", label, pieces, "pieces joined in file order")
            )
        columns = {quantity: values[index] for quantity, values in numbers.items()}
        if apart and (untimed := int(np.count_nonzero(~np.isfinite(columns["time"])))):
            findings.append(Finding("nan", name, "time_s", label, untimed, "rows left out"))
        if apart and (wild := stamps_aside(columns, LEADING)).size:
            findings.append(
                Finding("wild", name, "time_s", label, wild.size, LEFT_OUT, tuple(wild.tolist()))
            )
        joined = join_rows(columns, LEADING, join) if apart else None
        if joined is not None:
            columns, of_run = joined
            for quantity, (gap_s, paused) in of_run.items():
                gaps.setdefault(quantity, []).append((gap_s, paused, columns["time"].size))
        run = sound_run(
            name, label, columns, ratio, findings, counters, scrambled=scrambled and not apart
        )
        if run is not None:
            run.sources = dict(chosen)
            run.begins = label in again
            runs.append(run)
    for quantity, each in gaps.items():
        largest = f"largest gap {max(each)[0] * 1e3:.4g} ms"
        action = f"{join or JOINS[0]} to the rows of the slowest; {largest}"
        paused = sum(one[1] for one in each)
        action += f"; no value in {paused} rows where it pauses" * bool(paused)
        count = sum(one[2] for one in each)
        findings.append(Finding("joined", name, QUANTITIES[quantity].column, None, count, action))
    if not runs:
        found = "no row with numbers for torque and angle"
        known = {q: int(np.count_nonzero(np.isfinite(numbers[q]))) for q in MOVING & set(numbers)}
        if len(known) > 1 and min(known.values()) > 1:
            counts = ", ".join(
                f"{count} of {quantity}" for quantity, count in sorted(known.items())
            )
            found = f"numbers in different rows ({counts}), as of topics with clocks of their own"
            overlap = "channels whose times overlap"
            expected = overlap if join else "--join linear, or --join nearest"
            raise InputError(name, "torque_Nm", found, expected)
        raise InputError(name, "torque_Nm", found, "rows that have both torque and angle")
    return runs


def in_different_rows(numbers: Mapping[str, FloatArray]) -> bool:
    """Whether no row has all of the quantities that every row needs."""
    moving = [np.isfinite(numbers[name]) for name in sorted(MOVING & numbers.keys())]
    return not np.any(np.all(moving, axis=0))


def newest_first(time_s: FloatArray, codes: IntArray) -> bool:
    """Whether the clock of every run only decreases."""
    step = np.diff(time_s)
    step = step[(np.diff(codes) == 0) & np.isfinite(step)]
    return bool(step.size >= STEPS_BACK_LEAST and np.all(step <= 0) and np.any(step < 0))


def first_appearance(
    codes: IntArray,
) -> tuple[IntArray, IntArray]:
    """Codes in the order of their first appearance, and the rows by that order."""
    present, first, inverse = np.unique(codes, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty(order.size, dtype=np.intp)
    rank[order] = np.arange(order.size)
    return present[order], rank[inverse]


def runs_of_blocks(
    file: str, only: str, read: Numbers, findings: list[Finding]
) -> tuple[IntArray, list[int | str]]:
    """Separate runs if the clock restarts after every blank line, or only ever at its first stamp.

    A clock that was set back goes elsewhere, and remains in one run.
    """
    time = read.quantities["time"]
    apart = in_different_rows(read.quantities)  # then a block is a channel
    begin = [row for row in read.blocks if 0 < row < time.size and not apart]
    where = "after every blank line"
    codes = np.cumsum(np.isin(np.arange(time.size), begin), dtype=np.intp)
    if not begin or len(begin) >= RUNS_MAX or not all(time[row] < time[row - 1] for row in begin):
        where = "at its first stamp"
        codes = restarts_of_channels(read.quantities)
    runs = int(codes.max(initial=0)) + 1
    if runs == 1 or runs > RUNS_MAX:
        return np.zeros(time.size, dtype=np.intp), [only]
    action = f"no column run; the clock restarts {where}: runs numbered from 1"
    findings.append(Finding("runs", file, "run", None, runs, action))
    return codes, list(range(1, runs + 1))


def restarts_of_channels(numbers: Mapping[str, FloatArray]) -> IntArray:
    """Count the restarts of the clock before every row.

    Channels with rows of their own, which may be written one after another, are counted apart.
    """
    time_s = numbers["time"]
    codes = np.zeros(time_s.size, dtype=np.intp)
    channels = [np.flatnonzero(np.isfinite(v)) for name, v in numbers.items() if name != "time"]
    for rows in channels if in_different_rows(numbers) else [np.arange(time_s.size)]:
        begin = restarts(time_s[rows])
        codes[rows] = np.cumsum(np.isin(np.arange(rows.size), begin), dtype=np.intp)
    return codes


def restarts(time_s: FloatArray) -> list[int]:
    """Rows at which a clock begins again, if it goes back only to its first stamp.

    Every section is longer than a burst of faulty stamps.
    """
    known = np.flatnonzero(np.isfinite(time_s))
    time_s = time_s[known]
    begin = np.flatnonzero(np.diff(time_s) < 0) + 1
    again = begin.size and np.all(np.abs(time_s[begin] - time_s[0]) <= forward_step(time_s))
    long = np.all(np.diff(begin, prepend=0, append=time_s.size) > BURST)
    return [int(row) for row in known[begin]] if again and long else []


def begun_again(
    codes: IntArray,
    labels: list[int | str],
    time_s: FloatArray,
    file: str,
    findings: list[Finding],
) -> tuple[IntArray, list[int | str], set[int | str]]:
    """Separate the recordings of one label between which other runs were recorded.

    A logger that restarts numbers its runs from 1 again; the drive may have moved in between. The
    clock begins anew, or has a gap there. Runs that are recorded at the same time and written in
    turns have none.

    Returns
    -------
    codes : ndarray
    labels : list
    again : set
        Labels of the runs that begin a session: the first one after each restart.
    """
    begins, sizes = sections(codes)
    if begins.size == len(labels) or in_no_order(codes):
        return codes, labels, set()
    new, names = codes.copy(), list(labels)
    current = list(range(len(labels)))
    pauses = [GAP_FACTOR * forward_step(time_s[codes == code]) for code in range(len(labels))]
    ended: dict[int, float] = {}
    times = [1] * len(labels)
    sessions: set[int | str] = set()
    restarted = 0
    for begin, size in zip(map(int, begins), map(int, sizes), strict=True):
        code = int(codes[begin])
        last = ended.get(code, float(time_s[begin]))
        if size > BURST and not last <= time_s[begin] <= last + pauses[code]:
            times[code] += 1
            current[code] = len(names)
            names.append(f"{labels[code]} ({times[code]})")
            how = "begins anew" if time_s[begin] < last else "has a gap"
            action = f"the clock {how} after other runs: read as run {names[-1]}"
            findings.append(Finding("split_run", file, "run", labels[code], size, action))
            if times[code] > restarted + 1:
                sessions.add(names[-1])
                restarted += 1
        new[begin : begin + size] = current[code]
        if size > BURST:
            ended[code] = float(time_s[begin + size - 1])
    if len(names) == len(labels):
        return codes, labels, set()
    present, new = first_appearance(new)
    return new, [names[code] for code in present], sessions


def forward_step(time_s: FloatArray) -> float:
    """Median of the forward steps of a clock; 0 if there are none."""
    step = np.diff(time_s)
    step = step[step > 0]
    return float(np.median(step)) if step.size else 0.0


def rows_of_runs(codes: IntArray, runs: int) -> Iterator[IntArray]:
    """Yield the rows of every run, in the order of the file."""
    order = np.argsort(codes, kind="stable")
    yield from np.split(order, np.searchsorted(codes[order], np.arange(1, runs)))


def read_bag(
    file: Path,
    mapping: Mapping[str, str],
    protocol: Protocol,
    join: Join | None,
    findings: list[Finding],
) -> MemoryTable:
    """Read the columns of a ROS 2 bag that a map names, joined to rows, with ``time_s``."""
    name = str(file)
    wanted = bag_columns(file, mapping)
    if not wanted:
        found = "a ROS 2 bag, and no map that names its columns"
        raise InputError(file, "", found, f"--map COLUMN=NAME_UNIT; columns: {list_columns(file)}")
    names = ("time_s", *wanted)
    try:
        header = Header(name, names, ("",) * len(names), "", lambda _: ())
        chosen, _ = resolve_columns(header, mapping, protocol)
    except InputError as error:
        expected = f"{error.expected}; columns: {list_columns(file)}"
        raise InputError(file, error.key, error.found, expected) from None
    leading = {column for quantity, (column, _) in chosen.items() if quantity in LEADING}
    clock = next((column for column in (RECEIVE_TIME, HEADER_STAMP) if column in mapping), None)
    channels = read_channels(file, wanted)
    return MemoryTable(name, join_channels(file, channels, leading, join, clock, findings))


def note_missing(campaign: Campaign) -> None:
    """Report quantities recorded only in some runs, which are not used."""
    for name, quantity in QUANTITIES.items():
        without = [run for run in campaign.runs if name not in run.columns]
        if len(without) == len(campaign.runs):
            continue
        for run in without:
            campaign.findings.append(
                Finding("missing", run.file, quantity.column, run.label, len(run), MISSING_ACTION)
            )


def without_single(runs: list[Run], findings: list[Finding]) -> list[Run]:
    """Leave out runs of one sample if others have more, because every run has its own offset.

    Rows below a table, such as minimum and mean values, look like such runs if they have a label.
    """
    longer = [run for run in runs if len(run) > 1]
    if not longer:
        return runs
    for run in runs:
        if len(run) == 1:
            findings.append(Finding("runs", run.file, "run", run.label, 1, SINGLE_ACTION))
    return longer


def without_copies(runs: list[Run], findings: list[Finding]) -> list[Run]:
    """Leave out runs that are identical to another one: the same recording, read twice."""
    first: dict[bytes, Run] = {}
    kept = []
    for run in runs:
        digest = hashlib.sha256()
        for name, values in sorted(run.columns.items()):
            digest.update(name.encode() + values.tobytes())
        known = first.setdefault(digest.digest(), run) if len(run) >= COPY_ROWS_LEAST else run
        if known is run:
            kept.append(run)
        else:
            action = f"identical in every digit to run {known.label} of {known.file}; left out"
            findings.append(Finding("runs", run.file, "run", run.label, len(run), action))
    return kept


def name_apart(runs: Sequence[Run]) -> None:
    """Prefix labels with the file if several files use them.

    A file that restarts the numbering begins a session: the drive may have moved in between.
    """
    labels = [run.label for run in runs]
    if len(set(labels)) != len(labels):
        told: set[int | str] = set()
        for before, run in zip((None, *runs), runs, strict=False):
            if before is not None and before.file != run.file:
                run.begins = run.label in told
            told.add(run.label)
        times = Counter(labels)
        for run, label in zip(runs, labels, strict=True):
            if times[label] > 1:
                run.label = f"{Path(run.file).name.split('.')[0]}:{label}"


def run_codes(
    file: str,
    column: str,
    values: Any,
    place: Callable[[int], str],
    findings: list[Finding] | None = None,
) -> tuple[IntArray, list[int | str]]:
    """Number the runs in the order of their first appearance.

    Parameters
    ----------
    file, column : str
        For messages.
    values : array of Arrow
        Content of the column.
    place : callable
        Location of a row.
    findings : list of Finding, optional
        Receives the rows without a label within a run, which belong to it.

    Raises
    ------
    InputError
        For other rows without a label, and for too many or too long labels.
    """
    import pyarrow as pa
    import pyarrow.compute as pc

    if isinstance(values, pa.ChunkedArray):
        values = values.combine_chunks()
    if pa.types.is_floating(values.type):
        values = pc.if_else(pc.is_nan(values), pa.scalar(None, values.type), values)
    elif not pa.types.is_integer(values.type):
        texts = values if pa.types.is_string(values.type) else as_text(values)
        texts = pc.utf8_trim_whitespace(texts)
        values = pc.if_else(pc.equal(texts, ""), pa.scalar(None, texts.type), texts)
        lost = pc.is_in(pc.utf8_lower(texts), value_set=pa.array(MISSING, texts.type))
        known = pc.if_else(lost, pa.scalar(None, texts.type), texts)
        if inside_runs(known):  # otherwise they are names of runs
            values = known
    if values.null_count:
        row = int(np.flatnonzero(mask_of(values.is_null()))[0])
        if findings is not None and inside_runs(values):
            count, values = values.null_count, pc.fill_null_forward(values)
            action = f"no label in {place(row)}; assigned to the run of the adjacent rows"
            run = whole_labels([values[row].as_py()])[0]
            findings.append(Finding("label", file, column, run, count, action))
    coded = values.dictionary_encode()
    if coded.null_count:
        row = int(np.flatnonzero(mask_of(values.is_null()))[0])
        raise InputError(file, column, f"no label in {place(row)}", "an integer or text")
    if len(coded.dictionary) > RUNS_MAX:
        found = f"{len(coded.dictionary)} labels in {len(values)} rows"
        raise InputError(file, column, found, f"labels of runs, at most {RUNS_MAX}")
    read = integers_of(coded.indices).astype(np.intp, copy=False)
    taken = with_stray_labels_taken_in(read)
    present, codes = np.unique(taken, return_inverse=True)
    labels = whole_labels([coded.dictionary[int(code)].as_py() for code in present])
    if findings is not None:
        for code in np.unique(codes[taken != read]):
            rows = np.flatnonzero((codes == code) & (taken != read))
            action = (
                f"another label in {place(int(rows[0]))}; assigned to the run of the adjacent rows"
            )
            findings.append(Finding("label", file, column, labels[code], rows.size, action))
    for code, label in enumerate(labels):
        if isinstance(label, str) and len(label) > LABEL_MAX:
            row = int(np.flatnonzero(codes == code)[0])
            found = f"a label of {len(label)} characters in {place(row)}"
            raise InputError(file, column, found, f"at most {LABEL_MAX}")
    # Labels that are written differently, such as 1 and 1.0, may be equal.
    unique = {label: i for i, label in enumerate(dict.fromkeys(labels))}
    same = np.array([unique[label] for label in labels], dtype=np.intp)
    return (same[codes] if same.size else codes), list(unique)


def with_stray_labels_taken_in(codes: IntArray) -> IntArray:
    """Return run codes in which a burst of other labels within a run has the code of that run.

    The run must be longer than a burst on both sides: recordings that alternate row by row are not
    changed, and those of which most sections are that short are in no order of runs.
    """
    begins, sizes = sections(codes)
    (long,) = np.nonzero(sizes > BURST)
    taken = codes.copy()
    if in_no_order(codes):
        return taken
    for before, behind in pairwise(long):
        first, last = begins[before] + sizes[before], begins[behind]
        if 0 < last - first <= BURST and codes[first - 1] == codes[last]:
            taken[first:last] = codes[last]
    return taken


def sections(
    codes: IntArray,
) -> tuple[IntArray, IntArray]:
    """First rows and lengths of the sections of one label."""
    begins = np.flatnonzero(np.diff(codes, prepend=codes[:1] - 1))
    return begins, np.diff(begins, append=codes.size)


def in_no_order(codes: IntArray) -> bool:
    """Whether most sections of one label are as short as a burst, and every run has several."""
    _, sizes = sections(codes)
    return bool(
        2 * np.count_nonzero(sizes > BURST) < sizes.size
        and sizes.size > BURST * (int(codes.max(initial=0)) + 1)
    )


def inside_runs(labels: Any) -> bool:
    """Whether all rows without a label are between rows of one run."""
    import pyarrow.compute as pc

    before, after = pc.fill_null_forward(labels), pc.fill_null_backward(labels)
    return bool(pc.all(pc.fill_null(pc.equal(before, after), False), min_count=0).as_py())


def as_text(values: Any) -> Any:
    """Return an array of Arrow as text."""
    import pyarrow as pa

    try:
        return values.cast(pa.string())
    except pa.ArrowException:
        return pa.array([None if v is None else str(v) for v in values.to_pylist()], pa.string())


def whole_labels(labels: Sequence[Any]) -> list[int | str]:
    """Return labels as integers if all are integers, else as text."""
    try:
        numbers = [float(label) for label in labels]
    except ValueError:
        return [str(label) for label in labels]
    if all(abs(n) < WHOLE_MAX and n == round(n) for n in numbers):
        return [round(n) for n in numbers]
    if all(isinstance(label, int) for label in labels):
        return [int(label) for label in labels]
    return [str(label) for label in labels]
