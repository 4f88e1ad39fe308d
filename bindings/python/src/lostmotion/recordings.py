"""Recordings: measurement files read into a campaign of runs, in SI units, with what is unsound.

A campaign is one or more files, or folders of them (CSV, ``.csv.gz``, Parquet). Nothing is dropped
in silence: whatever is odd about the data becomes a `Finding`, and only rows that cannot be used
at all (no number for torque or angle) are left out, counted and reported.
"""

from __future__ import annotations

import csv
import difflib
import gzip
import hashlib
import logging
import math
import re
import zlib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from lostmotion import units
from lostmotion.errors import InputError, did_you_mean, one_line
from lostmotion.files import read_bytes, reason

LOG = logging.getLogger(__name__)

FloatArray = npt.NDArray[np.float64]

SUFFIXES = (".csv", ".csv.gz", ".parquet")
"""File names that are read as recordings."""


@dataclass(frozen=True)
class Quantity:
    """A measured quantity: its name, the unit it is kept in, and what its values may be.

    The range is far beyond any drive: what lies outside it is another unit, a damaged file or a
    number that arithmetic cannot bear.
    """

    name: str
    unit: str
    dimension: units.Dimension
    low: float
    high: float

    @property
    def column(self) -> str:
        """Name of the column in the unit that it is kept in."""
        return f"{self.name}_{self.unit}" if self.unit else self.name


QUANTITIES = {
    quantity.name: quantity
    for quantity in (
        Quantity("run", "", units.DIMENSIONLESS, -math.inf, math.inf),
        Quantity("time", "s", units.TIME, -1e12, 1e12),
        Quantity("torque", "Nm", units.TORQUE, -1e6, 1e6),
        Quantity("input_angle", "rad", units.ANGLE, -1e9, 1e9),
        Quantity("output_angle", "rad", units.ANGLE, -1e9, 1e9),
        Quantity("lost_motion", "rad", units.ANGLE, -1e9, 1e9),
        Quantity("temperature", "C", units.TEMPERATURE, -units.ZERO_CELSIUS_K, 1e4),
        Quantity("cycles", "", units.DIMENSIONLESS, 0.0, 1e15),
        Quantity("tilt_moment", "Nm", units.TORQUE, -1e6, 1e6),
        Quantity("axial_force", "N", units.FORCE, -1e9, 1e9),
        Quantity("direction", "", units.DIMENSIONLESS, -1e6, 1e6),
    )
}

STILL_RAD = 1e-12
"""Lost motion that moves by no more than this is what rounding leaves of a constant."""

STUCK_SAMPLES = 50
"""Shortest stretch of identical values that can be called stuck."""

STUCK_SWING = 0.25
"""Share of its own range by which the other channel must move meanwhile."""

STUCK_TURN_RAD = 0.2
"""Turn of the output that no drive takes up as wind-up: both encoders must see it."""

WRAP_SLACK = 0.25
"""How far from a whole turn, in turns, a step may be and still be an encoder that wrapped."""

RATIO_EXPECTED = (
    "the ratio, which a drive file has and a blob has not (in Python ratio=), or lost_motion_rad"
)
"""What a recording of two angles needs."""

FOLLOWED_SLACK = WRAP_SLACK / 4
"""How far a step of the input usually is from the output's times the ratio at most, in turns.

13 arcmin of the output at a ratio of 100: another ratio, or another shaft, is further off."""

OPEN_ACTION = (
    "steps above a quarter turn, kept; whole turns may be missing that neither the ratio nor "
    "the other encoder tells"
)
"""What is done about an encoder that turns too fast for its samples."""

GAP_FACTOR = 10.0
"""A time step this many times the usual one is a gap in the recording."""


BRACKETED = re.compile(r"\s*([^\[(]+?)\s*[\[(]\s*([^\])]+?)\s*[\])]\s*")
"""A name with its unit in brackets, as plots and loggers label their columns."""

DIVIDED = re.compile(r"(.+)/(\d+(?:\.\d*)?(?:[eE][+-]?\d+)?)")
"""A name whose numbers are so many to the unit, as the counts of an encoder."""

DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?")
"""A number as it is written where a comma stands before the fraction."""

DUPLICATE_ACTION = "kept in the order of the file"
BACKWARD_ACTION = (
    "kept in the order of the file; where another recording begins, a column run has to say so"
)
"""What is done about time that goes back, and what it usually is."""

STEP_LEAST_S = 1e-9
"""Least usual time step of a recording."""

UNUSED = "not used"
"""What is done about a column that names nothing known."""

MISSING_ACTION = "only other runs have the column; not used"
"""What is done about a quantity that some runs have."""

RUNS_LISTED = 8
"""More runs than this are not listed one by one."""

WHOLE_MAX = 2.0**53
"""Below this a float holds every integer, and a run label that is a whole number stays one."""


@dataclass(frozen=True)
class Finding:
    """Something about the data that the reader should know.

    Attributes
    ----------
    kind : str
        ``nan``, ``duplicate_time``, ``backward_time``, ``stuck``, ``wrap``, ``gap``, ``split_run``,
        ``sign``, ``scale``, ``ratio``, ``ignored_column``, ``missing``, ``sampled``.
    file, column : str
        Where.
    run : int or str or None
        The run, where the finding belongs to one.
    count : int
        How many rows or steps.
    action : str
        What was done about it.
    """

    kind: str
    file: str
    column: str
    run: int | str | None
    count: int
    action: str

    def __str__(self) -> str:
        """Return the finding as one sentence."""
        place = f"{self.file}: {self.column}" + (
            f" (run {self.run})" if self.run is not None else ""
        )
        return f"{place}: {self.kind.replace('_', ' ')} x {self.count}: {self.action}"


