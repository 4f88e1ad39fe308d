"""Branches of a recording: rising and falling torque, and reversals."""

from __future__ import annotations

import numpy as np

from lostmotion.arrays import FloatArray, IntArray
from lostmotion.torsion_curve import run_plays

REVERSAL_SHARE = 0.02
"""A change of direction of the torque is a reversal if the torque goes back by more than this share
of the largest torque.
"""


def directions(torque: FloatArray, largest: float) -> tuple[IntArray, FloatArray]:
    """Direction of the torque and its travel since the last reversal.

    Returns
    -------
    direction : ndarray of int
        1 rising, 0 falling; noise below `REVERSAL_SHARE` of the largest torque is no reversal.
    travel : ndarray
        Torque covered since the last reversal, signed by the direction.
    """
    play = torque + run_plays(np.array([REVERSAL_SHARE * largest]), torque)[:, 0]
    move = np.sign(np.diff(play, prepend=play[0]))
    last = np.maximum.accumulate(np.where(move != 0, np.arange(move.size), 0))
    sign = move[last]
    if np.any(sign != 0):
        sign[sign == 0] = sign[np.flatnonzero(sign)[0]]
    turned = np.flatnonzero(np.diff(sign) != 0) + 1
    begin = np.zeros(sign.size, dtype=np.intp)
    begin[turned] = turned
    begin = np.maximum.accumulate(begin)
    return (sign > 0).astype(np.intp), torque - torque[begin]
