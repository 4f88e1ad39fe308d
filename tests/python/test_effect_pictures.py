"""Pictures of the effects: every effect of the library and of a user, by its own function."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import numpy as np
import pytest

from lostmotion.effects.effect import Value, effect
from lostmotion.effects.library import library
from lostmotion.report.effect_pictures import LOAD_NM, contribution_of, draw_effect
from lostmotion.units import ARCSEC


@pytest.mark.parametrize("name", sorted(library()))
def test_every_effect_of_the_library_has_a_picture_of_its_conditions(name: str) -> None:
    one = library()[name]
    data = contribution_of(one)
    conditions = {"torque_Nm", *one.needs}
    assert data.axis in conditions
    assert data.between in {"", *conditions}
    assert all(np.all(np.isfinite(curve)) and np.any(curve != 0.0) for curve in data.curves[-1:])
    drawing = ElementTree.fromstring(draw_effect(one))
    curves = [
        p for p in drawing.iter("{http://www.w3.org/2000/svg}path") if p.get("fill") == "none"
    ]
    assert len(curves) == len(data.curves)


def test_pictures_of_different_effects_differ() -> None:
    drawn = {
        name: re.sub("<title>.*?</title>", "", draw_effect(e)) for name, e in library().items()
    }
    same = {name for name in drawn if list(drawn.values()).count(drawn[name]) > 1}
    # Equal on a loop without motion of the input; their cards state what separates them.
    assert same <= {"free_play", "input_coupling_play"}


def test_the_curve_is_the_function_of_the_effect() -> None:
    drift = library()["thermal_drift"]
    data = contribution_of(drift)
    slopes = np.diff(data.curves[0]) / np.diff(data.values)
    assert slopes == pytest.approx(drift.typical[0] / ARCSEC)


def test_an_effect_of_a_user_has_a_picture() -> None:
    @effect(values=[Value("slope", "linear", 1e-6, -1.0, 1.0)], needs=["torque_Nm"])
    def own(p, at):  # type: ignore[no-untyped-def]
        return p.slope * at.torque_Nm

    data = contribution_of(own)
    assert data.axis == "torque_Nm"
    assert float(data.curves[0].max()) == pytest.approx(1e-6 * LOAD_NM / ARCSEC)
    assert "torque" in draw_effect(own)