def told(findings: Iterable[Finding]) -> list[str]:
    """Say findings in as few sentences as there are things to say: runs and columns together."""
    groups: dict[tuple[str, str, str], list[Finding]] = {}
    for finding in findings:
        column = "" if finding.action == UNUSED else finding.column
        groups.setdefault((finding.kind, column, finding.action), []).append(finding)
    return [_told(group) for group in groups.values()]


def _told(group: Sequence[Finding]) -> str:
    """Say findings of one kind, in one column or of columns that are not used."""
    first = group[0]
    if len(group) == 1:
        return str(first)
    files = list(dict.fromkeys(finding.file for finding in group))
    place = files[0]
    if len(files) > 1:
        place += f" and {len(files) - 1} more file{'s' if len(files) > 2 else ''}"
    if first.action == UNUSED:
        columns = dict.fromkeys(finding.column for finding in group)
        return f"{place}: {UNUSED}: the columns {', '.join(columns)}"
    labels = [str(finding.run) for finding in group if finding.run is not None]
    runs = ""
    if labels and len(files) > 1:
        runs = f" ({len(labels)} runs)"
    elif len(labels) > RUNS_LISTED:
        runs = f" ({len(labels)} runs, {labels[0]} to {labels[-1]})"
    elif labels:
        runs = f" (runs {', '.join(labels)})"
    count = sum(finding.count for finding in group)
    kind = first.kind.replace("_", " ")
    return f"{place}: {first.column}{runs}: {kind} x {count}: {first.action}"


SITTINGS_MAX = 24
"""Sittings that have a friction memory of their own; each costs a fit eight numbers."""


FINGERPRINT_DIGITS = 10
"""Decimals of a lost motion in rad, below any encoder, that tell a run from others."""


@dataclass
class Run:
    """One uninterrupted recording. Columns are named by quantity, in SI (temperature: C)."""

    label: int | str
    file: str
    columns: dict[str, FloatArray]
    begins: bool = False
    """Whether a sitting begins here: what the drive did since the run before is not known."""

    def __len__(self) -> int:
        return int(self.columns["torque"].size)

    def __repr__(self) -> str:
        """Say what it is; the numbers of a recording fill screens."""
        return (
            f"<Run {self.label!r} of {self.file}: {len(self)} samples of {', '.join(self.columns)}>"
        )

    def fingerprint(self) -> str:
        """SHA-256 of clock, torque and lost motion from its first sample on.

        The same whatever campaign the run is read in: others may shift its zero.
        """
        lost = self.lost_motion_rad
        digest = hashlib.sha256()
        for values in (self.time_s, self.torque_Nm, np.round(lost - lost[0], FINGERPRINT_DIGITS)):
            digest.update(np.ascontiguousarray(values + 0.0, dtype="<f8").tobytes())
        return "sha256:" + digest.hexdigest()

    @property
    def time_s(self) -> FloatArray:
        """Time stamps."""
        return self.columns["time"]

    @property
    def torque_Nm(self) -> FloatArray:
        """External torque on the output."""
        return self.columns["torque"]

    @property
    def lost_motion_rad(self) -> FloatArray:
        """Output angle minus input angle over the ratio."""
        return self.columns["lost_motion"]


@dataclass
class Campaign:
    """All recordings of one comparison, in the order in which they were made."""

    runs: list[Run]
    findings: list[Finding] = field(default_factory=list)
    recorded_rows: int | None = None
    """Rows that were recorded, where the runs hold a sample of them."""

    def __repr__(self) -> str:
        """Say what it is; the numbers of a campaign fill screens."""
        return (
            f"<Campaign: {self.rows} samples in {len(self.runs)} runs, "
            f"{len(self.findings)} findings>"
        )

    @property
    def rows(self) -> int:
        """Number of usable samples."""
        return sum(len(run) for run in self.runs)

    @property
    def starts(self) -> npt.NDArray[np.intp]:
        """Offsets of the runs in the joined columns; the last entry is the number of rows."""
        return np.concatenate(([0], np.cumsum([len(run) for run in self.runs]))).astype(np.intp)

    @property
    def largest_torque_Nm(self) -> float:
        """Largest torque in either direction."""
        return max(float(np.max(np.abs(run.torque_Nm))) for run in self.runs)

    def require_variation(self) -> None:
        """Refuse a campaign whose torque stands still, or whose lost motion does in every run.

        Raises
        ------
        InputError
            When it does.
        """
        torque = self.column("torque")
        if np.ptp(torque) == 0:
            found = f"a constant {torque[0]:.6g} Nm"
            raise InputError(self.runs[0].file, "torque_Nm", found, "a torque that varies")
        if all(np.ptp(run.lost_motion_rad) <= STILL_RAD for run in self.runs):
            found = f"a constant {self.runs[0].lost_motion_rad[0]:.6g} rad"
            expected = "a lost motion that varies, with all digits of its encoder"
            raise InputError(self.runs[0].file, "lost_motion_rad", found, expected)

    def quantities(self) -> tuple[str, ...]:
        """Quantities that every run has."""
        common = set(self.runs[0].columns)
        for run in self.runs[1:]:
            common &= set(run.columns)
        return tuple(name for name in QUANTITIES if name in common)

    def column(self, name: str) -> FloatArray:
        """One quantity of all runs, joined, by its name alone or as its column has it.

        Raises
        ------
        InputError
            When not every run has it.
        """
        by_column = {QUANTITIES[quantity].column: quantity for quantity in self.quantities()}
        name = by_column.get(name, name)
        if any(name not in run.columns for run in self.runs):
            have = self.quantities()
            expected = f"one of {', '.join(have)}" + did_you_mean(name, have)
            raise InputError("campaign", name, "no such column", expected)
        return np.concatenate([run.columns[name] for run in self.runs])

    def sittings(self) -> list[int]:
        """Places of the runs at which a sitting begins, the first among them."""
        begins = [i for i, run in enumerate(self.runs) if i == 0 or run.begins]
        return begins[:SITTINGS_MAX]

    def table(self) -> dict[str, npt.NDArray[Any]]:
        """Columns of all runs, joined, under the names that a file has: what a data frame takes.

        ``pandas.DataFrame(campaign.table())``; quantities that not every run has are left out.
        """
        labels = [np.full(len(run), run.label, dtype=object) for run in self.runs]
        joined = {QUANTITIES[name].column: self.column(name) for name in self.quantities()}
        return {"run": np.concatenate(labels), **joined}

    def fingerprint(self) -> str:
        """SHA-256 of the numbers as they are used, whatever file format they came in."""
        digest = hashlib.sha256()
        for run in self.runs:
            digest.update(f"run {run.label}\n".encode())
            for name in sorted(run.columns):
                digest.update(f"{name} {len(run)}\n".encode())
                digest.update(np.ascontiguousarray(run.columns[name], dtype="<f8").tobytes())
        return "sha256:" + digest.hexdigest()


