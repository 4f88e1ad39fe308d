"""Figures of the evidence: gain of every run, confounded effects, unnamed shapes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from lostmotion import rules
from lostmotion.candidates.shapes import channels
from lostmotion.discover.choice import Step
from lostmotion.discover.contest_round import RecordedRound
from lostmotion.discover.recorded_model import Selection
from lostmotion.evidence.overlap import principal_angles
from lostmotion.report.chart import Axes, axis_range
from lostmotion.report.page import Figure, FigureData
from lostmotion.report.svg import (
    BLUE,
    GRID,
    INK,
    ORANGE,
    PAPER,
    SMALL_SIZE,
    SOFT,
    Array,
    Drawing,
    signs,
    text_width,
)
from lostmotion.report.wording import with_signs, words

IntArray = npt.NDArray[np.intp]

ROWS_SHOWN = 6
"""Largest number of candidates whose gain of every run is drawn."""

ALIKE_SHOWN = 10
"""Largest number of effects whose angles are drawn."""

SHAPE_BINS = 160
"""Bins of the quantity on which a shape depends."""


def cut_to_width(text: str, room: float) -> str:
    """Shorten a text to the available width."""
    if text_width(text) <= room:
        return text
    while text and text_width(text + "…") > room:
        text = text[:-1]
    return text.rstrip() + "…"


def gains_of(selection: Selection) -> list[tuple[str, Array]]:
    """Gain of every run for the selected candidates, then for the strongest others."""
    found: list[tuple[str, Array]] = []
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


def dots_figure(selection: Selection, labels: Sequence[object], name: str) -> Figure:
    """Make the figure of the gain of every run."""
    gains = gains_of(selection)
    return Figure(
        "Evidence by run",
        "Gain of each run in log predictive density (nats) when it is predicted by a fit to "
        "the others with the candidate in the model: right of zero the run supports it. An "
        "effect that only a single run supports is not accepted. Dark: the sum over all runs.",
        lambda width: draw_dots(gains, width, name),
        FigureData(
            "gain_by_run",
            {
                "run": [str(label) for label in labels],
                **{f"{candidate}_nats": list(gain) for candidate, gain in gains},
            },
        ),
    )


def draw_dots(gains: Sequence[tuple[str, Array]], width: float, name: str) -> str:
    """Draw a row of dots for each candidate."""
    texts = [cut_to_width(n, 0.4 * width) for n, _ in gains]
    left = 14.0 + max(text_width(t) for t in texts)
    top, row = 24.0, 30.0
    height = row * len(gains)
    drawing = Drawing(width, top + height + 44, f"Gain of every run of {name}")
    every = np.concatenate([g for _, g in gains])
    axes = Axes(
        drawing,
        (left, top, width - left - 74, height),
        axis_range([min(0.0, float(every.min())), max(1.0, float(every.max()))]),
        (0.0, 1.0),
    )
    axes.frame("gain of a run, nats", "", ticks=(max((width - left) / 90, 2), 0.0))
    for i, ((_, gain), text) in enumerate(zip(gains, texts, strict=True)):
        y = top + row * (i + 0.5)
        drawing.line((left, y, width - 74, y), GRID)
        places = [(float(axes.x(g)), y + 6.0 * ((k % 3) - 1)) for k, g in enumerate(gain)]
        drawing.dots(places, 3.4, BLUE, PAPER, 0.7)
        drawing.text(left - 8, y + 4.5, text, anchor="end")
        drawing.text(
            width - 8,
            y + 4,
            signs(f"{gain.sum():+.1f}"),
            anchor="end",
            size=SMALL_SIZE,
            weight="600",
        )
    return drawing.render()


def alike_figure(step: Step, name: str) -> Figure | None:
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
    return Figure(
        "Which effects are confounded in these runs",
        "Angle in degrees between the contributions of two effects, after removing what the "
        "baseline model and the run-to-run scatter absorb: 90 means independent, below "
        f"{rules.TWIN_DEG:g} runs like these do not separate them, however many there are. The "
        "strongest "
        f"{len(chosen)} are shown.",
        lambda width: draw_alike([words(n) for n in chosen], angle, width, name),
        FigureData(
            "angles",
            {
                "effect": [chosen[i] for i, _ in pairs],
                "other": [chosen[j] for _, j in pairs],
                "angle_deg": [float(angle[i, j]) for i, j in pairs],
            },
        ),
    )


def draw_alike(names: Sequence[str], angle: Array, width: float, name: str) -> str:
    """Draw the lower triangle of the angles."""
    numbered = width < 600
    texts = [f"{i + 1} {cut_to_width(n, 150)}" for i, n in enumerate(names)]
    left = 14.0 + max(text_width(t) for t in texts)
    cell = min((width - left - 12) / max(len(names) - 1, 1), 58.0)
    tall = min(cell, 30.0)
    top = 10.0
    drawing = Drawing(
        width, top + tall * len(names) + 26, f"Angles between effects in the runs of {name}"
    )
    for i in range(len(names)):
        y = top + tall * i
        drawing.text(left - 8, y + tall / 2 + 4.5, texts[i], anchor="end")
        for j in range(i):
            x = left + cell * j
            share = 1.0 - min(angle[i, j], 90.0) / 90.0
            close = angle[i, j] < rules.TWIN_DEG
            fill = ORANGE if close else _mix(share)
            drawing.rectangle(x + 1, y + 1, cell - 2, tall - 2, fill)
            drawing.text(
                x + cell / 2,
                y + tall / 2 + 4,
                f"{angle[i, j]:.0f}",
                anchor="middle",
                size=SMALL_SIZE if not numbered else 10.0,
            )
    for j in range(len(names) - 1):
        drawing.text(
            left + cell * (j + 0.5),
            top + tall * len(names) + 12,
            str(j + 1),
            anchor="middle",
            size=SMALL_SIZE,
            fill=SOFT,
        )
    return drawing.render()


def _mix(share: float) -> str:
    return "#" + "".join(f"{round(250 - share * (250 - c)):02x}" for c in (119, 170, 221))


def shape_figure(step: Step, name: str) -> Figure | None:
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
    place = np.clip(np.searchsorted(edges, values, "right") - 1, 0, bins - 1)
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
    return Figure(
        f"The residual depends on {words(chosen.candidate.covariate)}",
        f"Of the form “{with_signs(chosen.candidate.shape)}”: the fitted shape (line), the "
        "mean residual of the baseline model (dots), twice its standard error from the "
        "scatter between runs "
        "(band). Where the shape acts on stiffness, friction or gap, the line is its mean effect "
        "on the lost motion.",
        lambda width: draw_shape(middle, line, mean, half, label, width, name),
        FigureData(
            "shape",
            {
                label: list(middle),
                "shape_arcsec": list(line),
                "mean_residual_arcsec": list(mean),
                "twice_standard_error_arcsec": list(half),
            },
        ),
    )


def error_of_means(values: Array, place: IntArray, run_of: IntArray, bins: int) -> Array:
    """Standard error of the mean of every bin, from the scatter of the run means."""
    runs = int(run_of.max()) + 1
    cell = place * runs + run_of
    count = np.bincount(cell, minlength=bins * runs).reshape(bins, runs)
    mean = np.bincount(cell, values, bins * runs).reshape(bins, runs) / np.maximum(count, 1)
    seen = np.maximum((count > 0).sum(axis=1), 1)
    centre = np.where(count > 0, mean, 0.0).sum(axis=1) / seen
    square = np.where(count > 0, (mean - centre[:, None]) ** 2, 0.0).sum(axis=1)
    return np.asarray(np.sqrt(square / np.maximum(seen - 1, 1) / seen))


def covariate_of(base: Any, covariate: str) -> tuple[Array, str] | None:
    """Values of a covariate of a shape, with the unit for the axis."""
    c = base.conditions
    if covariate in ("input_angle", "output_angle"):
        return np.degrees(np.mod(c.columns[f"{covariate}_rad"], 2 * np.pi)), "°"
    if covariate == "run":
        return base.conditions.run_of + 1.0, "in order"
    units = {"torque": "N·m", "temperature": "°C", "speed": "rad/s", "time": "s"}
    found: Mapping[str, Array] = channels(base)
    return (found[covariate], units.get(covariate, "")) if covariate in found else None


def draw_shape(
    x: Array, line: Array, mean: Array, half: Array, label: str, width: float, name: str
) -> str:
    """Draw the shape over the means and their band."""
    height = 260.0 if width > 600 else 210.0
    drawing = Drawing(width, height + 84, f"Shape of the residual in the runs of {name}")
    every = np.concatenate((mean - half, mean + half, line))
    axes = Axes(
        drawing,
        (52.0, 34.0, width - 66.0, height),
        axis_range([float(x.min()), float(x.max())], 0.02),
        axis_range([float(every.min()), float(every.max())]),
    )
    axes.frame(label, "arcsec")
    axes.open()
    axes.band(x, mean - half, mean + half, "#77aadd", 0.45)
    drawing.dots(axes.points(x, mean).tolist(), 2.0, ORANGE)
    axes.curve(x, line, INK, 1.6)
    axes.close()
    return drawing.render()
