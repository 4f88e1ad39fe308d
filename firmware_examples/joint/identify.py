"""From the test bench's recording to the controller's parameters: params.h.

    example_bench > locked.csv
    python identify.py locked.csv params.h

The recording is the only information about the joint. The model is that of the run-time code with
all friction in parallel with the spring: operators of given half widths carry their shares of the
torque, and the rest winds up an odd, piecewise linear torsion curve. Shares and slopes are fitted
together.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from lostmotion.torsion_curve import run_plays
from lostmotion.export import Controller, Limits, Play, Watch, export
from lostmotion.fit.hysteresis import SHARE_MAX
from lostmotion.fit.least_squares import SumLimit, bounded_least_squares
from lostmotion.recordings import read_campaign
from lostmotion.units import ARCSEC

KNOTS_NM = 40 * np.array(
    [0.004, 0.008, 0.012, 0.017, 0.03, 0.06, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.85]
)
"""Knots of the torsion curve, closer where a radial gap closes; the last segment continues."""

RADII_NM = 40 * np.geomspace(0.015, 0.3, 8)
"""Half widths of the operators."""

TORQUE_LIMIT_NM = 60.0
PERIOD_S = 5e-4
LIMITS = Limits(
    period_s=PERIOD_S,
    correction_rad=0.003,
    velocity_rad_s=0.05,
    acceleration_rad_s2=20.0,
    jerk_rad_s3=20e3,
    response_per_s=1 / (16 * PERIOD_S),
)
WATCH = Watch(window_s=1.0, fade_s=2.0, noise_rad=2 * ARCSEC, misfit_rad=20 * ARCSEC)


def identify(recording: Path) -> tuple[Controller, float]:
    """Fit the model; returns it with the rms of the residual in arcsec."""
    campaign = read_campaign([recording], ratio=100)
    torque = np.ascontiguousarray(campaign.column("torque"))
    angle = campaign.column("lost_motion") / ARCSEC
    plays = run_plays(RADII_NM, torque)
    start = np.concatenate(([0.0], KNOTS_NM))
    length = np.append(np.diff(start), np.inf)
    stretches, count = start.size, RADII_NM.size

    def evaluate(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        slopes, shares, offset = x[:stretches], x[stretches:-1], x[-1]
        wound = torque + plays @ shares
        size, sign = np.abs(wound), np.sign(wound)
        ramps = sign[:, None] * np.clip(size[:, None] - start, 0.0, length)
        slope = slopes[np.searchsorted(start, size, side="right") - 1]
        friction = slope[:, None] * plays
        columns = (ramps, friction, np.ones((torque.size, 1)))
        return ramps @ slopes + offset - angle, np.hstack(columns)

    mean = np.ptp(angle) / np.ptp(torque)
    first = np.concatenate((np.full(stretches, mean), np.full(count, 0.05), [0.0]))
    low = np.concatenate((np.full(stretches, mean / 50), np.zeros(count), [-np.inf]))
    high = np.concatenate((np.full(stretches, mean * 50), np.full(count, SHARE_MAX), [np.inf]))
    friction_inside = SumLimit(slice(stretches, stretches + count), SHARE_MAX)
    found = bounded_least_squares(evaluate, first, low, high, steps=200, limit=friction_inside)

    slopes, shares = found.x[:stretches], found.x[stretches:-1]
    ends = np.append(KNOTS_NM, TORQUE_LIMIT_NM)
    rise = np.cumsum(slopes * np.diff(np.concatenate(([0.0], ends)))) * ARCSEC
    controller = Controller(
        TORQUE_LIMIT_NM,
        np.concatenate((-ends[::-1], [0.0], ends)),
        np.concatenate((-rise[::-1], [0.0], rise)),
        LIMITS,
        WATCH,
        inside=[
            Play(float(radius), 0.0, float(share))
            for radius, share in zip(RADII_NM, shares, strict=True)
            if share > 0
        ],
    )
    return controller, float(np.sqrt(found.cost / torque.size))


def main() -> None:
    """Read the recording, write the header, state how well it fits."""
    recording, header = (Path(argument) for argument in sys.argv[1:3])
    controller, rms_arcsec = identify(recording)
    export(controller, header, name="joint_parameters", title="The simulated joint")
    print(f"{header}: the model leaves {rms_arcsec:.2f} arcsec rms of the recording")


if __name__ == "__main__":
    main()