@dataclass(frozen=True)
class ColumnName:
    """A quantity with a unit, as the header or a map names it."""

    quantity: Quantity
    unit: units.Unit | None
    factor: float = 1.0
    """What the numbers are multiplied by before the unit is converted."""


def parse_map(entries: Iterable[str]) -> dict[str, str]:
    """Read ``COLUMN=NAME_UNIT`` options of the command line.

    Raises
    ------
    InputError
        When an entry has no ``=`` or names a column twice.
    """
    mapping: dict[str, str] = {}
    for entry in entries:
        column, separator, target = entry.partition("=")
        if not separator or not column or not target:
            raise InputError("--map", entry, "no COLUMN=NAME_UNIT", "e.g. POSITION=lost_motion_rev")
        if column in mapping:
            raise InputError("--map", column, "the column twice", "each column once")
        mapping[column] = target
    return mapping


def expected_units(quantity: Quantity) -> str:
    """Say which units a column of this quantity may have."""
    return units.describe(quantity.dimension)


def spelled_out(label: str) -> str:
    """Name with a unit suffix of a label that has its unit in brackets; others stay.

    Examples
    --------
    >>> spelled_out("Input angle [°]"), spelled_out("Torque (N·m)"), spelled_out("torque_Nm")
    ('input_angle_deg', 'torque_Nm', 'torque_Nm')
    """
    found = BRACKETED.fullmatch(label)
    if found is None:
        return label
    unit = found[2].replace("°C", "C").replace("°", "deg").replace("/", "_per_")
    base = re.sub(r"[\s-]+", "_", found[1]).lower()
    return f"{base}_{re.sub('[ ·*]', '', unit)}"


def divisor(file: str, column: str, text: str) -> float:
    """Read the number that a column is divided by."""
    value = float(text)
    if not 0.0 < value < math.inf:
        raise InputError(file, column, f"'/{text}' in --map", "a positive number behind the slash")
    return value


def parse_column(file: str, column: str, name: str) -> ColumnName | None:
    """Understand a column name; None when it names nothing that is known here.

    A leading minus sign (in a map) turns the column round, a number behind a slash divides it.
    """
    factor = -1.0 if name.startswith("-") else 1.0
    name = name.removeprefix("-")
    divided = DIVIDED.fullmatch(name)
    if divided is not None:
        name, factor = divided[1], factor / divisor(file, column, divided[2])
    name = spelled_out(name)
    base, unit = units.split_unit(name)
    if name in QUANTITIES:
        base, unit = name, None
    if base not in QUANTITIES:
        for known in QUANTITIES.values():
            suffix = name.removeprefix(f"{known.name}_")
            if unit is None and known.unit and suffix != name and "_" not in suffix:
                raise InputError(file, column, f"unknown unit '{suffix}'", expected_units(known))
        return None
    quantity = QUANTITIES[base]
    if unit is None and quantity.unit:
        raise InputError(
            file,
            column,
            "no unit",
            f"{expected_units(quantity)} as a suffix, e.g. {quantity.column}, "
            f"or --map {column}={quantity.column}",
        )
    found = unit.dimension if unit else units.DIMENSIONLESS
    if found != quantity.dimension:
        symbol = unit.symbol if unit else ""
        raise InputError(
            file, column, f"unit '{symbol}', {units.describe(found)}", expected_units(quantity)
        )
    return ColumnName(quantity, unit, factor)


def resolve_columns(
    file: str, header: Sequence[str], mapping: Mapping[str, str]
) -> tuple[dict[str, tuple[str, ColumnName]], list[str]]:
    """Decide which column of a file is which quantity; a map counts where its column is.

    Returns
    -------
    chosen : dict
        From the name of a quantity to the column and how it is to be read.
    ignored : list of str
        Columns that name nothing known.
    """
    chosen: dict[str, tuple[str, ColumnName]] = {}
    doubtful: list[tuple[str, InputError]] = []
    ignored: list[str] = []
    for column in sorted(header, key=lambda name: name not in mapping):
        try:
            name = parse_column(file, column, mapping.get(column, column))
        except InputError as error:
            if column in mapping:
                raise
            doubtful.append((column, error))
            continue
        if name is None:
            if column in mapping:
                raise InputError(
                    file,
                    column,
                    f"the name '{mapping[column]}' in --map",
                    f"one of {', '.join(q.column for q in QUANTITIES.values())}"
                    + did_you_mean(mapping[column], (q.column for q in QUANTITIES.values())),
                )
            ignored.append(column)
        elif name.quantity.name in chosen:
            first = chosen[name.quantity.name][0]
            if first in mapping and column not in mapping:
                ignored.append(column)
                continue
            raise InputError(
                file, column, f"{name.quantity.name} a second time (first '{first}')", "it once"
            )
        else:
            chosen[name.quantity.name] = (column, name)
    faults: list[InputError] = []
    there = set(chosen)
    for column, doubt in doubtful:
        # A column such as torque_raw beside torque_Nm is not meant; alone it has no known unit.
        meant = {q for q in QUANTITIES if f"{spelled_out(column)}_".startswith(f"{q}_")}
        if meant & set(chosen):
            ignored.append(column)
        else:
            faults.append(doubt)
            there |= meant
    refuse_faults(file, faults + lacking(file, header, mapping, there))
    return chosen, ignored


