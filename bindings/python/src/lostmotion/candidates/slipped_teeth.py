"""Teeth that slipped: beyond a torque the mesh ratchets, and the lost motion is off by whole teeth.

A slip is thousands of times the noise, is in one run, and spoils every fit. So it is looked for
before anything is fitted, in the recordings as they are: a jump by whole teeth that stays, in every
peak of the load beyond one threshold and in no other.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from lostmotion import rules
from lostmotion.effects.conditions import Conditions
from lostmotion.effects.effect import Effect
from lostmotion.fit.baseline import BaselineModel
from lostmotion.units import ARCSEC

FloatArray = npt.NDArray[np.float64]

BESIDE = 5
"""Samples before and behind a jump whose medians show that it stays."""


def jumping_effect(effects: Mapping[str, Effect]) -> Effect | None:
    """The effect whose angle jumps by whole teeth and stays, where there is one."""
    return next((effect for effect in effects.values() if effect.steps), None)


def jumps(base: BaselineModel, tooth_arcsec: float) -> list[tuple[int, int]]:
    """Rows at which the lost motion jumps by whole teeth and stays, and by how many."""
    found = []
    for at in base.conditions.slices():
        x = base.measured[at] / tooth_arcsec
        for k in np.flatnonzero(np.abs(np.diff(x)) > 1.0 - rules.WHOLE_TOOTH) + 1:
            before, behind = x[max(k - BESIDE, 0) : k], x[k : k + BESIDE]
            teeth = round(float(x[k] - x[k - 1]))
            change = float(np.median(behind) - np.median(before))
            if max(abs(change - teeth), abs(float(x[k] - x[k - 1]) - teeth)) <= rules.WHOLE_TOOTH:
                found.append((int(at.start + k), teeth))
    return found


def slipped_teeth(base: BaselineModel, effect: Effect, typical: FloatArray) -> FloatArray | None:
    """Values of the effect that meets every jump by whole teeth.

    Parameters
    ----------
    base : BaselineModel
    effect : Effect
        That of a ratcheting mesh.
    typical : ndarray
        Its values, with the angle of a tooth of this drive.

    Returns
    -------
    ndarray or None
        None where no teeth slipped, or where no threshold parts the peaks of the load in which they
        did from those in which they did not.
    """
    (threshold,), (angle,) = effect.indices("fixed"), effect.indices("given")
    slips = jumps(base, float(typical[angle]) / ARCSEC)
    if len({abs(teeth) for _, teeth in slips}) != 1:
        return None
    values = typical.copy()
    values[angle] *= abs(slips[0][1])
    wanted = {row: float(np.sign(teeth)) * values[angle] for row, teeth in slips}
    load = np.abs(base.conditions.torque)
    for row in sorted(wanted, key=lambda row: load[row]):
        values[threshold] = 0.5 * (load[row - 1] + load[row])
        if slips_of(base.conditions, effect, values) == wanted:
            return values
    return None


def slips_of(conditions: Conditions, effect: Effect, values: FloatArray) -> dict[int, float]:
    """Rows at which the effect lets teeth slip within a run, and by how much, rad."""
    angle = effect.run(values, conditions, conditions.torque, np.zeros(conditions.rows))
    step = np.diff(angle, prepend=0.0)
    step[conditions.starts[:-1]] = 0.0
    size = float(values[effect.indices("given")[0]])
    rows = np.flatnonzero(np.abs(step) > rules.WHOLE_TOOTH * size)
    return {int(row): float(np.round(step[row] / size)) * size for row in rows}
