"""Slipped teeth: above a torque the mesh ratchets, and the lost motion changes by whole teeth.

A slip is thousands of times larger than the noise, occurs in one run, and ruins every fit.
Therefore it is searched in the raw recordings before any fit: a permanent jump by whole teeth at
every load peak above one threshold and at no other.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.content_key import content_key
from lostmotion.effects.conditions import Conditions
from lostmotion.effects.effect import Effect
from lostmotion.fit.baseline import BaselineModel
from lostmotion.units import ARCSEC

BESIDE = 5
"""Samples before and after a jump whose medians show that it is permanent."""


def jumping_effect(effects: Mapping[str, Effect]) -> Effect | None:
    """The effect whose angle changes in steps of whole teeth, if there is one."""
    return next((effect for effect in effects.values() if effect.steps), None)


def jumps(base: BaselineModel, tooth_arcsec: float) -> list[tuple[int, int]]:
    """Rows at which the lost motion changes permanently by whole teeth, and by how many."""
    found = []
    for at in base.conditions.slices():
        x = base.measured[at] / tooth_arcsec
        teeth = np.round(np.diff(x)).astype(int)
        for k in np.flatnonzero(teeth) + 1:
            before, behind = x[max(k - BESIDE, 0) : k], x[k : k + BESIDE]
            if round(float(np.median(behind) - np.median(before))) == teeth[k - 1]:
                found.append((int(at.start + k), int(teeth[k - 1])))
    return found


def slipped_teeth(base: BaselineModel, effect: Effect, typical: FloatArray) -> FloatArray | None:
    """Values of the effect that reproduce every jump by whole teeth; searched once.

    Parameters
    ----------
    base : BaselineModel
    effect : Effect
        The ratcheting effect.
    typical : ndarray
        Its values, with the tooth angle of this drive.

    Returns
    -------
    ndarray or None
        None if no teeth slipped, or if no threshold separates the load peaks with slip from those
        without.
    """
    key = ("slipped teeth", effect, content_key((base.measured, typical)))
    values: FloatArray | None = base.conditions.once(key, search_slipped, base, effect, typical)
    return None if values is None else values.copy()


def search_slipped(base: BaselineModel, effect: Effect, typical: FloatArray) -> FloatArray | None:
    """See `slipped_teeth`: it depends on the recordings alone."""
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
    """Rows at which teeth slip according to the effect within a run, and the angles, rad."""
    angle = effect.run(values, conditions, conditions.torque, np.zeros(conditions.rows))
    step = np.diff(angle, prepend=0.0)
    step[conditions.starts[:-1]] = 0.0
    size = float(values[effect.indices("given")[0]])
    teeth = np.round(step / size)
    return {int(row): float(teeth[row]) * size for row in np.flatnonzero(teeth)}