def lacking(
    file: str, header: Sequence[str], mapping: Mapping[str, str], there: Collection[str]
) -> list[InputError]:
    """Say which quantities a recording needs and a file has not."""
    faults = []
    nothing = f"no such column (there are {', '.join(header)})"

    def named(name: str) -> str:
        """Say how a column of the quantity may be called."""
        foreign = [
            c for c, t in mapping.items() if f"{t.removeprefix('-')}_".startswith(f"{name}_")
        ]
        return ", ".join([QUANTITIES[name].column, *(f"{c} by the map" for c in foreign)])

    for name in ("time", "torque"):
        if name not in there:
            column = QUANTITIES[name].column
            near = {h.lower(): h for h in header}
            close = difflib.get_close_matches(name, near, n=1)
            meant = near[close[0]] if close else "COLUMN"
            faults.append(
                InputError(file, column, nothing, f"{named(name)}, or --map {meant}={column}")
            )
    if "lost_motion" not in there and not {"input_angle", "output_angle"} <= set(there):
        have = [name for name in ("input_angle", "output_angle") if name in there]
        found = f"only {have[0]} among {', '.join(header)}" if have else nothing
        expected = f"{named('input_angle')} and {named('output_angle')}, or {named('lost_motion')}"
        faults.append(InputError(file, "lost_motion_rad", found, expected))
    return faults


def refuse_faults(file: str, faults: Sequence[InputError]) -> None:
    """Raise all that is wrong with the columns of a file as one error of one line."""
    if len(faults) == 1:
        raise faults[0]
    if faults:
        columns = ", ".join(fault.key for fault in faults)
        alike = len({fault.found for fault in faults}) == 1
        found = [fault.found if alike else f"{fault.key}: {fault.found}" for fault in faults]
        expected = "; ".join(fault.expected for fault in faults)
        raise InputError(file, columns, "; ".join(dict.fromkeys(found)), expected)


def header_of(file: Path) -> list[str]:
    """Read the names of a file's columns."""
    if file.name.lower().endswith(".parquet"):
        return list(open_parquet(file).schema_arrow.names)
    return _open_csv(file)[0]


def check_map(files: Sequence[Path], mapping: Mapping[str, str]) -> None:
    """Refuse a map of a column that no file has; files of one campaign may name theirs apart.

    Raises
    ------
    InputError
        Names the column and those that there are.
    """
    headers: dict[str, None] = {}
    unread = list(files)
    for column, target in mapping.items():
        while column not in headers and unread:
            headers.update(dict.fromkeys(header_of(unread.pop(0))))
        if column in headers:
            continue
        more = f" and {len(files) - 1} more file{'s' * (len(files) > 2)}" if len(files) > 1 else ""
        raise InputError(
            f"{files[0]}{more}",
            column,
            f"no such column (there are {', '.join(headers)})",
            f"the column that the map {column}={target} names" + did_you_mean(column, headers),
        )


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
            there, regular = path.exists(), path.is_file()
        except OSError as error:
            wanted = "a recording or a folder of them"
            raise InputError(path, "", reason(error), wanted) from None
        if inside is not None:
            inside = [p for p in inside if p.name.lower().endswith(SUFFIXES)]
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
        ``NAME_UNIT/NUMBER`` divides (``input_angle_rev/4096``: counts). It counts in the files that
        have the column, where it goes before a column that has the name already.

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
        found = _read_file(file, dict(mapping or {}), ratio, findings)
        LOG.info("read %s: %d rows in %d runs", file, sum(map(len, found)), len(found))
        runs.extend(found)
    name_apart(runs)
    campaign = Campaign(runs, findings)
    note_missing(campaign)
    check_ratio(campaign, ratio)
    bring_together(campaign, ratio)
    check_sign(campaign)
    for finding in findings:
        LOG.info("%s", finding)
    return campaign


def _read_file(
    file: Path, mapping: dict[str, str], ratio: float | None, findings: list[Finding]
) -> list[Run]:
    table = read_table(file)
    name = str(file)
    chosen, ignored = resolve_columns(name, list(table), mapping)
    for column in ignored:
        findings.append(Finding("ignored_column", name, column, None, 1, unused(column, chosen)))
    numbers = in_si(name, table, chosen)
    rows = len(numbers["torque"])
    if rows == 0:
        raise InputError(name, "", "no rows", "at least one sample")
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
        run = sound_run(name, label, columns, ratio, findings)
        if run is not None:
            runs.append(run)
    if not runs:
        raise InputError(name, "torque_Nm", "no row with numbers for torque and angle", "some")
    return runs


def unused(column: str, chosen: Iterable[str]) -> str:
    """Say that a column is not used, and what to write if it is what its name says."""
    quantity = column.lower()
    if quantity not in QUANTITIES or quantity in chosen:
        return UNUSED
    return f"{UNUSED}; if it is the {quantity}: --map {column}={QUANTITIES[quantity].column}"


def in_si(
    file: str,
    table: Mapping[str, npt.NDArray[Any]],
    chosen: Mapping[str, tuple[str, ColumnName]],
) -> dict[str, FloatArray]:
    """Return the quantities of a table, but for the run, in the units that they are kept in."""
    numbers: dict[str, FloatArray] = {}
    for quantity, (column, meaning) in chosen.items():
        if quantity == "run":
            continue
        values = meaning.factor * numbers_of(file, column, table[column])
        if meaning.unit is not None:
            values = units.convert(values, meaning.unit.symbol, meaning.quantity.unit)
        check_range(file, column, values, meaning.quantity)
        numbers[quantity] = np.ascontiguousarray(values)
    return numbers


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


