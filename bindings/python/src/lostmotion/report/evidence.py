"""Figures of the evidence: gain of every run, confounded effects, unnamed shapes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from lostmotion import rules
from lostmotion.arrays import FloatArray, IntArray
from lostmotion.candidates.shapes import channels
from lostmotion.condition_cards import CARDS
from lostmotion.discover.choice import Step
from lostmotion.discover.contest_round import RecordedRound
from lostmotion.discover.recorded_model import Selection
from lostmotion.evidence.overlap import principal_angles
from lostmotion.report.charts import Chart
from lostmotion.report.maps import bins_of, name_of
from lostmotion.report.svg import signs
from lostmotion.report.wording import with_signs, words
from lostmotion.results import figures
from lostmotion.results.colours import BLUE, INK, ORANGE
from lostmotion.results.figures import axis_range

ROWS_SHOWN = 6
"""Largest number of candidates whose gain of every run is drawn."""

ALIKE_SHOWN = 10
"""Largest number of effects whose angles are drawn."""

SHAPE_BINS = 160
"""Bins of the quantity on which a shape depends."""


def gains_of(selection: Selection) -> list[tuple[str, FloatArray]]:
    """Gain of every run for the selected candidates, then for the strongest others."""
    found: list[tuple[str, FloatArray]] = []
    for step in selection.steps:
        if step.selected is not None:
            found.append((words(step.selected.candidate.name), step.selected.gain_by_run))
    names = {name for name, _ in found}
    rest = [r for step in (selection.steps[0], selection.steps[-1]) for r in step.results]
    for result in sorted(rest, key=lambda r: -r.gain):
        if len(found) >= ROWS_SHOWN:
            break
        if words(result.name) not in names:
            names.add(words(result.name))
            found.append((words(result.name), result.gain_by_run))
    return found


def dots_figure(gains: Sequence[tuple[str, FloatArray]], labels: Sequence[object]) -> Chart:
    """Make the figure of the gain of every run, of some candidates."""
    return Chart(
        "gain_by_run",
        "Evidence by run",
        "Gain of each run in log predictive density (nats) when it is predicted by a fit to "
        "the others with the candidate in the model: right of zero the run supports it. An "
        "effect that only a single run supports is not accepted. Dark: the sum over all runs.",
        lambda: [draw_dots(gains, labels)],
        {
            "run": [str(label) for label in labels],
            **{f"{candidate}_nats": list(gain) for candidate, gain in gains},
        },
    )


def draw_dots(gains: Sequence[tuple[str, FloatArray]], labels: Sequence[object]) -> Any:
    """Draw a row of dots for each candidate."""
    figure = figures.framed("", "gain of a run, nats", "", 120 + 34 * len(gains))
    most = max(float(gain.max()) for _, gain in gains)
    for i, (_, gain) in enumerate(gains):
        figures.dots(
            figure,
            gain,
            i + 0.2 * ((np.arange(gain.size) % 3) - 1),
            BLUE,
            size=7,
            customdata=[str(label) for label in labels],
            hovertemplate="run %{customdata}: %{x:.2f} nats<extra></extra>",
        )
        figure.add_annotation(
            x=1, xref="paper", y=i, text=f"<b>{signs(f'{gain.sum():+.1f}')}</b>", showarrow=False
        )
    figure.update_xaxes(range=axis_range([*np.concatenate([g for _, g in gains]), 0, 1.15 * most]))
    figure.update_yaxes(
        tickvals=list(range(len(gains))),
        ticktext=[name for name, _ in gains],
        range=[len(gains) - 0.5, -0.5],
    )
    return figure


def alike_figure(step: Step) -> Chart | None:
    """Make the figure of the angles between the effects; None with fewer than two."""
    contest = step.round.contest
    strongest = [r.name for r in step.results if step.round.candidates[r.name].named]
    chosen = sorted(strongest[:ALIKE_SHOWN])
    if len(chosen) < 2:
        return None
    angle = np.full((len(chosen), len(chosen)), np.nan)
    for i in range(len(chosen)):
        for j in range(i):
            found = principal_angles(contest.evidence, contest.null_omega, chosen[i], chosen[j])
            angle[i, j] = angle[j, i] = float(found[0]) if found.size else 90.0
    pairs = [(i, j) for i in range(len(chosen)) for j in range(i)]
    return Chart(
        "angles",
        "Which effects are confounded in these runs",
        "Angle in degrees between the contributions of two effects, after removing what the "
        "baseline model and the run-to-run scatter absorb. At 90° they are independent; below "
        f"{rules.TWIN_DEG:g}° runs like these do not separate them, however many there are. The "
        f"strongest {len(chosen)} are shown.",
        lambda: [draw_alike([words(n) for n in chosen], angle)],
        {
            "effect": [chosen[i] for i, _ in pairs],
            "other": [chosen[j] for _, j in pairs],
            "angle_deg": [float(angle[i, j]) for i, j in pairs],
        },
    )


def draw_alike(names: Sequence[str], angle: FloatArray) -> Any:
    """Draw the lower triangle of the angles, orange where effects are not separated."""
    figure = figures.framed("", "", "", 110 + 30 * len(names))
    twin = rules.TWIN_DEG / 90.0
    figure.add_heatmap(
        x=[str(j + 1) for j in range(len(names) - 1)],
        y=[f"{i + 1} {name}" for i, name in enumerate(names)][1:],
        z=np.where(np.tri(len(names), k=-1, dtype=bool), angle, np.nan)[1:, :-1],
        texttemplate="%{z:.0f}",
        hovertemplate="%{y} and %{x}: %{z:.1f}°<extra></extra>",
        zmin=0,
        zmax=90,
        colorscale=[[0, ORANGE], [twin, ORANGE], [twin, "#77aadd"], [1, "#fafafa"]],
        showscale=False,
        xgap=2,
        ygap=2,
    )
    figure.update_yaxes(autorange="reversed", showgrid=False, ticks="")
    figure.update_xaxes(showline=False, ticks="", type="category")
    return figure


def shape_figure(step: Step) -> Chart | None:
    """Make the figure of an unnamed shape over the quantity on which it depends."""
    chosen = step.selected
    if chosen is None or chosen.candidate.named or chosen.settled is None:
        return None
    assert isinstance(step.round, RecordedRound)
    base = step.round.settled.base
    shape = chosen.settled.base.additives[-1]
    found = covariate_of(base, chosen.candidate.covariate)
    if found is None:
        return None
    values, unit = found
    edges = np.unique(np.linspace(float(values.min()), float(values.max()), SHAPE_BINS + 1))
    if edges.size < 3:
        return None
    bins = edges.size - 1
    place = bins_of(values, edges)
    count = np.bincount(place, minlength=bins)
    full = np.maximum(count, 1)
    left = base.residual()
    middle = np.bincount(place, values, bins) / full
    line = np.bincount(place, shape.columns @ shape.coefficients, bins) / full
    mean = np.bincount(place, left, bins) / full
    half = 2.0 * error_of_means(left, place, base.conditions.run_of, bins)
    use = count > 0
    middle, line, mean, half = middle[use], line[use], mean[use], half[use]
    label = f"{words(chosen.candidate.covariate)}{', ' + unit if unit else ''}"
    return Chart(
        "shape",
        f"The residual depends on {words(chosen.candidate.covariate)}",
        f"Of the form “{with_signs(chosen.candidate.shape)}”: the fitted shape (line), the "
        "mean residual of the baseline model (dots), twice its standard error from the "
        "scatter between runs "
        "(band). Where the shape acts on stiffness, friction or gap, the line is its mean effect "
        "on the lost motion.",
        lambda: [draw_shape(middle, line, mean, half, label)],
        {
            label: list(middle),
            "shape_arcsec": list(line),
            "mean_residual_arcsec": list(mean),
            "twice_standard_error_arcsec": list(half),
        },
    )


def error_of_means(values: FloatArray, place: IntArray, run_of: IntArray, bins: int) -> FloatArray:
    """Standard error of the mean of every bin, from the scatter of the run means."""
    runs = int(run_of.max()) + 1
    cell = place * runs + run_of
    count = np.bincount(cell, minlength=bins * runs).reshape(bins, runs)
    mean = np.bincount(cell, values, bins * runs).reshape(bins, runs) / np.maximum(count, 1)
    seen = np.maximum((count > 0).sum(axis=1), 1)
    centre = np.where(count > 0, mean, 0.0).sum(axis=1) / seen
    square = np.where(count > 0, (mean - centre[:, None]) ** 2, 0.0).sum(axis=1)
    return np.asarray(np.sqrt(square / np.maximum(seen - 1, 1) / seen))


def covariate_of(base: Any, covariate: str) -> tuple[FloatArray, str] | None:
    """Values of a covariate of a shape, with the unit for the axis."""
    c = base.conditions
    if covariate in ("input_angle", "output_angle"):
        return np.degrees(np.mod(c.columns[f"{covariate}_rad"], 2 * np.pi)), "°"
    if covariate == "run":
        return base.conditions.run_of + 1.0, "in order"
    units = {card.quantity: name_of(column)[1] for column, card in CARDS.items()} | {"time": "s"}
    found: Mapping[str, FloatArray] = channels(base)
    return (found[covariate], units.get(covariate, "")) if covariate in found else None


def draw_shape(
    x: FloatArray, fitted: FloatArray, mean: FloatArray, half: FloatArray, label: str
) -> Any:
    """Draw the shape over the means and their band."""
    figure = figures.framed("", label, "arcsec", 360)
    figures.area(figure, x, mean - half, mean + half, "#c8ddf1", "± 2 standard errors")
    figures.dots(figure, x, mean, ORANGE, "mean residual", size=4)
    figures.line(figure, x, fitted, INK, "fitted shape")
    return figure
