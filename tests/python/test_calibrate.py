"""Support constants from a data sheet or a fit, and their use in searches."""

from __future__ import annotations

import copy
import csv
import functools
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from small_search import SMALL

from conftest import DATA
from lostmotion.calibrate import calibrate
from lostmotion.cli import main
from lostmotion.design.spec import parse_spec
from lostmotion.design.textbook import textbook_drive
from lostmotion.drives import Drive, format_toml, parse_drive
from lostmotion.errors import InputError
from lostmotion.idealisations import idealisations
from lostmotion.model import design_model


@functools.cache
def drawing(ratio: int = 100) -> Drive:
    return parse_drive(textbook_drive(14, ratio, "cosine")[0])


def double_arcs() -> Drive:
    document = copy.deepcopy(drawing().document)
    document["design"]["teeth"] |= {
        "flexspline_flank": "double_arc",
        "rigid_flank": "conjugate",
        "flexspline_shift": 2.5,
        "rigid_shift": 0.0,
        "rack_addendum": 0.6,
        "root_clearance": 0.15,
        "tooth_height": 1.4,
        "engagement_depth": 0.9,
    }
    arcs = {"rho_a": 1.37, "l_a": 0.664, "X_a": 0.31, "rho_f": 1.57, "l_f": 0.66, "X_f": 0.268}
    document["design"]["flank"] = arcs
    return parse_drive(document)


def sheet(ratio: float = 100.0) -> Drive:
    with (DATA / "catalogue" / "torsional_stiffness.csv").open(encoding="utf-8") as rows:
        row = next(r for r in csv.DictReader(rows) if r["size"] == "14" and r["ratio"] != "50")
    names = ("T1_Nm", "T2_Nm", "K1_Nm_per_rad", "K2_Nm_per_rad", "K3_Nm_per_rad")
    return parse_drive(
        {
            "drive": {"name": "sheet", "ratio": ratio, "rated_torque_Nm": 7.8},
            "catalogue": {name: float(row[name]) for name in names},
        }
    )


def fitted(angle: dict[str, float]) -> Drive:
    return parse_drive(
        {
            "drive": {"name": "fitted", "ratio": 100.0, "rated_torque_Nm": 7.8},
            "catalogue": sheet().document["catalogue"],
            "fit": {"values": angle},
        }
    )


@pytest.mark.parametrize("drawn", [drawing, double_arcs])
def test_a_curve_of_the_model_gives_back_its_own_constant(drawn: Callable[[], Drive]) -> None:
    true = copy.deepcopy(drawn().document)
    true["design"]["support"] = {"ring_factor": 3.0}
    torque = np.array([2.0, 4.0, 6.0, drawing().rated_torque_Nm * 1.01])
    model = design_model(parse_drive(true))
    angle = np.concatenate(([0.0], model.torsion_curve(torque).total_rad))
    slopes = np.diff(angle) / np.diff(np.concatenate(([0.0], torque)))
    values = {f"knot_{i + 1}_Nm": t for i, t in enumerate(torque[:-1])}
    values |= {f"slope_{i + 1}_rad_per_Nm": s for i, s in enumerate(slopes)}
    source = fitted(values)
    source = Drive(**{**source.__dict__, "catalogue": None})
    (one,) = calibrate(drawn(), source).constants
    assert one.identified
    assert one.value == pytest.approx(3.0, rel=0.1)  # the curve is straight between its knots
    assert one.low < 3.0 < one.high


def test_a_sheet_is_met_and_no_longer_called_uncalibrated() -> None:
    found = calibrate(drawing(), sheet())
    (one,) = found.constants
    assert one.identified
    assert one.low < one.value < one.high
    assert found.misfit_percent(found.after_rad) < 4 < 20 < found.misfit_percent(found.before_rad)
    said = idealisations(design_model(found.drive))
    assert not any(line.startswith("Uncalibrated") for line in said)


def test_another_drive_and_more_constants_than_slopes_are_refused() -> None:
    with pytest.raises(InputError, match="the ratio of the drawing"):
        calibrate(drawing(), sheet(80.0))
    names = ("ring_factor", "tooth_compliance_mm_per_N", "foundation_N_per_mm2")
    with pytest.raises(InputError, match="slopes below the rated torque"):
        calibrate(drawing(), sheet(), names)
    with pytest.raises(InputError, match=r"neither \[catalogue\] nor a fitted"):
        calibrate(drawing(), drawing())
    with pytest.raises(InputError, match="the drawing"):
        calibrate(sheet(), sheet())


def test_the_command_writes_a_drawing_that_a_search_takes_along(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = {name: tmp_path / f"{name}.toml" for name in ("drawing", "sheet", "calibrated")}
    files["drawing"].write_text(format_toml(drawing().document))
    files["sheet"].write_text(format_toml(sheet().document))
    words = [
        "calibrate",
        str(files["drawing"]),
        str(files["sheet"]),
        "-o",
        str(files["calibrated"]),
    ]
    assert main([*words, "--json", "-"]) == 0
    answer = json.loads(capsys.readouterr().out)
    factor = answer["constants"][0]["value"]
    assert files["calibrated"].read_text().startswith("# Calibrated to sheet up to")
    assert main(words) == 2  # the file exists
    assert main([*words[:-1], str(tmp_path / "other.toml"), "--constants", "ring_facto"]) == 2
    assert "ring_factor" in capsys.readouterr().err
    assert not (tmp_path / "other.toml").exists()
    spec = copy.deepcopy(SMALL)
    spec["search"]["calibrated_from"] = "calibrated.toml"
    text = parse_spec(spec, str(tmp_path / "spec.toml")).text
    line = next(line for line in text.splitlines() if "support.ring_factor" in line)
    assert line.split()[0] == "fixed"
    assert float(line.split()[-1]) == pytest.approx(factor)
    spec["search"]["fixed"]["support.ring_factor"] = 2.0  # a value stated in the spec is kept
    assert "fixed support.ring_factor 2" in parse_spec(spec, str(tmp_path / "spec.toml")).text
    spec["search"]["calibrated_from"] = "drawing.toml"
    with pytest.raises(InputError, match="without calibrated constants"):
        parse_spec(spec, str(tmp_path / "spec.toml"))