def check_range(file: str, column: str, values: FloatArray, quantity: Quantity) -> None:
    """Refuse numbers that this quantity cannot have; what is not finite is counted elsewhere."""
    beyond = np.isfinite(values) & ~((values >= quantity.low) & (values <= quantity.high))
    if np.any(beyond):
        row = int(np.flatnonzero(beyond)[0])
        unit = f" {quantity.unit}" if quantity.unit else ""
        raise InputError(
            file,
            column,
            f"{values[row]:.6g}{unit} in row {row + 1}",
            f"{quantity.low:g} to {quantity.high:g}{unit}",
        )


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


def check_steps(file: str, time_s: FloatArray) -> None:
    """Refuse a clock in another unit: so short a step makes speeds that arithmetic cannot bear."""
    step = np.diff(time_s)
    step = step[step > 0]
    if step.size and float(np.median(step)) < STEP_LEAST_S:
        found = f"steps of {float(np.median(step)):.3g} s"
        raise InputError(file, "time_s", found, f"{STEP_LEAST_S:g} s or more")


def sound_run(
    file: str,
    label: int | str,
    columns: dict[str, FloatArray],
    ratio: float | None,
    findings: list[Finding],
) -> Run | None:
    """Look a run over, note what is odd, and leave out only rows that cannot be used."""

    def note(kind: str, column: str, count: int, action: str) -> None:
        findings.append(Finding(kind, file, column, label, count, action))

    needed: list[str] = [n for n in ("time", "torque", "lost_motion") if n in columns]
    if "lost_motion" not in columns:
        needed += ["input_angle", "output_angle"]
    usable = np.ones(columns["torque"].size, dtype=bool)
    for quantity, values in columns.items():
        bad = ~np.isfinite(values)
        count = int(np.count_nonzero(bad))
        if count == 0:
            continue
        column = QUANTITIES[quantity].column
        if quantity in needed:
            usable &= ~bad
            note("nan", column, count, "rows left out")
        else:
            note("nan", column, count, "kept; the column is not used for these rows")
    if not usable.any():
        return None
    # Over all rows: where some are left out, a step is longer than the encoder made it.
    angles = {name: columns[name] for name in ("input_angle", "output_angle") if name in columns}
    wraps = {}
    columns = dict(columns)
    for quantity, values in angles.items():
        columns[quantity], wraps[quantity] = unwrap_known(values)
    if not usable.all():
        columns = {quantity: values[usable] for quantity, values in columns.items()}

    check_steps(file, columns["time"])
    step = np.diff(columns["time"])
    if step.size:
        duplicates = int(np.count_nonzero(step == 0))
        backward = int(np.count_nonzero(step < 0))
        usual = float(np.median(step[step > 0])) if np.any(step > 0) else 0.0
        gaps = int(np.count_nonzero(step > GAP_FACTOR * usual)) if usual > 0 else 0
        if duplicates:
            note("duplicate_time", "time_s", duplicates, DUPLICATE_ACTION)
        if backward:
            note("backward_time", "time_s", backward, BACKWARD_ACTION)
        if gaps:
            note("gap", "time_s", gaps, f"steps above {GAP_FACTOR * usual:.3g} s, kept")
    if ratio is not None and {"input_angle", "output_angle"} <= columns.keys():
        followed = follow_output(columns["input_angle"], columns["output_angle"], ratio)
        if followed is not columns["input_angle"]:
            lost = (followed - angles["input_angle"][usable]) / (2 * np.pi)
            wraps["input_angle"] = int(np.count_nonzero(np.round(np.diff(lost))))
            columns["input_angle"] = followed
    for quantity, count in wraps.items():
        column = QUANTITIES[quantity].column
        if count:
            note("wrap", column, count, "whole turns put back")
        elif open_steps(columns[quantity]):
            note("wrap", column, open_steps(columns[quantity]), OPEN_ACTION)
    if "lost_motion" not in columns:
        assert ratio is not None
        columns["lost_motion"] = columns["output_angle"] - columns["input_angle"] / ratio
    for quantity, count in stuck_sensors(columns, ratio).items():
        note("stuck", QUANTITIES[quantity].column, count, "kept; looks like a dead sensor")
    return Run(label, file, columns)


def stuck_sensors(columns: Mapping[str, FloatArray], ratio: float | None) -> dict[str, int]:
    """Name the sensors that stood still while what they measure moved, and for how many samples."""
    found = {}
    for quantity, other in (("torque", "lost_motion"), ("lost_motion", "torque")):
        count = longest_stuck(columns[quantity], columns[other])
        if count and quantity == "lost_motion" and "output_angle" in columns:
            stood = longest_stuck(columns["output_angle"], columns[other])
            quantity = "output_angle" if stood >= count else quantity
        if count:
            found[quantity] = count
    if ratio is not None and {"input_angle", "output_angle"} <= columns.keys():
        turns = {
            "input_angle": columns["input_angle"] / ratio,
            "output_angle": columns["output_angle"],
        }
        for quantity, other in (("input_angle", "output_angle"), ("output_angle", "input_angle")):
            count = longest_stuck(turns[quantity], turns[other], STUCK_TURN_RAD)
            if count:
                found[quantity] = max(count, found.get(quantity, 0))
    return found


