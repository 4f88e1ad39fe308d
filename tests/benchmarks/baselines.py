"""What well-known tools say of the same campaigns: PySINDy, lasso, boosted trees.

All get the residual of the same fitted base, so that none of them has to find the characteristic
and the friction first. PySINDy (STLSQ on polynomials up to the third degree and first harmonics)
and boosted trees (permutation importance on held-out runs) see the recorded columns; the lasso sees
the tangents of the library's effects, which is more than a user of it would have.

Each answers with what it claims, best first: names of effects (lasso) or of columns (the others).
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import numpy.typing as npt
import pysindy
from sklearn.ensemble import HistGradientBoostingRegressor
from sklearn.inspection import permutation_importance
from sklearn.linear_model import LassoCV

from lostmotion.discover.backbone import Base
from lostmotion.discover.candidates import named_candidates
from lostmotion.discover.effects import library

FloatArray = npt.NDArray[np.float64]

ROWS = 6000
"""Rows that each tool gets, drawn evenly: they are slow, and neighbours say the same."""

CLAIMED = 0.02
"""Explained share of the residual's variance from which boosted trees would be believed."""

SPARSE = 3
"""Terms at which the threshold of PySINDy stops rising: with the usual one it keeps dozens."""


def table_of(base: Base) -> tuple[list[str], FloatArray, FloatArray, npt.NDArray[np.intp]]:
    """Names and values of the recorded columns, the residual and the run of every row taken."""
    c = base.conditions
    taken = np.linspace(0, c.rows - 1, min(ROWS, c.rows)).astype(np.intp)
    names, columns = [], []
    for name, column in c.columns.items():
        if np.ptp(column) > 0 and name not in ("elapsed_s", "output_acceleration_rad_s2"):
            values = column[taken]
            if "angle" in name:
                values = np.remainder(values, 2 * np.pi)
            names.append(name)
            columns.append((values - values.mean()) / values.std())
    time = (c.time_s - c.time_s[c.starts[:-1]][c.run_of])[taken]
    names.append("time_s")
    columns.append((time - time.mean()) / time.std())
    return names, np.column_stack(columns), base.residual()[taken], c.run_of[taken]


def columns_in(term: str, names: list[str]) -> list[str]:
    """Columns that a term of PySINDy's library is made of."""
    return [name for name in names if name in term]


def by_pysindy(base: Base) -> list[str]:
    """Columns of the terms that sequential thresholding keeps, strongest first."""
    names, x, y, _ = table_of(base)
    made = pysindy.PolynomialLibrary(degree=3, include_bias=False) + pysindy.FourierLibrary(1)
    made.fit(x)
    features = np.asarray(made.transform(x))
    words = made.get_feature_names(names)
    features = (features - features.mean(axis=0)) / np.maximum(features.std(axis=0), 1e-12)
    threshold = 0.02 * float(np.std(y))
    for _ in range(20):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # it warns when nothing is left
            optimizer = pysindy.STLSQ(threshold=threshold, alpha=1.0)
            optimizer.fit(features, y[:, None])
        weights = np.abs(optimizer.coef_[0])
        if np.count_nonzero(weights) <= SPARSE:
            break
        threshold *= 1.5
    found: list[str] = []
    for i in np.argsort(-weights):
        if weights[i] > 0:
            found += [name for name in columns_in(words[i], names) if name not in found]
    return found


def by_lasso(base: Base, ratio: float) -> list[str]:
    """Effects whose tangents a cross-validated lasso keeps, strongest first."""
    c = base.conditions
    candidates, _ = named_candidates(library(), base, base.at(), ratio)
    taken = np.linspace(0, c.rows - 1, min(ROWS, c.rows)).astype(np.intp)
    owners, columns = [], []
    for candidate in candidates:
        for column in candidate.columns.T:
            centred = column - c.run_mean(column)[c.run_of]
            if centred.std() > 0:
                owners.append(candidate.name)
                columns.append((centred / centred.std())[taken])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of slow convergence
        fitted = LassoCV(cv=5, alphas=20, max_iter=2000).fit(
            np.column_stack(columns), base.residual()[taken]
        )
    weights = np.abs(fitted.coef_)
    found: list[str] = []
    for i in np.argsort(-weights):
        if weights[i] > 0 and owners[i] not in found:
            found.append(owners[i])
    return found


def by_trees(base: Base) -> list[str]:
    """Columns that matter to boosted trees on runs that they have not seen, strongest first."""
    names, x, y, run_of = table_of(base)
    held = run_of % 4 == 3
    model = HistGradientBoostingRegressor(max_iter=150, random_state=0)
    model.fit(x[~held], y[~held])
    if model.score(x[held], y[held]) < CLAIMED:
        return []
    found: Any = permutation_importance(model, x[held], y[held], n_repeats=3, random_state=0)
    order = np.argsort(-found.importances_mean)
    return [names[i] for i in order if found.importances_mean[i] > 0]


def baselines(base: Base, ratio: float) -> dict[str, list[str]]:
    """What each tool claims, best first; nothing where it claims nothing."""
    return {
        "PySINDy": by_pysindy(base),
        "lasso on our tangents": by_lasso(base, ratio),
        "boosted trees": by_trees(base),
    }
