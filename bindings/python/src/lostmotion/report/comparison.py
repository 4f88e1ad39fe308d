"""Report section of a comparison: measured against the model."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lostmotion.compare import REPEATABILITY, Comparison
from lostmotion.discover.advice import count_runs
from lostmotion.drives import Drive
from lostmotion.friction import WORDS
from lostmotion.report.characterization import figures_table
from lostmotion.report.charts import plots_of
from lostmotion.report.loops import error_unit, failures_figure, loops_figure
from lostmotion.report.page import Notes, PageTable, Section
from lostmotion.report.residual_grids import grids_figure
from lostmotion.report.sources import sources_of
from lostmotion.report.wording import (
    CROSS_VALIDATED,
    explained_text,
    grouped,
    with_zeros,
    words,
    written,
)
from lostmotion.units import ARCMIN, ARCSEC

NOTHING = 1e-9
"""Fitted values below this are displayed as zero."""


def comparison_section(drive: Drive, result: Comparison, files: Sequence[str | Path]) -> Section:
    """Describe how well the model of a drive fits recordings, and where it fails."""
    answer = result.answer()
    unit, unit_name = error_unit(result)
    left_out = CROSS_VALIDATED[answer["heldout_by"]]

    def shown(arcsec: float) -> str:
        return f"{with_zeros(arcsec * ARCSEC / unit)} {unit_name}"

    facts = [
        ("error of the data-sheet model, rms", shown(answer["unfitted_rms_arcsec"])),
        ("fitted, rms", shown(answer["rms_arcsec"])),
        (f"{left_out}, rms", shown(answer["heldout_rms_arcsec"])),
        (REPEATABILITY, shown(answer["noise_floor_arcsec"])),
        ("share of the variance explained", explained_text(answer)),
        ("friction", WORDS[answer["friction"]]),
    ]
    runs = len(answer["by_run"])
    section = Section(
        f"{drive.name}: measured against the model",
        f"{grouped(str(answer['samples']))} samples in {count_runs(runs)}. A torsion curve of "
        "free form, started from that of the drive file, and hysteretic friction, fitted to "
        "the recordings.",
        facts,
        [],
        sources_of(drive, files, answer["data_fingerprint"]),
    )
    # Before the figures, because a column with the wrong sign explains all that they show.
    if answer["findings"]:
        section.blocks.append(Notes("About the data", answer["findings"]))
    section.blocks.append(loops_figure(result, drive.name))
    section.blocks.append(
        PageTable(
            "Error by run",
            (
                "run",
                "samples",
                f"rms, {unit_name}",
                f"{left_out}, {unit_name}",
            ),
            [
                (
                    str(run["run"]),
                    str(run["samples"]),
                    f"{run['rms_arcsec'] * ARCSEC / unit:.2f}",
                    f"{run['heldout_rms_arcsec'] * ARCSEC / unit:.2f}",
                )
                for run in answer["by_run"]
            ],
            (1, 2, 3),
        )
    )
    figures = result.standard_figures
    section.blocks.append(figures_table(figures, drive.catalogue, result.rated_torque_Nm))
    if result.failures:
        section.blocks.append(failures_figure(result, drive.name))
    c = result.base.conditions
    left = [("fitted", result.residual_rad / ARCSEC)]
    section.blocks.append(
        grids_figure(c, left, answer["noise_floor_arcsec"], drive.name, REPEATABILITY)
    )
    section.blocks += plots_of(result)
    section.blocks += _fitted_tables(answer)
    if answer["not_testable"]:
        lines = [
            f"without {words(column)}: {', '.join(map(words, effects))}"
            for column, effects in answer["not_testable"].items()
        ]
        section.blocks.append(Notes("Not testable with these columns", lines))
    return section


def _fitted_tables(answer: dict[str, Any]) -> list[PageTable]:
    parameters = answer["parameters"]
    ends = [0.0, *parameters["knot_Nm"]]
    stretches = [
        (f"from {written(low)}", _small(slope / ARCMIN))
        for low, slope in zip(ends, parameters["slope_rad_per_Nm"], strict=True)
    ]
    plays = [
        (written(radius), _small(outside / ARCMIN), _small(inside))
        for radius, outside, inside in zip(
            parameters["play_radius_Nm"],
            parameters["play_outside_rad_per_Nm"],
            parameters["play_inside_share"],
            strict=True,
        )
    ]
    envelope, knee = parameters["play_envelope_Nm"], parameters["play_envelope_knee_Nm"]
    return [
        PageTable(
            f"Fitted compliance by torque, in {len(stretches)} stretches",
            ("torque, N·m", "compliance, arcmin/(N·m)"),
            stretches,
            (0, 1),
            folded=True,
        ),
        PageTable(
            "Fitted friction",
            (
                "half width of the operator, N·m",
                "in series with the spring, arcmin/(N·m)",
                "in parallel, share of the torque",
            ),
            plays,
            (0, 1, 2),
        ),
        PageTable(
            "Load-dependent hysteresis",
            (
                "gain, N·m",
                "knee torque, N·m",
                "pre-sliding share",
            ),
            [
                (
                    written(envelope),
                    written(knee),
                    _small((1 + envelope / knee) * sum(parameters["play_inside_share"])),
                )
            ],
            (0, 1, 2),
        ),
    ]


def _small(value: float) -> str:
    """Write a number; rounding noise becomes zero."""
    return written(value) if abs(value) > NOTHING else "0"
