"""Standard figures of measured and of modelled loops, by the same code."""

from __future__ import annotations

from lostmotion.characterize.characterization import StandardFigures, standard_figures
from lostmotion.compare import Comparison


def compared_figures(result: Comparison, rated_torque_Nm: float) -> dict[str, StandardFigures]:
    """Find the standard figures of a comparison's loops: ``measured`` and ``model``.

    Parameters
    ----------
    result : Comparison
    rated_torque_Nm : float
        Of which lost motion is stated at shares.
    """
    model = result.measured_rad - result.residual_rad
    angles = {"measured": result.measured_rad, "model": model}
    return {
        name: standard_figures(
            result.campaign,
            rated_torque_Nm,
            [angle[at] for at in result.base.conditions.slices()],
        )
        for name, angle in angles.items()
    }
