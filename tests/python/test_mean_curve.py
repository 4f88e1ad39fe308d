"""The mean curve of the lost motion over the torque."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from lostmotion.recordings.campaign import Run
from lostmotion.recordings.mean_curve import MeanCurve

COMPLIANCE_RAD_PER_NM = 2e-5


@pytest.mark.parametrize(("unit", "slope"), [(1.0, COMPLIANCE_RAD_PER_NM), (1e-300, 0.0)])
def test_torques_whose_products_underflow_have_no_slope(unit, slope):
    torque = unit * 10.0 * np.sin(np.linspace(0.0, 20.0, 2000))
    lost = COMPLIANCE_RAD_PER_NM * torque / unit
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        curve = MeanCurve([Run(1, "x.csv", {"torque": torque, "lost_motion": lost})])
        found = curve.slope(torque[:5])
    assert found == pytest.approx(slope, rel=0.05)
