"""Figures and tables of a characterization: loops, mean curve, standard figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from lostmotion.catalogue import Catalogue
from lostmotion.characterize import Characterization, StandardFigures
from lostmotion.characterize.characterization import sheet_figures
from lostmotion.characterize.printed import NAMES, cells, flat
from lostmotion.report.charts import Chart
from lostmotion.report.page import Notes, PageTable, Section
from lostmotion.report.sources import file_fingerprint
from lostmotion.report.wording import written
from lostmotion.units import ARCMIN, plain_number


def characterization_section(result: Characterization, files: Sequence[str | Path]) -> Section:
    """Describe the results from recordings alone."""
    answer = result.answer()
    samples = result.figures.samples
    facts = [
        ("loops, runs", f"{samples.loops}, {samples.runs}"),
        ("torque range", f"{written(samples.low_Nm)} to {written(samples.high_Nm)} N·m"),
        ("rated torque", f"{written(result.rated_torque_Nm)} N·m ({result.rated_torque_from})"),
    ]
    if samples.rate_Nm_per_s is not None:
        facts.append(("loading rate", f"{plain_number(samples.rate_Nm_per_s)} N·m/s"))
    if result.ratio is not None:
        facts.append(("ratio", f"{result.ratio:.6g} ({result.ratio_from})"))
    sheet = None if result.drive is None else result.drive.catalogue
    blocks: list[Notes | PageTable | Chart] = []
    if answer["findings"]:
        blocks.append(Notes("About the data", answer["findings"]))
    if result.figures.fit is not None:
        blocks.append(curve_figure(result))
    blocks.append(figures_table({"measured": result.figures}, sheet, result.rated_torque_Nm))
    blocks.append(Notes("Assumptions", result.assumptions()))
    sources = [(f"recording {path}", file_fingerprint(path)) for path in files]
    if result.drive is not None:
        drive = result.drive.file
        sources.insert(0, (f"drive file {drive}", file_fingerprint(drive)))
    sources.append(("numbers of the recordings as they are used", answer["data_fingerprint"]))
    return Section(
        f"{result.name}: from recordings alone",
        "The mean curve of the torque loops as up to three straight lines, lost motion and "
        "hysteresis loss by the definitions of catalogues.",
        facts,
        list(blocks),
        sources,
    )


def figures_table(
    kinds: Mapping[str, StandardFigures], sheet: Catalogue | None, rated_torque_Nm: float
) -> PageTable:
    """Table of standard figures, of one or several kinds of loops."""
    answers = {name: flat(found.answer()) for name, found in kinds.items()}
    stated = {} if sheet is None else sheet_figures(sheet, rated_torque_Nm)
    rows = []
    reasons: dict[str, None] = {}
    for key, name in NAMES.items():
        row = [name]
        for answer in answers.values():
            value, error, _ = cells(answer[key])
            row += [value, error]
            if answer[key]["value"] is None:
                reasons[f"{name.partition(',')[0]}: {answer[key]['reason']}"] = None
        if stated:
            known = stated.get(key)
            row.append("-" if known is None else plain_number(known, 4))
        rows.append(tuple(row))
    head = ["figure"]
    for name in answers:
        head += [name, "standard error"]
    head += ["sheet"] if stated else []
    caption = (
        f"Lost motion between the middles of the loop at plus and minus 3 and 4 % of the rated "
        f"torque of {written(rated_torque_Nm)} N·m; hysteresis loss at zero torque."
    )
    missing = "; ".join(reasons)
    return PageTable(
        "Standard figures",
        head,
        rows,
        tuple(range(1, len(head))),
        f"{caption} Not given: {missing}." if missing else caption,
    )


def curve_figure(result: Characterization) -> Chart:
    """Make the figure of the loops with their mean curve."""
    samples = result.figures.samples
    return Chart(
        "loops",
        f"Torque loops of {result.name} and their mean curve",
        "Samples of the loops averaged in torque bins (grey), each loop about its own middle, "
        "and the mean curve as straight lines (orange).",
        lambda: [result.plot()],
        {
            "loop": [int(loop) for loop in samples.loop],
            "torque_Nm": samples.torque_Nm,
            "angle_arcmin": result.loop_angles_rad() / ARCMIN,
        },
    )