def unwrap(angle_rad: FloatArray) -> tuple[FloatArray, int]:
    """Put back the whole turns that a wrapping encoder lost.

    A step near whole turns counts as a wrap when the usual step is below a quarter turn. Where the
    recording spans no more than one turn, the usual step is taken after putting the turns back,
    because an encoder that rests at its seam wraps all the time. Faster recordings are left alone:
    there a wrap cannot be told from motion.

    Returns
    -------
    angle_rad : ndarray
        The same array when nothing wrapped.
    wraps : int
        Number of wraps found.
    """
    turn = 2 * np.pi
    step = np.diff(angle_rad)
    turns = np.round(step / turn)
    remainder = np.abs(step - turns * turn)
    wrapped = (turns != 0) & (remainder < WRAP_SLACK * turn)
    count = int(np.count_nonzero(wrapped))
    if count == 0:
        return angle_rad, 0
    within_one_turn = np.ptp(angle_rad) <= turn * (1 + 1e-9)
    usual = np.median(remainder if within_one_turn else np.abs(step))
    if usual > WRAP_SLACK * turn:
        return angle_rad, 0
    lost = np.concatenate(([0.0], np.cumsum(np.where(wrapped, turns, 0.0))))
    return angle_rad - lost * turn, count


def unwrap_known(angle_rad: FloatArray) -> tuple[FloatArray, int]:
    """Unwrap the samples that have a number."""
    known = np.isfinite(angle_rad)
    whole = angle_rad.copy()
    whole[known], wraps = unwrap(angle_rad[known])
    return (whole, wraps) if wraps else (angle_rad, 0)


def follow_output(input_rad: FloatArray, output_rad: FloatArray, ratio: float) -> FloatArray:
    """Put back the turns of the input that only the output tells, where it moves too fast to tell.

    Where the input usually makes more than a quarter turn from sample to sample every step is
    looked at, otherwise those above a quarter turn: a tooth that is jumped is no wrap. The same
    array is returned where there is nothing to do, or the output goes another way than the input
    over the ratio.
    """
    turn = 2 * np.pi
    step, expected = np.diff(input_rad), ratio * np.diff(output_rad)
    if step.size == 0:
        return input_rad
    turns = np.round((step - expected) / turn)
    off = np.abs(step - expected - turns * turn)
    fast = np.median(np.abs(expected)) > WRAP_SLACK * turn
    doubtful = np.ones(step.size, dtype=bool) if fast else np.abs(step) > WRAP_SLACK * turn
    missed = doubtful & (turns != 0) & (off < WRAP_SLACK * turn)
    if not np.any(missed) or np.median(off) > FOLLOWED_SLACK * turn:
        return input_rad
    return input_rad - turn * np.concatenate(([0.0], np.cumsum(np.where(missed, turns, 0.0))))


def open_steps(angle_rad: FloatArray) -> int:
    """Count the steps above a quarter turn where they are usual and the angle is within a turn."""
    turn = 2 * np.pi
    known = angle_rad[np.isfinite(angle_rad)]
    step = np.abs(np.diff(known))
    if step.size == 0 or np.ptp(known) > turn or np.median(step) <= WRAP_SLACK * turn:
        return 0
    return int(np.count_nonzero(step > WRAP_SLACK * turn))


def longest_stuck(values: FloatArray, other: FloatArray, swing: float | None = None) -> int:
    """Length of the longest stretch of identical values during which the other channel moved on.

    Returns 0 when there is no stretch of at least `STUCK_SAMPLES` samples over which `other` covers
    `swing`, by default `STUCK_SWING` of its range.
    """
    if swing is None:
        swing = STUCK_SWING * float(np.ptp(other))
    change = np.flatnonzero(np.diff(values) != 0)
    edges = np.concatenate(([0], change + 1, [values.size]))
    lengths = np.diff(edges)
    if swing == 0:
        return 0
    longest = 0
    for i in np.flatnonzero(lengths >= STUCK_SAMPLES):
        if lengths[i] > longest and np.ptp(other[edges[i] : edges[i + 1]]) >= swing:
            longest = int(lengths[i])
    return longest


RATIO_DOUBT_RAD = 5e-3
"""Lost motion of 17 arcmin that grows with the output's turn is another ratio."""


def check_ratio(campaign: Campaign, ratio: float | None) -> None:
    """Note a campaign whose angles, where the drive turns, have another ratio than was stated."""
    if ratio is None or any(finding.kind == "stuck" for finding in campaign.findings):
        return
    measured, swing = [], []
    for run in campaign.runs:
        if not {"input_angle", "output_angle"} <= run.columns.keys():
            continue
        put_in, out = run.columns["input_angle"], run.columns["output_angle"]
        turned = float(np.ptp(out))
        if turned < STUCK_TURN_RAD or np.ptp(put_in) < STUCK_TURN_RAD or open_steps(put_in):
            continue
        centred = out - out.mean()
        measured.append(float(centred @ put_in) / float(centred @ centred))
        swing.append(turned)
    if not measured:
        return
    found = float(np.median(measured))
    if abs(found / ratio - 1) * float(np.median(swing)) > RATIO_DOUBT_RAD:
        action = (
            f"{found:.4g} input turns for one output turn by the angles, {ratio:.4g} by the ratio: "
            "look at the ratio, at its sign, and at the units and signs of the two angles"
        )
        file = campaign.runs[0].file
        campaign.findings.append(
            Finding("ratio", file, "input_angle_rad", None, campaign.rows, action)
        )


