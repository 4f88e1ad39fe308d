"""Diagnosis of few readings: inconclusive, with a recommendation."""

from __future__ import annotations

from collections.abc import Mapping

from lostmotion.discover.advice import count_runs
from lostmotion.discover.answer import Diagnosis
from lostmotion.discover.conclusion import INCONCLUSIVE
from lostmotion.effects.effect import Effect
from lostmotion.evidence.sign_flips import runs_least
from lostmotion.fit.drive_file import SAMPLES_LEAST
from lostmotion.fit.few_readings import FewReadings
from lostmotion.rms import rms_of


def few_readings_diagnosis(few: FewReadings, effects: Mapping[str, Effect]) -> Diagnosis:
    """Return the inconclusive diagnosis of few readings."""
    base = few.base
    c = base.conditions
    error = few.error_arcsec
    why = f"not testable: {c.rows} readings determine {few.values} values but no effect in addition"
    heldout = few.heldout()
    lacking = (
        f"{c.rows} readings in {count_runs(c.runs)} determine a torsion curve and the width of "
        f"its loop, but no effect: record the torque loop as a log of {SAMPLES_LEAST} samples "
        "or more, "
        f"and repeat it in {runs_least()} runs or more that vary temperature, angle and "
        "amplitude one at a time."
    )
    return Diagnosis(
        INCONCLUSIVE,
        [],
        error,
        [
            {
                "effects": [],
                "rms_arcsec": rms_of(base.residual()),
                "rms_heldout_arcsec": rms_of(heldout),
            }
        ],
        [],
        [],
        {},
        {"share": 0.0, "depends_on": []},
        lacking,
        {
            "noise": {"within_runs_arcsec": error, "scatter": {}},
            "runs": c.runs,
            "samples": c.rows,
            "not_testable": dict.fromkeys(sorted(effects), why),
            "not_detectable": {},
            "left_over": [],
            "data_fingerprint": c.campaign.fingerprint(),
        },
        base,
        None,
        [base],
    )
