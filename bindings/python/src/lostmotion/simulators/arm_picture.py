"""Figure of the arm: the loop of a drive in the simulator, and the tracking error."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from lostmotion.drives import Drive
from lostmotion.predict import predict
from lostmotion.report.chart import Axes, round_up
from lostmotion.report.svg import BLUE, FAINT, INK, RED, SOFT, Drawing
from lostmotion.simulators.mujoco import slow_reversal
from lostmotion.units import ARCMIN

SIZE_PX = (860.0, 340.0)

COLOURS = {"rigid": FAINT, "drives": RED, "compensated": BLUE}


def draw_arm(found: Mapping[str, Mapping[str, Any]], drive: Drive, duration_s: float) -> str:
    """Draw the picture as SVG.

    Parameters
    ----------
    found : mapping
        From `run_arm`.
    drive : Drive
        Whose loop is shown.
    duration_s : float
        Of the path.
    """
    width, height = SIZE_PX
    title = "Lost motion of a drive in MuJoCo, and the tracking error of the arm"
    drawing = Drawing(width, height, title)
    _draw_loop(drawing, (60.0, 40.0, 300.0, height - 90.0), drive)
    _draw_errors(drawing, (450.0, 40.0, width - 470.0, height - 90.0), found, duration_s)
    return drawing.render()


def _draw_loop(drawing: Drawing, box: tuple[float, float, float, float], drive: Drive) -> None:
    rated = drive.rated_torque_Nm
    torque, lost = slow_reversal(drive, rated)
    thin = slice(None, None, 25)
    grid = np.linspace(-rated, rated, 81)
    predicted = np.array(predict(drive, grid)["total_arcmin"])
    most = round_up(float(np.max(np.abs(predicted))))
    axes = Axes(drawing, box, (-rated, rated), (-most, most))
    axes.frame("torque, N m", f"lost motion of {drive.name.split(',')[0]}, arcmin")
    axes.curve(grid, predicted, SOFT, 1.2, "5 4")
    axes.curve(torque[thin], lost[thin] / ARCMIN, COLOURS["drives"])
    drawing.text(box[0] + 14, box[1] + 18, "simulated, input locked", fill=COLOURS["drives"])
    drawing.text(box[0] + 14, box[1] + 36, "predict (dashed)", fill=SOFT)


def _draw_errors(
    drawing: Drawing,
    box: tuple[float, float, float, float],
    found: Mapping[str, Mapping[str, Any]],
    duration_s: float,
) -> None:
    most = round_up(max(float(row["tracking_max_um"]) for row in found.values()))
    axes = Axes(drawing, box, (0.0, duration_s), (0.0, most))
    axes.frame("time, s", "tracking error of the tool, um")
    for number, (variant, row) in enumerate(found.items()):
        error = np.asarray(row["error_um"])
        time = np.linspace(0.0, duration_s, error.size)
        thin = slice(None, None, 8)
        axes.curve(time[thin], error[thin], COLOURS[variant])
        text = f"{variant}: {row['tracking_rms_um']:.0f} um rms"
        drawing.text(box[0] + 90, box[1] + 100 + 18 * number, text, fill=COLOURS.get(variant, INK))
