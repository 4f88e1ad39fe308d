"""Recordings: measurement files read into a campaign of runs, in SI units, with what is unsound.

A campaign is one or more files, or folders of them (CSV, ``.csv.gz``, Parquet). Nothing is dropped
silently: whatever is unsound in the data becomes a `Finding`, and only rows that cannot be used
(no number for torque or angle, or a wild one) are left out, counted and reported.

A file is a table (`tables`), whose columns are quantities with units (`quantities`, `columns`).
Angles get back the turns that their encoders lost (`encoders`), each run is looked over
(`soundness`), wild values are set aside (`wild`), and the runs together are a campaign (`reading`,
`campaign`, `findings`).
"""

from lostmotion.recordings.campaign import Campaign, Run
from lostmotion.recordings.columns import parse_map
from lostmotion.recordings.findings import Finding, say_findings
from lostmotion.recordings.protocol import Protocol
from lostmotion.recordings.quantities import QUANTITIES
from lostmotion.recordings.reading import read_campaign, recording_files
from lostmotion.recordings.scale import check_scale

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
