"""Findings: faults of recordings, and the sentences that report them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

UNUSED = "not used"
"""Action for a column with an unknown name."""

DOUBT_CHANCE = 1e-3
"""Probability that the noise or scatter of a sound run puts it in doubt. It may stop the work, so
that a campaign of a hundred runs is to be stopped at most once in ten."""

DOUBTFUL = ("ratio", "scale", "sign", "stuck", "jump", "repeats", "lag")
"""Kinds that make results doubtful."""

COLUMNS_LISTED = 50
"""Largest number of unused columns that are listed."""

RUNS_LISTED = 8
"""Largest number of runs that are listed."""

MOMENTS_LISTED = 3
"""Largest number of times of one run that are listed."""


@dataclass(frozen=True)
class Finding:
    """A fault or an assumption about the data.

    Attributes
    ----------
    kind : str
        ``nan``, ``duplicate_time``, ``backward_time``, ``stuck``, ``wrap``, ``jump``,
        ``gap``, ``split_run``, ``wild``, ``sign``, ``scale``, ``ratio``,
        ``ignored_column``, ``missing``, ``sampled``, ``repeats``, ``lag``, ``locked``,
        ``motor_torque``, ``untimed``, ``joined``, ``outside``, ``clock``, ``delay``,
        ``set_aside``, ``text``, ``range``, ``label``, ``runs``, ``thousands``.
    file, column : str
        Location.
    run : int or str or None
        The run, where the finding belongs to one.
    count : int
        Number of rows or steps.
    action : str
        What was done with the data.
    seconds : tuple of float
        Times, if the finding is about single samples.
    """

    kind: str
    file: str
    column: str
    run: int | str | None
    count: int
    action: str
    seconds: tuple[float, ...] = ()

    def __str__(self) -> str:
        """Return the finding as one sentence."""
        place = f"{self.file}: {self.column}"
        if self.run is not None:
            place += f" (run {self.run}{self.moments})"
        return f"{place}: {self.kind.replace('_', ' ')} x {self.count}: {self.action}"

    @property
    def moments(self) -> str:
        """List the first few times."""
        if not self.seconds:
            return ""
        shown = ", ".join(f"{t:.6g}" for t in self.seconds[:MOMENTS_LISTED])
        more = len(self.seconds) - MOMENTS_LISTED
        return f" at {shown} s" + (f" and {more} more" if more > 0 else "")


def say_findings(findings: Iterable[Finding]) -> list[str]:
    """Summarise findings in few sentences, doubtful values first."""
    groups: dict[tuple[str, str, str], list[Finding]] = {}
    for finding in findings:
        column = "" if finding.action == UNUSED else finding.column
        groups.setdefault((finding.kind, column, finding.action), []).append(finding)
    ordered = sorted(groups.values(), key=lambda group: group[0].kind not in DOUBTFUL)
    return [_told(group) for group in ordered]


def _told(group: Sequence[Finding]) -> str:
    """Summarise findings of one kind, in one column or for unused columns."""
    first = group[0]
    if len(group) == 1:
        return str(first)
    files = list(dict.fromkeys(finding.file for finding in group))
    place = files[0]
    if len(files) > 1:
        place += f" and {len(files) - 1} more file{'s' if len(files) > 2 else ''}"
    if first.action == UNUSED:
        columns = list(dict.fromkeys(finding.column for finding in group))
        more = f" and {len(columns) - COLUMNS_LISTED} more" if len(columns) > COLUMNS_LISTED else ""
        return f"{place}: {UNUSED}: the columns {', '.join(columns[:COLUMNS_LISTED])}{more}"
    labels = [f"{finding.run}{finding.moments}" for finding in group if finding.run is not None]
    runs = ""
    if len(labels) > RUNS_LISTED and len(files) > 1:
        runs = f" ({len(labels)} runs)"
    elif len(labels) > RUNS_LISTED:
        runs = f" ({len(labels)} runs, {labels[0]} to {labels[-1]})"
    elif labels:
        runs = f" (runs {', '.join(labels)})"
    count = sum(finding.count for finding in group)
    kind = first.kind.replace("_", " ")
    return f"{place}: {first.column}{runs}: {kind} x {count}: {first.action}"
