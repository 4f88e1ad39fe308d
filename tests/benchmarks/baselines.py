"""Results of well-known tools on the same campaigns: PySINDy, lasso, boosted trees.

All are used as well as possible. They get the residual of the baseline model fitted to all runs
as one, run means removed, so that none of them has to find the torsion curve and the friction
first. All splits of the data are by whole runs, because neighbouring rows depend on each other. A
result that explains less than `CLAIMED` of the variance of the runs left out is not claimed.

PySINDy and the trees see the recorded columns and what an engineer would derive from them: rates,
direction of the load, time in the run, the run's number, sines and cosines of the angles. The lasso
sees the tangents of the library's effects, which its user would not have.

Each lists what it identifies, best first: effects (lasso), terms (PySINDy), columns (trees).
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pysindy
from sklearn.ensemble import HistGradientBoostingRegressor
from sklearn.inspection import permutation_importance
from sklearn.linear_model import LassoCV

from lostmotion.candidates.named import named_candidates
from lostmotion.effects.library import library
from lostmotion.fit.baseline import BaselineModel

FloatArray = npt.NDArray[np.float64]

ROWS = 6000
"""Rows that each tool gets, evenly spaced: the tools are slow, and neighbouring rows are
redundant."""

CLAIMED = 0.02
"""Share of the variance of runs left out from which a model is believed. An effect of half the
noise explains a fifth."""

SPARSE = 3
"""Terms that PySINDy's forward regression takes. Its sequential thresholding drops the right terms
among columns as collinear as these: it claimed nothing on the development campaigns."""

FOLDS = 4

HARMONICS = (1, 2)

CUBED = ("torque_Nm", "torque_rate", "direction", "temperature_C", "cycles", "speed", "time_s")
"""Columns of which third powers are offered; squares and products of all are."""


@dataclass
class Table:
    """Columns, residual and fold of the rows that the tools get."""

    names: list[str]
    x: FloatArray
    y: FloatArray
    fold: npt.NDArray[np.intp]
    rows: npt.NDArray[np.intp]

    @property
    def splits(self) -> list[tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]]:
        """Rows to fit to and rows to test on; every run is tested on once."""
        return [
            (np.flatnonzero(self.fold != k), np.flatnonzero(self.fold == k)) for k in range(FOLDS)
        ]


def alike(base: BaselineModel) -> BaselineModel:
    """The baseline model with all runs as one: deviations of runs may contain the hidden effect."""
    out = base.copy()
    out.deviations[:] = 0.0
    out.fit(steps=8)
    return out


def table_of(base: BaselineModel) -> Table:
    """Data of a campaign that the tools get."""
    c = base.conditions
    taken = np.linspace(0, c.rows - 1, min(ROWS, c.rows)).astype(np.intp)
    rate = c.rate(c.torque)
    columns: dict[str, FloatArray] = {
        "torque_rate": rate,
        "direction": np.tanh(rate / (0.1 * float(np.std(rate)) + 1e-12)),
        "time_s": c.time_s - c.time_s[c.starts[:-1]][c.run_of],
        "run": c.run_of.astype(np.float64),
    }
    for name, column in c.columns.items():
        if name in ("input_angle_rad", "output_angle_rad"):
            for k in HARMONICS:
                columns[f"cos{k}_{name}"] = np.cos(k * column)
                columns[f"sin{k}_{name}"] = np.sin(k * column)
        elif name == "input_velocity_rad_s":
            columns["speed"] = column
            # Not the recorded output: its noise would explain that of the residual.
            columns["acceleration"] = c.rate(column)
        elif name not in ("elapsed_s", "output_acceleration_rad_s2"):
            columns[name] = column
    columns = {name: column[taken] for name, column in columns.items()}
    names = [name for name, column in columns.items() if column.std() > 0]
    x = np.column_stack([(columns[n] - columns[n].mean()) / columns[n].std() for n in names])
    residual = base.residual()
    residual = residual - c.run_mean(residual)[c.run_of]
    return Table(names, x, residual[taken], c.run_of[taken] % FOLDS, taken)


def explained(y: FloatArray, predicted: FloatArray) -> float:
    """Share of the variance that a prediction explains."""
    return 1.0 - float(np.sum((y - predicted) ** 2) / np.sum(y**2))


def by_pysindy(table: Table) -> list[str]:
    """Terms that forward regression takes, strongest first."""
    cubed = [i for i, name in enumerate(table.names) if name in CUBED]
    made = pysindy.GeneralizedLibrary(
        [
            pysindy.PolynomialLibrary(degree=2, include_bias=False),
            pysindy.PolynomialLibrary(degree=3, include_bias=False),
        ],
        inputs_per_library=[list(range(len(table.names))), cubed],
    )
    made.fit(table.x)
    words = made.get_feature_names(table.names)
    features = np.asarray(made.transform(table.x))
    # Terms of both libraries count once.
    kept = list({word: i for i, word in reversed(list(enumerate(words)))}.values())[::-1]
    words, features = [words[i] for i in kept], features[:, kept]
    features = (features - features.mean(axis=0)) / np.maximum(features.std(axis=0), 1e-12)
    predicted = np.zeros_like(table.y)
    for fit, test in table.splits:
        predicted[test] = features[test] @ sparse(features[fit], table.y[fit])
    if explained(table.y, predicted) < CLAIMED:
        return []
    weights = np.abs(sparse(features, table.y))
    return [words[i] for i in np.argsort(-weights) if weights[i] > 0]


def sparse(features: FloatArray, y: FloatArray) -> FloatArray:
    """Weights of the few terms that PySINDy's forward regression takes."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        optimizer = pysindy.FROLS(max_iter=SPARSE, alpha=1e-6)
        optimizer.fit(features, y[:, None])
    return np.asarray(optimizer.coef_[0])


