"""Recordings: measurement files as a campaign of runs in SI units, with findings.

A campaign is one or more files, or folders of them (CSV, ``.csv.gz``, Parquet). Nothing is dropped
silently: every fault of the data is a `Finding`; only unusable rows (no number for torque or angle,
or an outlier) are left out, counted and reported.

A file is a table (`tables`), whose columns are quantities with units (`quantities`, `columns`).
Turns lost by encoders are restored (`encoders`), each run is checked (`soundness`), outliers are
set aside (`wild`), and the runs form a campaign (`reading`, `campaign`, `findings`). The modules
are loaded on first use: a drive file names the protocol of its recordings and has none.
"""

from typing import TYPE_CHECKING, Any

from lostmotion.first_use import load_name

if TYPE_CHECKING:
    from lostmotion.recordings.campaign import Campaign, Run
    from lostmotion.recordings.columns import parse_map
    from lostmotion.recordings.findings import Finding, say_findings
    from lostmotion.recordings.protocol import Protocol
    from lostmotion.recordings.quantities import QUANTITIES
    from lostmotion.recordings.reading import read_campaign, recording_files
    from lostmotion.recordings.scale import check_scale

FROM = {
    "QUANTITIES": "quantities",
    "Campaign": "reading",
    "Finding": "findings",
    "Protocol": "protocol",
    "Run": "campaign",
    "check_scale": "scale",
    "parse_map": "columns",
    "read_campaign": "reading",
    "recording_files": "reading",
    "say_findings": "findings",
}
"""Module of each name; `reading` gives `Campaign.from_table` its reader."""

__all__ = [
    "QUANTITIES",
    "Campaign",
    "Finding",
    "Protocol",
    "Run",
    "check_scale",
    "parse_map",
    "read_campaign",
    "recording_files",
    "say_findings",
]


def __getattr__(name: str) -> Any:
    """Load a name on first use."""
    return load_name(__name__, name, FROM)


def __dir__() -> list[str]:
    """Names, loaded or not."""
    return sorted({*globals(), *FROM})
