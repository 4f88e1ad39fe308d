"""Reports: one HTML file with figures, their data, and the command that made it.

The file needs no network: drawings to scale are SVG, charts are Plotly figures, and the page
contains Plotly. Data are CSV links in the page. The sections are loaded on first use.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lostmotion.files import write_whole
from lostmotion.first_use import load_name
from lostmotion.report.page import Section, render

if TYPE_CHECKING:
    from lostmotion.report.characterization import characterization_section
    from lostmotion.report.comparison import comparison_section
    from lostmotion.report.discovery import diagnosis_section, fit_section
    from lostmotion.report.drive import drive_section

FROM = {
    "characterization_section": "characterization",
    "comparison_section": "comparison",
    "diagnosis_section": "discovery",
    "drive_section": "drive",
    "fit_section": "discovery",
}
"""Module of each section."""

__all__ = [
    "Section",
    "characterization_section",
    "comparison_section",
    "diagnosis_section",
    "drive_section",
    "fit_section",
    "write_report",
]


def __getattr__(name: str) -> Any:
    """Load a section on first use."""
    return load_name(__name__, name, FROM)


def write_report(
    file: str | Path, title: str, lead: str, sections: Sequence[Section], command: str
) -> None:
    """Write a report atomically.

    Parameters
    ----------
    file : path
    title, lead : str
        Heading of the page and the sentence beneath it.
    sections : sequence of Section
        From `drive_section`, `characterization_section`, `comparison_section`,
        `diagnosis_section` or `fit_section`.
    command : str
        The command line that made it.

    Raises
    ------
    InputError
        When the file cannot be written.
    """
    write_whole(file, render(title, lead, sections, command))
