"""Report sections of a diagnosis and of a fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from lostmotion.discover.advice import count_runs
from lostmotion.discover.answer import Diagnosis
from lostmotion.discover.conclusion import INCONCLUSIVE
from lostmotion.discover.fitted_model import FittedModel
from lostmotion.drives import Drive
from lostmotion.evidence.sign_flips import runs_least
from lostmotion.fit.drive_file import SAMPLES_LEAST
from lostmotion.fit.forms import friction_form
from lostmotion.friction import WORDS
from lostmotion.recordings import say_findings
from lostmotion.report.charts import Chart, plots_of
from lostmotion.report.evidence import alike_figure, dots_figure, gains_of, shape_figure
from lostmotion.report.ladder import ladder_figure
from lostmotion.report.overlay import overlay_figure
from lostmotion.report.page import Notes, PageTable, Section
from lostmotion.report.residual_grids import grids_figure
from lostmotion.report.sources import sources_of
from lostmotion.report.svg import signs
from lostmotion.report.wording import (
    AT_BOUND,
    NOISE_FLOOR,
    NOT_FITTED,
    TOO_SMALL,
    chance,
    confounded_with,
    grouped,
    named_numbers,
    parameter,
    split_quantity,
    unit_text,
    with_signs,
    with_zeros,
    words,
    written,
)

CANDIDATES_SHOWN = 12
"""Largest number of candidates in the table; the JSON answer has all."""

VALUES_SHOWN = 3
"""Largest number of values of a candidate in the table."""


def verdict_sentence(answer: Mapping[str, Any]) -> str:
    """Summarise a diagnosis in one sentence."""
    names = ", ".join(answer["effects"])
    runs = int(answer.get("runs", runs_least()))
    sentence = {
        INCONCLUSIVE: "Inconclusive: too few readings to identify an effect."
        if answer.get("samples", SAMPLES_LEAST) < SAMPLES_LEAST
        else f"Inconclusive: {count_runs(runs)}. At least {runs_least()} are needed to "
        "identify an effect.",
        "complete": "Nothing is missing beyond the noise.",
        "missing-effect": f"Missing: {names}.",
        "ambiguous": open_sentence(answer),
        "unexplained": (f"Missing: {names}; in addition, a" if names else "A")
        + " systematic residual remains that no effect of the library explains.",
    }
    return sentence[answer["verdict"]]


def open_sentence(answer: Mapping[str, Any]) -> str:
    """Describe what is certain, and which effects are confounded."""
    names = list(answer["effects"])
    rungs = answer.get("ladder", ())
    known = {r["effect"] for r in rungs if r.get("verdict") == "missing-effect"}
    sure = [name for name in names if name in known or name.lower().replace(" ", "_") in known]
    rest = ", ".join(name for name in names if name not in sure)
    if not sure:
        return f"Confounded in these data: {rest}."
    return f"Missing: {', '.join(sure)}. In addition, confounded: {rest}."


def diagnosis_section(drive: Drive, found: Diagnosis, files: Sequence[str | Path]) -> Section:
    """Describe the result of a diagnosis, its evidence, and the next step."""
    answer = found.answer()
    selection = found.selection
    before, after = found.models[0], found.models[-1]
    added = len(found.models) > 1
    floor = found.noise_floor_arcsec
    c = before.conditions
    lead = verdict_sentence({**answer, "effects": [*map(words, answer["effects"])]})
    for one in answer["unexplained"]["depends_on"]:
        lead += f" It depends on {words(one['covariate'])}: {with_signs(one['shape'])}."
    section = Section(
        f"{drive.name}: what is missing",
        lead,
        [
            ("verdict", answer["verdict"].replace("-", " ")),
            *_errors(
                answer["ladder"],
                "with the effects found, rms",
                floor,
                answer["noise"]["within_runs_arcsec"],
            ),
            ("friction", WORDS[friction_form(before)]),
            ("samples", f"{grouped(str(answer['samples']))} in {count_runs(answer['runs'])}"),
        ],
        [],
        sources_of(drive, files, answer["data_fingerprint"]),
    )
    blocks = section.blocks
    blocks.append(Notes("What to do next", [answer["next_experiment"]]))
    findings = say_findings(c.campaign.findings)
    if answer.get("outliers"):
        findings.append(f"{answer['outliers']} outlying samples replaced by their neighbours")
    if findings:
        blocks.append(Notes("About the data", findings))
    blocks.append(ladder_figure(answer["ladder"], floor, drive.name))
    blocks.append(overlay_figure(before, after, floor, drive.name))
    if selection is None:  # few readings: no effect was tested
        return section
    residuals = [("baseline", before.residual())]
    if added:
        residuals.append(("added", after.residual()))
    blocks.append(grids_figure(c, residuals, floor, drive.name))
    blocks.append(_contest(answer))
    blocks.append(dots_figure(gains_of(selection), c.labels))
    figures: list[Chart | None] = [shape_figure(step) for step in selection.steps]
    figures.append(alike_figure(selection.steps[0]))
    blocks += [figure for figure in figures if figure is not None]
    if answer["events"]:
        blocks.append(
            PageTable(
                "Sudden changes",
                ("run", "at, s", "size, arcsec"),
                [
                    (str(e["run"]), f"{e['time_s']:.6g}", signs(with_zeros(e["size_arcsec"])))
                    for e in answer["events"]
                ],
                (1, 2),
            )
        )
    blocks.append(detectable_rows(answer))
    blocks.append(_scatter(answer))
    if answer["not_testable"]:
        lines = [f"{words(name)}: {why}" for name, why in answer["not_testable"].items()]
        blocks.append(Notes("Not testable with these recordings", lines, folded=True))
    return section


def _errors(
    ladder: Sequence[Mapping[str, Any]], with_effects: str, floor: float, within: float
) -> list[tuple[str, str]]:
    """Errors of a fit among the main results."""
    errors = (
        ("error of the baseline model, rms", ladder[0]["rms_arcsec"]),
        (with_effects, ladder[-1]["rms_arcsec"]),
        ("leave-one-run-out error, rms", ladder[-1]["rms_heldout_arcsec"]),
        (NOISE_FLOOR, floor),
        ("noise within runs", within),
    )
    return [(name, f"{with_zeros(value)} arcsec") for name, value in errors]


def _contest(answer: dict[str, Any]) -> PageTable:
    rows = []
    for candidate in [c for c in answer["candidates"] if c["testable"]][:CANDIDATES_SHOWN]:
        chosen = candidate["name"] in answer["effects"]
        known = named_numbers(
            candidate["parameters"], candidate.get("at_bound", ()), candidate.get("not_fitted", ())
        )
        values = ", ".join(known[:VALUES_SHOWN])
        if len(known) > VALUES_SHOWN:
            values += " …"
        if candidate.get("too_small"):
            values += f" ({with_zeros(candidate['size_arcsec'])} arcsec, {TOO_SMALL})"
        rows.append(
            (
                words(candidate["name"]) + (" ✓" if chosen else ""),
                signs(f"{candidate['evidence']:.1f}"),
                chance(candidate["p"]).removeprefix("p "),
                ", ".join(map(words, confounded_with(candidate))) or "–",
                values if candidate["plausible"] else f"!{values} (implausible)",
            )
        )
    return PageTable(
        "Candidate effects",
        ("effect", "gain, nats", "p", "confounded with", "values"),
        rows,
        (1, 2),
        "Gain: logarithm of the likelihood ratio when each run is predicted from the others (1 "
        "nat is a factor of 2.7), against the baseline model; for effects that were not "
        "selected, against the last model. p: permutation test, corrected for the number of "
        "effects. ✓: selected. A value at its bound would exceed it, or has little influence. "
        "An effect that is too small to count is significant, but smaller than the accuracy "
        "assumed of any model. The JSON answer has all effects.",
    )


def detectable_rows(answer: Mapping[str, Any]) -> PageTable:
    """Make the table of the smallest detectable sizes for the runs of a diagnosis."""
    untestable = {c["name"] for c in answer["candidates"] if not c["testable"]}
    sizes = {
        name: one for name, one in answer["smallest_detectable"].items() if name not in untestable
    }
    rows = [
        (words(name), *sized(one), f"{one['rms_arcsec']:.2f}")
        for name, one in sorted(sizes.items(), key=lambda item: item[1]["rms_arcsec"])
    ]
    said = "Size of each effect that these runs would identify with a probability of 80 %."
    without: dict[str, list[str]] = {}
    for name, why in answer.get("not_detectable", {}).items():
        without.setdefault(why, []).append(words(name))
    for why, names in without.items():
        said += f" {', '.join(names)}: {why}."
    return PageTable(
        "Smallest detectable size",
        ("effect", "parameter", "smallest size", "", "rms, arcsec"),
        rows,
        (2, 4),
        said,
    )


def sized(detectable: Mapping[str, Any]) -> tuple[str, str, str]:
    """Write a smallest size in three cells: parameter, number, unit."""
    unit = detectable["unit"].replace(" ", "_").removeprefix("-")
    return parameter(detectable["parameter"]), written(detectable["value"]), unit_text(unit)


def _scatter(answer: dict[str, Any]) -> PageTable:
    scatter = answer["noise"]["scatter"]
    rows = []
    for name, value in scatter.items():
        if name in ("stiffness", "friction"):
            rows.append((name, f"{with_zeros(100 * value, 2)} %"))
        else:
            rows.append((name.removesuffix("_arcsec"), f"{with_zeros(value)} arcsec"))
    return PageTable("Scatter from run to run", ("of", "standard deviation"), rows, (1,))


def _of_effect(key: str, value: float, known: str, error: float) -> tuple[str, ...]:
    effect, _, name = key.partition(".")
    return words(effect), *_named(name, value, known, error)


def _named(name: str, value: float, known: str, error: float) -> tuple[str, ...]:
    stem, factor, unit = split_quantity(name, value)
    if error:
        known = f"± {written(factor * error, 2)}"
    return stem, written(factor * value, 4), known, unit


def fit_section(drive: Drive, model: FittedModel, files: Sequence[str | Path]) -> Section:
    """Describe the error after each added effect, and the values."""
    after = model.base
    before = after.copy()
    before.terms, before.additives = [], []
    if after.terms:
        before.fit()
    c = after.conditions
    floor = model.noise_floor_arcsec
    first, last = model.ladder[0], model.ladder[-1]
    answer = model.answer()
    names = [words(term.effect.name) for term in after.terms]
    section = Section(
        f"{drive.name}: fitted" + (f" with {', '.join(names)}" if names else ""),
        f"The error falls from {with_zeros(first['rms_arcsec'])} "
        f"to {with_zeros(last['rms_arcsec'])} arcsec; the leave-one-run-out error is "
        f"{with_zeros(last['rms_heldout_arcsec'])} arcsec. The noise floor is {with_zeros(floor)} "
        "arcsec.",
        [
            *_errors(model.ladder, "with effects, rms", floor, model.within_runs_arcsec),
            ("friction", WORDS[friction_form(after)]),
            ("samples", f"{grouped(str(c.rows))} in {count_runs(c.runs)}"),
        ],
        [ladder_figure(model.ladder, floor, drive.name)],
        sources_of(drive, files, answer["data_fingerprint"]),
    )
    if not after.terms:
        before = after
    section.blocks.append(overlay_figure(before, after, floor, drive.name))
    residuals = [("baseline", before.residual())]
    if after.terms:
        residuals.append(("added", after.residual()))
    section.blocks.append(grids_figure(c, residuals, floor, drive.name))
    section.blocks += plots_of(model)
    held = model.not_fitted()
    bound = {name: value for name, value in model.at_bound().items() if name not in held}
    fitted = list(zip(model.names, model.values, model.standard_errors, strict=True))
    of_effects = [
        _of_effect(name, value, "", error)
        for name, value, error in fitted
        if "." in name and name not in bound
    ]
    of_effects += [_of_effect(name, value, AT_BOUND, 0.0) for name, value in bound.items()]
    of_effects += [_of_effect(name, value, NOT_FITTED, 0.0) for name, value in held.items()]
    if of_effects:
        section.blocks.append(
            PageTable(
                "Values of the effects",
                ("effect", "parameter", "value", "± standard error", ""),
                of_effects,
                (2,),
                "At its bound: the best fit is beyond the bound, or the value has little influence "
                "on these recordings."
                if bound
                else "",
            )
        )
    rest = [_named(name, value, "given", error) for name, value, error in fitted if "." not in name]
    if model.inseparable:
        lines = [f"{a} and {b}" for a, b in model.inseparable]
        section.blocks.append(Notes("Not separated by these recordings", lines))
    section.blocks.append(
        PageTable(
            f"Values of the baseline model: {len(rest)}",
            ("parameter", "value", "± standard error", ""),
            rest,
            (1,),
            folded=True,
        )
    )
    return section
