"""Hysteresis of the baseline model: a bank of play operators on an envelope of the torque."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
import numpy.typing as npt

from lostmotion.backbone import run_plays
from lostmotion.core import core

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.intp]


def envelope(torque: FloatArray, more_Nm: float, knee_Nm: float) -> FloatArray:
    """What the operators follow, N m: ``U = T + A sgn(T) (1 - 1 / (1 + t + t^2))``.

    Parameters
    ----------
    torque : ndarray
        N m.
    more_Nm, knee_Nm : float
        `A` and `K` in ``t = |T| / K``.
    """
    t = np.abs(torque) / knee_Nm
    more = more_Nm * (1.0 - 1.0 / (1.0 + t * (1.0 + t)))
    return np.asarray(torque + np.copysign(more, torque))


def operator_columns(
    radius_Nm: FloatArray, followed: FloatArray, width: FloatArray, sessions: Iterable[slice]
) -> FloatArray:
    """Differences ``z_i - U`` of every operator, N m; each session begins at its first torque.

    Parameters
    ----------
    radius_Nm : ndarray
        Half widths.
    followed : ndarray
        What they follow, see `envelope`.
    width : ndarray
        Scale of the half widths at every sample.
    """
    c = core(64)
    count = radius_Nm.size
    out = c.zeros(followed.size, count)
    for at in sessions:
        c.lib.lm_run_plays(
            c.pointer(c.array(radius_Nm)),
            c.pointer(c.zeros(count)),
            count,
            c.pointer(c.array(np.full(count, followed[at.start])), write=True),
            c.pointer(c.array(followed[at])),
            c.pointer(c.array(width[at])),
            at.stop - at.start,
            c.pointer(out[at], write=True),
        )
    return out


def start_columns(radius_Nm: FloatArray, followed: FloatArray) -> FloatArray:
    """Derivatives of the differences by where each operator stood before the first sample.

    Over the first run of a session; by states in half widths.
    """
    out = np.zeros((followed.size, radius_Nm.size))
    for i, radius in enumerate(radius_Nm):
        one = np.array([radius])
        high = run_plays(one, followed, 0.5)[:, 0]
        out[:, i] = high - run_plays(one, followed, -0.5)[:, 0]
    return out


def moved_before(
    followed: FloatArray, radius_Nm: FloatArray, sessions: Iterable[slice], starts: IntArray
) -> Iterator[tuple[slice, FloatArray]]:
    """Rows of the first run of each session, and `start_columns` there.

    Parameters
    ----------
    starts : ndarray
        Offsets of the runs.
    """
    for session in sessions:
        end = starts[np.searchsorted(starts, session.start, side="right")]
        at = slice(session.start, int(end))
        yield at, start_columns(radius_Nm, followed[at])
