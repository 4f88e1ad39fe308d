"""The case study: where and why the model of a joint fails, and the compensation."""

from __future__ import annotations

import re
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lostmotion.compare import Comparison, compare
from lostmotion.demo.controller import (
    EMULATOR,
    Emulated,
    Scores,
    emulate,
    export_both,
    make_log,
    replay_here,
)
from lostmotion.demo.drives import OtherDrives, look_at_drives
from lostmotion.demo.inputs import copy_inputs, input_names
from lostmotion.demo.sections import (
    controller_section,
    design_section,
    overview_section,
)
from lostmotion.design import SearchResult, search
from lostmotion.discover.answer import Diagnosis
from lostmotion.discover.diagnosis import diagnose
from lostmotion.discover.fitted_model import FittedModel, fit_model
from lostmotion.drives import Drive, format_toml, read_drive
from lostmotion.errors import InputError, LostMotionError, one_line
from lostmotion.files import write_whole
from lostmotion.on_progress import OnProgress
from lostmotion.own_folder import claim, release
from lostmotion.recordings import Campaign, read_campaign
from lostmotion.report import Section, comparison_section, write_report
from lostmotion.report.discovery import diagnosis_section
from lostmotion.threads import one_thread
from lostmotion.units import ARCMIN, ARCSEC

JOINT = Path("joint")
DRIVE, RECORDING = "joint.toml", "joint.csv.gz"
SPECS = Path("specs")
SEARCHES = {"robot joint": 3000, "instrument": 2000, "ring generator": 2000}
"""Specs, and their evaluation budgets in the demonstration."""

TITLE = "Case study: diagnosing and compensating a robot joint"
LEAD = (
    "A recorded campaign of a strain-wave joint with an effect that its model does not have: where "
    "the model fails, which effect it is, the error with it added, and the exported parameters on "
    "the controller. Then three design searches, and four other drives."
)

RESULTS = ("base.toml", "fitted.toml", "params.h", "params.bin", "report.html")
"""Output files beside the inputs."""

NEXT = """next, with recordings of your own: lostmotion characterize mine.csv -o drive.toml
then: lostmotion diagnose drive.toml mine.csv, or lostmotion workbench drive.toml mine.csv"""
"""Suggested next steps after the demonstration."""

STEPS = 7
"""Number of steps of the demo for `progress`, the report included."""


@dataclass
class Demonstration:
    """Results of the demonstration.

    Attributes
    ----------
    plain, scores : Scores
        The controller over the log, with the parameters of the fitted baseline model and with the
        effect.
    emulated : Emulated or str
        Output of the emulated controller, or the reason why there is none.
    designs : dict of str to SearchResult, or str
        Result of each spec, or the reason why there is none.
    """

    drive: Drive
    comparison: Comparison
    diagnosis: Diagnosis
    model: FittedModel
    plain: Scores
    scores: Scores
    emulated: Emulated | str
    designs: dict[str, SearchResult] | str
    others: OtherDrives
    report: Path
    files: list[str] = field(default_factory=list)

    def answer(self) -> dict[str, Any]:
        """Return the answer of the command, ready for JSON."""
        emulated = self.emulated
        return {
            "schema": "lostmotion.demo/1",
            "drives": [prediction for _, prediction in self.others.drives],
            "comparison": self.others.comparison.answer(),
            "joint": {
                "comparison": self.comparison.answer(),
                "diagnosis": self.diagnosis.answer(),
                "fit": self.model.answer(),
                "controller": {
                    "runs": self.scores.labels,
                    "temperature_C": self.scores.temperature_C,
                    "uncompensated_arcsec": self.scores.before.tolist(),
                    "without_effect_arcsec": self.plain.after.tolist(),
                    "compensated_arcsec": self.scores.after.tolist(),
                    "bits_crc32": self.scores.bits,
                    "emulator": emulated if isinstance(emulated, str) else "",
                    "same_bits": None
                    if isinstance(emulated, str)
                    else emulated.bits == self.scores.bits,
                },
            },
            "designs": self.designs
            if isinstance(self.designs, str)
            else {name: without_folder(found) for name, found in self.designs.items()},
            "report": str(self.report),
        }


