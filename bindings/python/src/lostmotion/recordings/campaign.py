"""Runs and campaigns: columns by quantity, in SI units."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import numpy.typing as npt

from lostmotion.arrays import BoolArray, FloatArray, IntArray
from lostmotion.errors import InputError, did_you_mean
from lostmotion.recordings.findings import Finding
from lostmotion.recordings.protocol import FREE
from lostmotion.recordings.protocol import Protocol as Locked
from lostmotion.recordings.quantities import QUANTITIES

if TYPE_CHECKING:
    from lostmotion.recordings.joining import Join


STILL_RAD = 1e-12
"""Smaller variations of the lost motion are the rounding of a constant."""

SESSIONS_MAX = 24
"""Largest number of sessions with their own friction state; each adds eight values to a fit."""

FINGERPRINT_DIGITS = 10
"""Decimals of the lost motion in rad for fingerprints, below any encoder resolution."""


@dataclass(frozen=True)
class Log:
    """A run as recorded, before repairs.

    Attributes
    ----------
    columns : dict
        Every row of the run, by quantity, in SI (temperature: C).
    kept : ndarray of int
        Rows that the run contains, in order.
    """

    columns: dict[str, FloatArray]
    kept: IntArray


@dataclass
class Run:
    """One uninterrupted recording. Columns are named by quantity, in SI (temperature: C)."""

    label: int | str
    file: str
    columns: dict[str, FloatArray]
    begins: bool = False
    """Whether a session begins here: the motion since the previous run is unknown."""
    sources: dict[str, Any] = field(default_factory=dict)
    """Column in the file, and how it was read, by quantity; empty if no file was read."""
    log: Log | None = field(default=None, repr=False, compare=False)
    """The recording itself, if the run was read from one."""

    def __len__(self) -> int:
        return int(self.columns["torque"].size)

    def __repr__(self) -> str:
        """Summarise the run."""
        return (
            f"<Run {self.label!r} of {self.file}: {len(self)} samples of {', '.join(self.columns)}>"
        )

    def leave_out(self, rows: BoolArray) -> None:
        """Remove rows from the run; the log keeps them."""
        self.columns = {name: values[~rows] for name, values in self.columns.items()}
        if self.log is not None:
            self.log = Log(self.log.columns, self.log.kept[~rows])

    def fingerprint(self) -> str:
        """SHA-256 of clock, torque and lost motion from its first sample on.

        Independent of the campaign, in which other runs may shift its zero.
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


class TableReader(Protocol):
    """Interface of the function that makes a campaign of data in memory."""

    def __call__(
        self,
        data: Any,
        *,
        ratio: float | None,
        mapping: Mapping[str, str] | None,
        protocol: Locked,
        join: Join | None,
        name: str,
    ) -> Campaign:
        """Read data."""
        ...


_TABLE_READERS: list[TableReader] = []


def set_table_reader(reader: TableReader) -> None:
    """Set the function that `Campaign.from_table` calls."""
    _TABLE_READERS[:] = [reader]