def bring_together(campaign: Campaign, ratio: float | None) -> None:
    """Put back the whole turns of the input by which runs begin apart from the first one.

    An encoder that knows one turn begins every run within it, wherever the output stands. A run
    whose lost motion was recorded, and not taken from the angles, is left alone.
    """
    if ratio is None or any(f.kind in ("stuck", "ratio") for f in campaign.findings):
        return
    turn = 2 * np.pi
    first: float | None = None
    for run in campaign.runs:
        if not {"input_angle", "output_angle"} <= run.columns.keys():
            continue
        angle, out = run.columns["input_angle"], run.columns["output_angle"]
        if open_steps(angle) or not np.array_equal(run.lost_motion_rad, out - angle / ratio):
            continue
        middle = float(np.median(run.lost_motion_rad))
        first = middle if first is None else first
        turns = round((middle - first) * ratio / turn)
        if turns == 0:
            continue
        run.columns["input_angle"] = angle + turns * turn
        run.columns["lost_motion"] = out - run.columns["input_angle"] / ratio
        action = "begins whole turns from the first run, by the output: put back"
        campaign.findings.append(
            Finding("wrap", run.file, "input_angle_rad", run.label, abs(turns), action)
        )


def check_sign(campaign: Campaign) -> None:
    """Note a campaign whose lost motion falls with growing torque: one sign is turned round.

    Where a sensor is stuck, or the ratio wrong, the lost motion says nothing.
    """
    if any(finding.kind in ("stuck", "ratio") for finding in campaign.findings):
        return
    torque = campaign.column("torque")
    centred = np.concatenate(
        [run.lost_motion_rad - float(np.mean(run.lost_motion_rad)) for run in campaign.runs]
    )
    if float(np.dot(torque - torque.mean(), centred)) < 0:
        campaign.findings.append(
            Finding(
                "sign",
                campaign.runs[0].file,
                "lost_motion_rad",
                None,
                campaign.rows,
                "falls with growing torque; turn one column round with --map COLUMN=-NAME_UNIT",
            )
        )


SCALE_DOUBT = 10.0
"""A drive that gives way this many times more, or less, than its file says is another drive."""

SCALE_SHARE = 0.5
"""Least share of the lost motion that its own curve must explain, for its scale to say anything."""

TINY = float(np.finfo(np.float64).tiny)
"""Below it a ratio of two sums says nothing more."""

MISTAKEN = (
    (math.pi / 180, "degrees taken for radians"),
    (math.pi / 10_800, "arc minutes taken for radians"),
    (math.pi / 648_000, "arc seconds taken for radians"),
    (1e-3, "N mm taken for N m, or mrad for rad"),
)
"""Units that are mistaken for others: their size in what they are taken for."""


def check_scale(campaign: Campaign, expected: Callable[[FloatArray], FloatArray]) -> None:
    """Note a campaign of which the drive file explains the shape, but not nearly the size.

    Parameters
    ----------
    campaign : Campaign
        Gets a finding.
    expected : callable
        Lost motion in rad that the drive file gives at torques in N m.
    """
    if any(finding.kind in ("sign", "stuck", "scale", "ratio") for finding in campaign.findings):
        return
    measured, model = [], []
    for run in campaign.runs:
        curve = expected(run.torque_Nm)
        model.append(curve - float(np.mean(curve)))
        measured.append(run.lost_motion_rad - float(np.mean(run.lost_motion_rad)))
    x, y = np.concatenate(model), np.concatenate(measured)
    both, across, up = float(x @ y), float(x @ x), float(y @ y)
    if across == 0 or both <= 0 or both * both < SCALE_SHARE * across * up:
        return
    times = max(both / across, TINY)
    if 1 / SCALE_DOUBT < times < SCALE_DOUBT:
        return
    # A torque in N mm makes the model's curve larger, an angle in degrees the measured one.
    off = abs(math.log(times))
    size, name = min(MISTAKEN, key=lambda one: abs(off + math.log(one[0])))
    hint = f", about the factor of {name}" if abs(off + math.log(size)) < math.log(2) else ""
    campaign.findings.append(
        Finding(
            "scale",
            campaign.runs[0].file,
            "lost_motion_rad",
            None,
            campaign.rows,
            f"{times:.3g} times what the drive file says at these torques{hint}: "
            "look at the units of the columns and of the file",
        )
    )


def expected_number(text: str) -> str:
    """Say what stands in the place of a text that is no number."""
    if text.count(",") == 1 and "." not in text:
        return "a number with a decimal point"
    return "a number, or nothing, NA or nan where there is none"


def numbers_of(file: str, column: str, values: npt.NDArray[Any]) -> FloatArray:
    """Read a column as numbers; what is empty is not a number."""
    if values.dtype.kind in "fiub":
        return values.astype(np.float64)
    out = np.empty(values.size)
    for i, text in enumerate(values):
        try:
            out[i] = float(text) if str(text).strip() else np.nan
        except ValueError:
            if str(text).strip().lower() in ("na", "n/a", "null", "none"):
                out[i] = np.nan
                continue
            found = f"'{text}' in row {i + 1}"
            raise InputError(file, column, found, expected_number(str(text))) from None
    return out


def read_table(file: Path) -> dict[str, npt.NDArray[Any]]:
    """Read a file's columns as they stand."""
    if file.name.lower().endswith(".parquet"):
        return _read_parquet(file)
    return _read_csv(file)


def _read_parquet(file: Path) -> dict[str, npt.NDArray[Any]]:
    with arrow_errors(file):
        return from_arrow(open_parquet(file).read())


@contextmanager
def arrow_errors(file: str | Path) -> Iterator[None]:
    """Say in one line that a Parquet file cannot be opened, or read further on.

    Raises
    ------
    InputError
        For what Arrow raises inside, and where there is no Arrow.
    """
    try:
        import pyarrow
    except ImportError:
        raise InputError(
            file, "", "a Parquet file, but no pyarrow to read it", "pip install pyarrow, or CSV"
        ) from None
    try:
        yield
    except (pyarrow.ArrowException, OSError) as error:
        found = f"unreadable Parquet ({one_line(str(error))})"
        raise InputError(file, "", found, "a Parquet file") from None


def open_parquet(file: Path) -> Any:
    """Open a Parquet file without reading it; read it inside `arrow_errors` too."""
    with arrow_errors(file):
        import pyarrow.parquet

        opened = pyarrow.parquet.ParquetFile(file)
    refuse_twins(file, opened.schema_arrow.names)
    return opened


