"""The demonstration: four drives, from a catalogue, from drawings and from measurements."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

import numpy as np

import lostmotion
from lostmotion.compare import Comparison, compare
from lostmotion.drives import Drive, read_drive
from lostmotion.errors import InputError
from lostmotion.files import write_whole
from lostmotion.model import design_model, make_backbone
from lostmotion.predict import predict
from lostmotion.recordings import read_campaign
from lostmotion.report import comparison_section, drive_section, write_report
from lostmotion.units import ARCMIN, ARCSEC

INPUTS = "demo_inputs"
"""Folder of the package that holds what the demonstration reads."""

DRIVES = ("size_25.toml", "reference_a.toml", "external_ring.toml")
MEASURED = Path("cycloidal_locked_output")
RECORDING = "base_onyx_runin5.csv"

TITLE = "Lost motion of four drives"
LEAD = (
    "A strain-wave gear as its maker's catalogue describes it, two given by their drawings (wave "
    "generator inside and outside), and measured loops of a cycloidal reducer against the model."
)


@dataclass
class Demonstration:
    """What the demonstration found.

    Attributes
    ----------
    drives : list of (Drive, dict)
        Each with its prediction at the rated torque.
    smallest_gap_arcmin : list of float or None
        One a drive; a bought one has none.
    """

    drives: list[tuple[Drive, dict[str, Any]]]
    smallest_gap_arcmin: list[float | None]
    measured: Drive
    comparison: Comparison
    report: Path

    def answer(self) -> dict[str, Any]:
        """Return the answer of the command, ready for JSON."""
        return {
            "schema": "lostmotion.demo/1",
            "drives": [prediction for _, prediction in self.drives],
            "comparison": self.comparison.answer(),
            "report": str(self.report),
        }


def find_inputs() -> Path:
    """Find the folder with the inputs in the installed package.

    Raises
    ------
    InputError
        When the package was installed without it.
    """
    for place in lostmotion.__path__:
        if (Path(place) / INPUTS).is_dir():
            return Path(place) / INPUTS
    raise InputError("lostmotion", INPUTS, "no such folder", "a complete installation")


def copy_inputs(folder: Path) -> None:
    """Copy the inputs to where the reader can look at them and change them."""
    source = find_inputs()
    for file in sorted(source.rglob("*")):
        if file.is_file():
            target = folder / file.relative_to(source)
            target.parent.mkdir(parents=True, exist_ok=True)
            write_whole(target, file.read_bytes())


def demonstrate(
    folder: str | Path, command: str, progress: Callable[[int, int], None] | None = None
) -> Demonstration:
    """Run the demonstration and write its report.

    Parameters
    ----------
    folder : path
        Where the report and a copy of the inputs go; made when it does not exist.
    command : str
        The command line, for the report.
    progress : callable, optional
        Called with steps done and steps in all.

    Raises
    ------
    InputError
        When the folder cannot be made or written to.
    """
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        copy_inputs(folder)
    except OSError as error:
        raise InputError(folder, "", error.strerror or "an error", "a folder to write to") from None
    steps = len(DRIVES) + 2
    done = 0

    def step() -> None:
        nonlocal done
        done += 1
        if progress is not None:
            progress(done, steps)

    drives, gaps, sections = [], [], []
    for name in DRIVES:
        drive = read_drive(folder / "drives" / name)
        rated = drive.rated_torque_Nm
        drives.append((drive, predict(drive, np.array([-rated, 0.0, rated]))))
        gaps.append(smallest_gap(drive))
        sections.append(drive_section(drive))
        step()
    measured = read_drive(folder / MEASURED / "drive.toml")
    recording = folder / MEASURED / RECORDING
    campaign = read_campaign([recording], ratio=measured.ratio, mapping=measured.columns)
    largest = float(np.max(np.abs(campaign.column("torque"))))
    result = compare(make_backbone(measured, largest), campaign)
    sections.append(comparison_section(measured, result, [recording]))
    step()
    report = folder / "report.html"
    write_report(report, TITLE, LEAD, sections, command)
    step()
    return Demonstration(drives, gaps, measured, result, report)


def smallest_gap(drive: Drive) -> float | None:
    """Smallest side clearance of a design over all angles and phases, in arcmin."""
    if drive.design is None:
        return None
    checks = {check.name: check.value for check in design_model(drive).checks()}
    return checks["smallest_gap"] / ARCMIN


def show_demonstration(found: Demonstration, out: TextIO) -> None:
    """Print the result in a dozen lines."""
    names = [drive.name for drive, _ in found.drives]
    width = max(len(name) for name in names)
    print(
        f"{'arcmin':{width}}  reversal lost motion  deflection at   smallest side  checks\n"
        f"{'':{width}}  at 4 % rated torque   rated torque    clearance      passed",
        file=out,
    )
    for (drive, answer), gap in zip(found.drives, found.smallest_gap_arcmin, strict=True):
        checks = [c for c in answer.get("checks", []) if c["name"] != "free_assembly"]
        passed = sum(c["margin"] >= 0 for c in checks)
        print(
            f"{drive.name:{width}}  {answer['reversal_lost_motion_arcmin']:<20.3f}  "
            f"{answer['total_arcmin'][-1]:<14.3f}  "
            + (f"{gap:<13.4f}  {passed} of {len(checks)}" if gap is not None else "-"),
            file=out,
        )
    answer = found.comparison.answer()
    scale = ARCSEC / ARCMIN
    print(
        f"\n{found.measured.name}: {answer['samples']} samples in {len(answer['by_run'])} runs\n"
        f"  rms in arcmin: as it stands {answer['unfitted_rms_arcsec'] * scale:.1f}, fitted "
        f"{answer['rms_arcsec'] * scale:.1f}, held out {answer['heldout_rms_arcsec'] * scale:.1f}, "
        f"noise floor {answer['noise_floor_arcsec'] * scale:.1f}",
        file=out,
    )
    if answer["where_it_fails"]:
        worst = answer["where_it_fails"][0]
        print(
            f"  what is left hangs most on {worst['covariate'].replace('_', ' ')}: "
            f"{100 * worst['share']:.1f} % of it, p = {worst['p']:.3f}",
            file=out,
        )
    print(f"\nreport with pictures: {found.report}", file=out)
    print(f"the drive files and recordings are beside it: {found.report.parent}", file=out)