@dataclass
class Campaign:
    """All recordings of one drive that are analysed together, in order of recording."""

    runs: list[Run]
    findings: list[Finding] = field(default_factory=list)
    recorded_rows: int | None = None
    """Number of recorded rows, if the runs hold only a sample of them."""

    @classmethod
    def from_table(
        cls,
        data: Any,
        *,
        ratio: float | None = None,
        mapping: Mapping[str, str] | None = None,
        protocol: Locked = FREE,
        join: Join | None = None,
        name: str = "table",
    ) -> Campaign:
        """Make a campaign of data in memory, with the checks and findings of `read_campaign`.

        Parameters
        ----------
        data : object with columns
            A data frame of pandas or polars, a table or record batch of Arrow, a dictionary of
            arrays or lists, a structured array, or an object with the Arrow stream interface. The
            columns are named as in a file, with one row per sample; a column ``run`` numbers the
            recordings. They have equal lengths; None, NaN and NA are missing values; columns of
            date and time are time stamps.
        ratio, mapping, protocol, join
            As of `read_campaign`.
        name : str, optional
            Name of the data in messages and findings; also the label of the run if there is no such
            column.

        Returns
        -------
        Campaign

        Raises
        ------
        InputError
            Names the data, column, what was found and what was expected.

        Examples
        --------
        >>> from lostmotion.recordings import Campaign
        >>> angle_rad = [0, 1e-4, 2e-4]
        >>> table = {"time_s": [0, 1, 2], "torque_Nm": [0, 5, 9], "lost_motion_rad": angle_rad}
        >>> Campaign.from_table(table, name="bench")
        <Campaign: 3 samples in 1 runs, 0 findings>
        """
        (read,) = _TABLE_READERS
        return read(data, ratio=ratio, mapping=mapping, protocol=protocol, join=join, name=name)

    def __repr__(self) -> str:
        """Summarise the campaign."""
        return (
            f"<Campaign: {self.rows} samples in {len(self.runs)} runs, "
            f"{len(self.findings)} findings>"
        )

    @property
    def rows(self) -> int:
        """Number of usable samples."""
        return sum(len(run) for run in self.runs)

    @property
    def starts(self) -> IntArray:
        """Offsets of the runs in the joined columns; the last entry is the number of rows."""
        return np.concatenate(([0], np.cumsum([len(run) for run in self.runs]))).astype(np.intp)

    @property
    def largest_torque_Nm(self) -> float:
        """Largest torque in either direction."""
        return max(float(np.max(np.abs(run.torque_Nm))) for run in self.runs)

    @property
    def timed(self) -> bool:
        """Whether there is a real time: rows may have a running number instead."""
        return not any(finding.kind == "untimed" for finding in self.findings)

    def require_torque(self) -> None:
        """Refuse a campaign with constant torque.

        Raises
        ------
        InputError
            When it does.
        """
        torque = self.column("torque")
        if np.ptp(torque) == 0:
            found = f"a constant {torque[0]:.6g} Nm"
            raise InputError(self.runs[0].file, "torque_Nm", found, "a torque that varies")

    def require_variation(self) -> None:
        """Refuse a campaign with constant torque, or constant lost motion in every run.

        Raises
        ------
        InputError
            When it does.
        """
        self.require_torque()
        if all(np.ptp(run.lost_motion_rad) <= STILL_RAD for run in self.runs):
            found = f"a constant {self.runs[0].lost_motion_rad[0]:.6g} rad"
            expected = "a varying lost motion with the full resolution of its encoder"
            raise InputError(self.runs[0].file, "lost_motion_rad", found, expected)

    def quantities(self) -> tuple[str, ...]:
        """Quantities that every run has."""
        if not self.runs:
            raise InputError("campaign", "", "no runs", "one or more")
        common = set(self.runs[0].columns)
        for run in self.runs[1:]:
            common &= set(run.columns)
        return tuple(name for name in QUANTITIES if name in common)

    def column(self, name: str) -> FloatArray:
        """One quantity of all runs, joined, by its name with or without unit.

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

    def sessions(self) -> list[int]:
        """Indices of the runs at which a session begins, including the first."""
        begins = [i for i, run in enumerate(self.runs) if i == 0 or run.begins]
        return begins[:SESSIONS_MAX]

    def table(self) -> dict[str, npt.NDArray[Any]]:
        """Columns of all runs, joined, with the names of a file, for a data frame.

        ``pandas.DataFrame(campaign.table())``; quantities that some runs lack are left out.
        """
        labels = [np.full(len(run), run.label, dtype=object) for run in self.runs]
        joined = {QUANTITIES[name].column: self.column(name) for name in self.quantities()}
        return {"run": np.concatenate(labels), **joined}

    def fingerprint(self) -> str:
        """SHA-256 of the numbers used, independent of the file format."""
        digest = hashlib.sha256()
        for run in self.runs:
            digest.update(f"run {run.label}\n".encode())
            for name in sorted(run.columns):
                digest.update(f"{name} {len(run)}\n".encode())
                digest.update(np.ascontiguousarray(run.columns[name], dtype="<f8").tobytes())
        return "sha256:" + digest.hexdigest()