def refuse_twins(file: Path, header: Sequence[str]) -> None:
    """Refuse a header that names a column twice."""
    for name in header:
        if list(header).count(name) > 1:
            raise InputError(file, name, "the column twice", "each column once")


def from_arrow(table: Any) -> dict[str, npt.NDArray[Any]]:
    """Take the columns out of an Arrow table."""
    columns: dict[str, npt.NDArray[Any]] = {}
    for name, column in zip(table.column_names, table.columns, strict=True):
        kind = str(column.type)
        if kind.startswith(("int", "uint")) and column.null_count == 0:
            columns[name] = column.to_numpy(zero_copy_only=False)
        elif kind.startswith(("int", "uint", "float", "double", "halffloat")):
            columns[name] = column.cast("float64").to_numpy(zero_copy_only=False)
        elif kind == "null":
            columns[name] = np.full(len(column), np.nan)
        else:
            columns[name] = np.array(arrow_texts(column), dtype=np.str_)
    return columns


def native_bytes(text: bytes) -> Any:
    """Put text into memory of Arrow's own, for its readers.

    Their threads let go of it when they like, also while Python ends; of an object of Python they
    could not, and would abort a command that has already answered.
    """
    import pyarrow

    memory = pyarrow.allocate_buffer(len(text))
    np.frombuffer(memory, dtype=np.uint8)[:] = np.frombuffer(text, dtype=np.uint8)
    return pyarrow.BufferReader(memory)


def arrow_texts(column: Any) -> list[str]:
    """Read a column that holds no numbers as texts: Python's own times end at microseconds."""
    kind = str(column.type)
    if kind.startswith("duration"):
        unit = kind.removeprefix("duration[").removesuffix("]")
        return [
            "" if value is None else f"{value} {unit}" for value in column.cast("int64").to_pylist()
        ]
    if kind.startswith("timestamp"):
        column = column.cast("string")
    return ["" if value is None else str(value) for value in column.to_pylist()]


def _open_csv(file: Path) -> tuple[list[str], list[str], str]:
    """Read a CSV file as its header, its other lines, and what separates columns."""
    raw = read_bytes(file, "a CSV file")
    try:
        if file.name.lower().endswith(".gz"):
            raw = gzip.decompress(raw)
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(file, "", "bytes that are not UTF-8", "a CSV file") from None
    except (OSError, EOFError, zlib.error) as error:
        raise InputError(file, "", f"unreadable gzip ({error})", "a whole .csv.gz file") from None
    skip = 0
    lines = text.splitlines()
    while skip < len(lines) and (not lines[skip].strip() or lines[skip].startswith("#")):
        skip += 1
    if skip == len(lines):
        raise InputError(file, "", "an empty file", "a header line and samples")
    header_line = lines[skip]
    delimiter = next((d for d in ",;\t" if d in header_line), ",")
    header = [name.strip() for name in _fields(file, [header_line], delimiter)[0]]
    refuse_twins(file, header)
    return header, lines[skip + 1 :], delimiter


def _read_csv(file: Path) -> dict[str, npt.NDArray[Any]]:
    header, lines, delimiter = _open_csv(file)
    try:
        import pyarrow
        import pyarrow.csv
    except ImportError:
        return _with_points(_parse_csv(file, header, lines, delimiter), delimiter)
    try:
        table = pyarrow.csv.read_csv(
            native_bytes("\n".join(lines).encode()),
            read_options=pyarrow.csv.ReadOptions(column_names=header),
            parse_options=pyarrow.csv.ParseOptions(delimiter=delimiter),
            convert_options=pyarrow.csv.ConvertOptions(
                null_values=["", "NA", "N/A", "n/a", "null", "NULL", "None"],
                strings_can_be_null=False,
            ),
        )
    except pyarrow.ArrowException:
        # The plain reader finds the row at fault, or copes.
        return _with_points(_parse_csv(file, header, lines, delimiter), delimiter)
    return _with_points(from_arrow(table), delimiter)


def _with_points(
    columns: dict[str, npt.NDArray[Any]], delimiter: str
) -> dict[str, npt.NDArray[Any]]:
    """Put points for decimal commas, where commas do not separate the columns.

    A column that has points as well is left as it is: one of the two separates thousands.
    """
    if delimiter == ",":
        return columns
    for name, values in columns.items():
        if values.dtype.kind != "U" or np.any(np.char.find(values, ".") >= 0):
            continue
        if any(DECIMAL_COMMA.fullmatch(text.strip()) for text in values):
            columns[name] = np.char.replace(values, ",", ".")
    return columns


def _fields(file: Path, lines: list[str], delimiter: str) -> list[list[str]]:
    try:
        return list(csv.reader(lines, delimiter=delimiter))
    except csv.Error as error:
        raise InputError(file, "", str(error), "lines of numbers") from None


def _parse_csv(
    file: Path, header: list[str], lines: list[str], delimiter: str
) -> dict[str, npt.NDArray[Any]]:
    """Read CSV without pyarrow."""
    rows = [row for row in _fields(file, lines, delimiter) if row]
    for number, row in enumerate(rows, start=1):
        if len(row) != len(header):
            raise InputError(
                file, "", f"{len(row)} fields in row {number}", f"{len(header)}, as in the header"
            )
    columns: dict[str, npt.NDArray[Any]] = {}
    for name, texts in zip(header, zip(*rows, strict=True), strict=False) if rows else ():
        array = np.array(texts, dtype=np.str_)
        try:
            columns[name] = array.astype(np.int64)
        except ValueError:
            try:
                columns[name] = array.astype(np.float64)
            except ValueError:
                columns[name] = array
    return columns or {name: np.empty(0) for name in header}
