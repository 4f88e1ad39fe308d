"""Page of the arm: the loop of a drive in the simulator, and the tracking error."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from lostmotion.drives import Drive
from lostmotion.predict import predict
from lostmotion.report import Section, write_report
from lostmotion.report.charts import Chart
from lostmotion.results import figures
from lostmotion.results.colours import BLUE, FAINT, RED, SOFT
from lostmotion.simulators.mujoco import slow_reversal
from lostmotion.units import ARCMIN

COLOURS = {"rigid": FAINT, "drives": RED, "compensated": BLUE}

TITLE = "Lost motion of a drive in MuJoCo, and the tracking error of the arm"


def write_arm_page(
    file: str | Path,
    found: Mapping[str, Mapping[str, Any]],
    drive: Drive,
    duration_s: float,
    command: str,
) -> None:
    """Write the charts as a page.

    Parameters
    ----------
    found : mapping
        From `run_arm`.
    drive : Drive
        Whose loop is shown.
    duration_s : float
        Of the path.
    command : str
        The command line that made it.
    """
    charts = Chart(
        "arm",
        TITLE,
        f"Left: lost motion of {drive.name}, simulated with a locked input, around the curve of "
        "predict. Right: tracking error of the tool.",
        lambda: [draw_loop(drive), draw_errors(found, duration_s)],
        beside=2,
    )
    write_report(file, TITLE, "", [Section("An arm in MuJoCo", "", [], [charts])], command)


def draw_loop(drive: Drive) -> Any:
    """Draw the simulated loop of a drive around the predicted curve."""
    figure = figures.framed("", "torque, N·m", "lost motion, arcmin")
    rated = drive.rated_torque_Nm
    torque, lost = slow_reversal(drive, rated)
    thin = slice(None, None, 25)
    grid = np.linspace(-rated, rated, 81)
    predicted = predict(drive, grid)["total_arcmin"]
    figures.line(figure, grid, predicted, SOFT, "predict", dash="dash")
    simulated = lost[thin] / ARCMIN
    figures.line(figure, torque[thin], simulated, COLOURS["drives"], "simulated, input locked")
    return figure


def draw_errors(found: Mapping[str, Mapping[str, Any]], duration_s: float) -> Any:
    """Draw the tracking error of the tool over time."""
    figure = figures.framed("", "time, s", "tracking error of the tool, µm")
    for variant, row in found.items():
        error = np.asarray(row["error_um"])
        time = np.linspace(0.0, duration_s, error.size)
        thin = slice(None, None, 8)
        name = f"{variant}: {row['tracking_rms_um']:.0f} µm rms"
        figures.line(figure, time[thin], error[thin], COLOURS[variant], name)
    return figure
