"""Idealisations listed with a verdict, and the error of an uncalibrated figure."""

from __future__ import annotations

import csv

import pytest

from conftest import DATA
from lostmotion.design.textbook import textbook_drive
from lostmotion.drives import parse_drive
from lostmotion.idealisations import CATALOGUE_OVER_MODEL, idealisations
from lostmotion.model import design_model


@pytest.mark.parametrize(
    ("size", "ratio", "row"),
    [(14, 100, "80 and up"), (40, 100, "80 and up"), (20, 50, "50"), (20, 30, "30")],
)
def test_catalogue_angles_are_within_what_is_stated(size: int, ratio: int, row: str) -> None:
    with (DATA / "catalogue" / "torsional_stiffness.csv").open(encoding="utf-8") as rows:
        sheet = next(
            r for r in csv.DictReader(rows) if r["size"] == str(size) and r["ratio"] == row
        )
    t1, t2 = float(sheet["T1_Nm"]), float(sheet["T2_Nm"])
    k1, k2 = float(sheet["K1_Nm_per_rad"]), float(sheet["K2_Nm_per_rad"])
    model = design_model(parse_drive(textbook_drive(size, ratio, "cosine")[0]))
    found = model.torsion_curve([t1, t2]).total_rad
    low, high = CATALOGUE_OVER_MODEL
    assert low - 0.01 <= t1 / k1 / found[0] <= high + 0.01
    assert low - 0.01 <= (t1 / k1 + (t2 - t1) / k2) / found[1] <= high + 0.01


def test_what_the_means_over_the_face_hide_is_stated() -> None:
    """The open edge of a textbook cup carries alone."""
    document, _ = textbook_drive(20, 100, "cosine")
    said = idealisations(design_model(parse_drive(document)))
    assert any("one carries 100 % of the load" in line and "3.0 times" in line for line in said)
    document["design"].update(planar_only=True, axial_sections=1)
    said = idealisations(design_model(parse_drive(document)))
    assert any("evenly in the planar model" in line for line in said)


def test_uncalibrated_is_stated_until_a_support_is_fitted() -> None:
    document, _ = textbook_drive(20, 100, "cosine")
    said = idealisations(design_model(parse_drive(document)))
    low, high = CATALOGUE_OVER_MODEL
    assert any(f"have {low:g} to {high:g} times" in line for line in said)
    assert not any("{" in line for line in said)
    assert any("the whole face width" in line for line in said)
    document["design"]["support"] = {"ring_factor": 1.6, "foundation_N_per_mm2": 2600.0}
    document["design"].update(planar_only=True, axial_sections=1)
    said = idealisations(design_model(parse_drive(document)))
    assert not any(line.startswith("Uncalibrated") for line in said)
    assert any(line.startswith("Planar only") for line in said)
    assert any("equal under all teeth" in line for line in said)
