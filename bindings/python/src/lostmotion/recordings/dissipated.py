"""Work that a drive dissipates in a run: its sign is that of the torque times the lost motion.

Friction dissipates work in every drive. Over a way there and back an error of position does not
change that work, though it may reverse the slope of the lost motion over the torque.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.recordings.campaign import Run
from lostmotion.recordings.findings import DOUBT_CHANCE

SURE_SD = NormalDist().inv_cdf(1 - DOUBT_CHANCE / 2)
"""Distance from zero, in standard deviations, that noise exceeds with this probability."""


@dataclass(frozen=True)
class DissipatedWork:
    """Dissipated work and its standard deviation by the noise of the readings, Nm rad."""

    work: float
    sd: float


def sign_of(works: Iterable[DissipatedWork]) -> int:
    """Sign of the work of several runs together; 0 if it may be noise."""
    works = list(works)
    total, sd = sum(work.work for work in works), math.hypot(*(work.sd for work in works))
    return int(math.copysign(1, total)) if abs(total) > SURE_SD * sd else 0


def dissipated_work(run: Run) -> DissipatedWork:
    """Work that a drive dissipates from the first to the last time at one place.

    The integral of -lost motion d(torque) needs no closed loop, only the same place at both ends:
    the median output angle if the output turns, else the median torque. Zero if the run does not
    return there.
    """
    torque, lost = run.torque_Nm, run.lost_motion_rad
    place = run.columns.get("output_angle", lost)
    if np.ptp(place - lost) <= np.ptp(lost):
        place = torque
    above = place > np.median(place)
    at = np.flatnonzero(above[1:] != above[:-1])
    if at.size < 2:
        return DissipatedWork(0.0, 0.0)
    torque, lost = (values[at[0] : at[-1] + 2] for values in (torque, lost))
    sd = math.hypot(
        noise_of(lost) * float(np.linalg.norm(np.diff(torque))),
        noise_of(torque) * float(np.linalg.norm(np.diff(lost))),
    )
    return DissipatedWork(-integral_over(torque, lost - lost[0]), sd)


def noise_of(values: FloatArray) -> float:
    """Standard deviation of white noise in smooth values, by their second differences."""
    return float(np.sqrt(np.mean(np.diff(values, 2) ** 2) / 6)) if values.size > 2 else 0.0


def integral_over(along: FloatArray, over: FloatArray) -> float:
    """Integral of `over` d(`along`)."""
    return float(np.sum(np.diff(along) * (over[1:] + over[:-1]) / 2))
