"""Whether the merged evidence of two halves of a campaign has the verdict of the whole.

    cd tests
    python benchmarks/bench_merge.py [COUNT]

Campaigns of the own rig, COUNT of them (40): each tenth is clean, the others hide an effect that
the standard plan shows. The first half of the runs is one campaign and the second another, which
begins with friction in an unknown state: some effects appear in only one of them.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

TESTS = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(TESTS))

from rig.campaign import make_campaign  # noqa: E402
from rig.suites import SINGLES  # noqa: E402

from lostmotion.discover import diagnose  # noqa: E402
from lostmotion.discover.common_columns import gather_body  # noqa: E402
from lostmotion.discover.diagnosis import Diagnosis  # noqa: E402
from lostmotion.discover.merged_verdict import judge_body  # noqa: E402
from lostmotion.drives import Drive, read_drive  # noqa: E402
from lostmotion.effects.library import library  # noqa: E402
from lostmotion.evidence.merging import merge_bodies  # noqa: E402
from lostmotion.recordings import Campaign, read_campaign  # noqa: E402

FIRST_SEED, DRIVES = 960, 8

SIZE = 0.7
"""Size of a hidden effect relative to the noise."""

CLEAN_EVERY = 10


def written(number: int, folder: Path) -> tuple[str, Drive, Campaign]:
    """Make a campaign, and read it as the commands do."""
    hidden = {} if number % CLEAN_EVERY == 0 else {SINGLES[number % len(SINGLES)]: SIZE}
    make_campaign(FIRST_SEED + number, number % DRIVES, hidden, "standard").write(
        folder, str(number), None
    )
    drive = read_drive(folder / f"{number}.toml")
    data = read_campaign([folder / f"{number}.csv.gz"], ratio=drive.ratio)
    return " ".join(hidden) or "nothing", drive, data


def merged(drive: Drive, data: Campaign) -> dict[str, Any]:
    """Diagnose the evidence of both halves."""
    middle = len(data.runs) // 2
    halves = [Campaign(list(runs)) for runs in (data.runs[:middle], data.runs[middle:])]
    bodies = [gather_body(diagnose(drive, half), library(), drive.ratio) for half in halves]
    return judge_body(merge_bodies(bodies, ["one", "other"]), library())


def line(hidden: str, whole: Diagnosis, parts: dict[str, Any]) -> tuple[bool, str]:
    """Return both verdicts."""
    one, other = (whole.verdict, whole.effects), (parts["verdict"], parts["effects"])
    same = one[0] == other[0] and set(one[1]) == set(other[1])
    says = [f"{verdict} {', '.join(effects)}".strip() for verdict, effects in (one, other)]
    return same, f"{hidden:26s} {'same' if same else 'OTHER':5s} {says[0]:40s} | {says[1]}"


def main(words: list[str]) -> None:
    """Print a line for each campaign, and how many verdicts are the same."""
    count = int(words[0]) if words else 40
    alike = 0
    with tempfile.TemporaryDirectory() as folder:
        for number in range(count):
            hidden, drive, data = written(number, Path(folder))
            same, said = line(hidden, diagnose(drive, data), merged(drive, data))
            alike += same
            print(said, flush=True)
    print(f"{alike} of {count}: the verdict of the whole")


if __name__ == "__main__":
    main(sys.argv[1:])