def demonstrate(
    folder: str | Path, command: str, progress: OnProgress | None = None
) -> Demonstration:
    """Run the demonstration and write its report.

    Parameters
    ----------
    folder : path
        Target of the report, the exported parameters and a copy of the inputs; created if it does
        not exist.
    command : str
        The command line, for the report.
    progress : callable, optional
        ``progress(done, of, step)``, see `lostmotion.on_progress`.

    Raises
    ------
    InputError
        If the folder cannot be created or written to.
    """
    folder = Path(folder)
    claim(folder, [*input_names(), *RESULTS])
    try:
        copy_inputs(folder)
    except OSError as error:
        raise InputError(folder, "", error.strerror or "an error", "a folder to write to") from None
    done = -1

    def step(now: str) -> None:
        nonlocal done
        done += 1
        if progress is not None:
            progress(done, STEPS, now)

    step("reading the recordings")
    drive = read_drive(folder / JOINT / DRIVE)
    recording = folder / JOINT / RECORDING
    campaign = read_campaign([recording], ratio=drive.ratio, mapping=drive.columns)
    step("comparing")
    with one_thread():
        result = compare(drive, campaign)
        step("diagnosing")
        found = diagnose(drive, campaign)
    step("running the controller")
    model, plain, scores, emulated = to_the_controller(folder, drive, campaign, found.effects)
    step("searching designs")
    designs = search_designs(folder)
    step("measured drives")
    others = look_at_drives(folder)
    step("writing the report")
    sections: list[Section] = [
        overview_section(drive, found, plain, scores, designs),
        comparison_section(drive, result, [recording]),
        diagnosis_section(drive, found, [recording]),
        controller_section(drive, plain, scores, emulated),
        design_section(designs),
        *others.sections,
    ]
    report = folder / "report.html"
    write_report(report, TITLE, LEAD, sections, command)
    release(folder)
    step("")
    return Demonstration(
        drive, result, found, model, plain, scores, emulated, designs, others, report
    )


def to_the_controller(
    folder: Path, drive: Drive, campaign: Campaign, effects: list[str]
) -> tuple[FittedModel, Scores, Scores, Emulated | str]:
    """Fit without and with the effects, export both, and run both on the controller."""
    log = make_log(campaign)
    models = {}
    with one_thread():
        for name, added in (("base", []), ("fitted", effects)):
            models[name] = fit_model(drive, campaign, add=added)
            write_whole(folder / f"{name}.toml", format_toml(models[name].document(drive)))
    header = folder / "params.h"
    with tempfile.TemporaryDirectory(prefix="lostmotion-") as place:
        without = Path(place) / "base.h"
        export_both(folder / "base.toml", without)
        plain = replay_here(without.with_suffix(".bin"), log)
        export_both(folder / "fitted.toml", header)
        scores = replay_here(header.with_suffix(".bin"), log)
        emulated = emulate(header, log, Path(place))
    return models["fitted"], plain, scores, emulated


def search_designs(folder: Path) -> dict[str, SearchResult] | str:
    """Search each spec with a small budget; returns the reason if the package has no search."""
    found = {}
    try:
        with tempfile.TemporaryDirectory(prefix="lostmotion-") as place:
            for name, evaluations in SEARCHES.items():
                spec = folder / SPECS / f"{name.replace(' ', '_')}.toml"
                short = Path(place) / spec.name
                text = re.sub(
                    r"(?m)^evaluations = \d+",
                    f"evaluations = {evaluations}",
                    spec.read_text(encoding="utf-8"),
                )
                short.write_text(text, encoding="utf-8")
                found[name] = search(short, short.with_suffix(""))
    except InputError:
        raise
    except LostMotionError as error:
        return one_line(str(error))
    return found