def by_lasso(table: Table, base: BaselineModel, ratio: float) -> list[str]:
    """Effects whose tangents a cross-validated lasso keeps, strongest first."""
    c = base.conditions
    candidates, _ = named_candidates(library(), base, base.at(), ratio)
    owners, columns = [], []
    for candidate in candidates:
        for column in candidate.columns.T:
            centred = (column - c.run_mean(column)[c.run_of])[table.rows]
            if centred.std() > 0:
                owners.append(candidate.name)
                columns.append(centred / centred.std())
    x = np.column_stack(columns)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of slow convergence
        fitted = LassoCV(cv=table.splits, alphas=20, max_iter=2000).fit(x, table.y)
    # The error of the folds at the chosen weight is the cross-validated one.
    if 1.0 - float(np.min(fitted.mse_path_.mean(axis=1)) / np.var(table.y)) < CLAIMED:
        return []
    weights = np.abs(fitted.coef_)
    order = [owners[i] for i in np.argsort(-weights) if weights[i] > 0]
    return list(dict.fromkeys(order))


def by_trees(table: Table) -> list[str]:
    """Columns that matter to boosted trees on runs left out, strongest first."""
    importance = np.zeros(len(table.names))
    predicted = np.zeros_like(table.y)
    for fit, test in table.splits:
        model = HistGradientBoostingRegressor(max_iter=150, random_state=0)
        model.fit(table.x[fit], table.y[fit])
        predicted[test] = model.predict(table.x[test])
        found: Any = permutation_importance(
            model, table.x[test], table.y[test], n_repeats=2, random_state=0
        )
        importance += found.importances_mean
    if explained(table.y, predicted) < CLAIMED:
        return []
    return [table.names[i] for i in np.argsort(-importance) if importance[i] > 0]


def baselines(base: BaselineModel, ratio: float) -> dict[str, list[str]]:
    """What each tool identifies, best first; empty if nothing."""
    base = alike(base)
    table = table_of(base)
    return {
        "PySINDy": by_pysindy(table),
        "lasso on the tangents": by_lasso(table, base, ratio),
        "boosted trees": by_trees(table),
    }


COLUMNS: dict[str, tuple[str, ...]] = {
    "torque_Nm": ("torque_Nm", "torque_rate", "direction"),
    "elapsed_s": ("time_s", "torque_rate"),
    "input_velocity_rad_s": ("speed",),
    "output_acceleration_rad_s2": ("acceleration", "speed"),
    "torque": ("torque_Nm",),
    "speed": ("speed", "torque_rate"),
    "time": ("time_s",),
    "event": ("time_s", "run"),
}
"""Columns that show what an effect or a cause depends on, if the recorded column has another
name."""


def wanted_columns(name: str, truth: dict[str, Any]) -> set[str]:
    """Columns of which one has to be in a tool's first claim for it to count as right."""
    effect = library().get(name)
    if effect is None:
        needs = {n for cause in truth["hidden"] for n in cause.get("depends_on", ())}
    else:
        # Everything depends on the torque a little: it counts only if no other column is expected.
        needs = set(effect.needs) - {"torque_Nm", "elapsed_s"} or set(effect.needs)
    return {column for need in needs for column in COLUMNS.get(need, (need,))}


def claim(truth: dict[str, Any], tool: str, claims: list[str]) -> str:
    """Whether another tool's first claim is right."""
    hidden = list(truth["effects"])
    if not claims:
        return "nothing" if hidden else "right"
    if not hidden:
        return "false alarm"
    if tool.startswith("lasso"):
        return "right effect" if claims[0] in hidden else "wrong effect"
    wanted = set().union(*(wanted_columns(name, truth) for name in hidden))
    return "right column" if any(name in claims[0] for name in wanted) else "wrong column"
