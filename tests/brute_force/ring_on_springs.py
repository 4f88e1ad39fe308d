"""A thin ring on discrete springs by Rayleigh and Ritz: its deflection between the supports.

The radial displacement is a sum of even waves, which both lobes share; its energy and that of the
springs is least. Neither the closed form of the free ring nor its constraint by forces is used.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

WAVES = 400
"""Number of even waves: with orders up to 800 the error is 1e-9 of the ring's deflection."""

Array = npt.NDArray[np.float64]


def gives(
    radius_mm: float,
    stiffness_N_mm2: float,
    held_rad: Array,
    compliance_mm_per_N: Array,
    loaded_rad: Array,
) -> Array:
    """Matrix of the deflections at the loaded angles from unit forces there, on both lobes equally.

    Parameters
    ----------
    held_rad : array, shape (n,)
        Angles of the supports of a lobe.
    compliance_mm_per_N : array, shape (n, n)
        Of the supports.
    """
    orders = 2.0 * np.arange(1, WAVES + 1)
    # Energy of w = a cos(n p) + b sin(n p): E I / (2 r^3) (n^2 - 1)^2 pi (a^2 + b^2).
    bending = np.tile(stiffness_N_mm2 / radius_mm**3 * (orders**2 - 1) ** 2 * np.pi, 2)

    def shapes(angle: Array) -> Array:
        waves = np.outer(angle, orders)
        return np.hstack((np.cos(waves), np.sin(waves)))

    springs = np.linalg.inv(compliance_mm_per_N)
    at = shapes(held_rad)
    energy = np.diag(bending) + 2.0 * at.T @ springs @ at  # two lobes
    load = 2.0 * shapes(loaded_rad).T
    return np.asarray(shapes(loaded_rad) @ np.linalg.solve(energy, load))