def without_folder(found: SearchResult) -> dict[str, Any]:
    """Answer of a search without its temporary folder."""
    return {key: value for key, value in found.answer().items() if key != "folder"}


def show_demonstration(found: Demonstration) -> None:
    """Print a summary in a few lines, then one line per drive."""
    answer = found.comparison.answer()
    print(f"1 recorded   {answer['samples']} samples in {len(answer['by_run'])} runs")
    if answer["where_it_fails"]:
        names = [one["covariate"].replace("_", " ") for one in answer["where_it_fails"][:2]]
        print(
            f"2 residual   {answer['rms_arcsec']:.1f} arcsec rms, correlates with "
            + " and ".join(names)
        )
    effects = " and ".join(found.diagnosis.effects) or "nothing"
    print(f"3 missing    {effects} ({found.diagnosis.verdict})")
    steps = ", ".join(
        f"{' + '.join(['baseline', *rung['effects']])} {rung['rms_arcsec']:.2f}"
        for rung in found.model.ladder
    )
    print(f"4 added      {steps}, noise floor {found.model.noise_floor_arcsec:.2f} arcsec")
    where = "replayed on this machine: " + found.emulated if isinstance(found.emulated, str) else ""
    if not isinstance(found.emulated, str):
        same = "the same bits as here" if found.emulated.bits == found.scores.bits else "OTHER BITS"
        where = f"on an emulated Cortex-M4F ({EMULATOR}), {same}"
    print(f"5 controller {where}; error of the output, arcsec rms:")
    print(f"             at     uncompensated  baseline model  with {effects}")
    rows = zip(
        found.scores.temperature_C,
        found.scores.before,
        found.plain.after,
        found.scores.after,
        strict=True,
    )
    for temperature, before, plain, after in rows:
        print(
            f"             {temperature:.0f} °C  {before:13.1f}  {plain:14.1f}  "
            f"{after:{5 + len(effects)}.1f}"
        )
    if isinstance(found.designs, str):
        print(f"6 designs    none: {found.designs}")
    else:
        lead = "6 designs   "
        for name, one in found.designs.items():
            best = one.front[0]["figures"]["tolerance_lost_motion"]
            print(
                f"{lead} {name}: lost motion {one.start['tolerance_lost_motion']:.2f} to "
                f"{best:.2f} arcmin, {len(one.front)} on the front"
            )
            lead = " " * len(lead)
    print("")
    show_drives(found.others)
    print(f"report with pictures: {found.report}; beside it drive files, recordings, parameters")
    print(NEXT)


def show_drives(others: OtherDrives) -> None:
    """Print a line for each of the other drives."""
    width = max(len(drive.name) for drive, _ in others.drives)
    print(
        f"{'arcmin':{width}}  reversal lost motion  deflection at   smallest side  checks\n"
        f"{'':{width}}  at 4 % rated torque   rated torque    clearance      passed"
    )
    for (drive, answer), gap in zip(others.drives, others.smallest_gap_arcmin, strict=True):
        checks = [c for c in answer.get("checks", []) if c["name"] != "free_assembly"]
        passed = sum(c["margin"] >= 0 for c in checks)
        print(
            f"{drive.name:{width}}  {answer['reversal_lost_motion_arcmin']:<20.3f}  "
            f"{answer['total_arcmin'][-1]:<14.3f}  "
            + (f"{gap:<13.4f}  {passed} of {len(checks)}" if gap is not None else "-")
        )
    compared = others.comparison.answer()
    scale = ARCSEC / ARCMIN
    print(
        f"recorded on a real drive, {others.measured.name}: {compared['samples']} samples in "
        f"{len(compared['by_run'])} runs; rms in arcmin: data-sheet model "
        f"{compared['unfitted_rms_arcsec'] * scale:.1f}, fitted "
        f"{compared['rms_arcsec'] * scale:.1f}, "
        f"leave-one-run-out {compared['heldout_rms_arcsec'] * scale:.1f}"
    )
