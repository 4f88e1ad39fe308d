"""What a report says of a diagnosis and of a fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from lostmotion.discover.backbone import Base
from lostmotion.discover.diagnosis import Diagnosis
from lostmotion.discover.ladder import FittedModel
from lostmotion.drives import Drive
from lostmotion.report.evidence import alike_figure, dots_figure, shape_figure
from lostmotion.report.ladder import ladder_figure
from lostmotion.report.overlay import overlay_figure
from lostmotion.report.page import Figure, Notes, Rows, Section
from lostmotion.report.residual_grids import grids_figure
from lostmotion.report.sources import sources_of
from lostmotion.report.svg import signs
from lostmotion.report.wording import (
    chance,
    grouped,
    quantities,
    split_quantity,
    unit_text,
    words,
    written,
)

CANDIDATES_SHOWN = 12
"""Candidates in the table; the JSON answer has all."""

VALUES_SHOWN = 3
"""Values of a candidate in the table."""

REFIT_STEPS = 8
"""Evaluations of the refit without deviations of single runs."""


def verdict_sentence(answer: Mapping[str, Any]) -> str:
    """Say in one sentence what a diagnosis found."""
    names = ", ".join(answer["effects"])
    sentence = {
        "complete": "Nothing is missing beyond the noise.",
        "missing-effect": f"Missing: {names}.",
        "ambiguous": f"These data cannot tell apart: {names}.",
        "unexplained": "Something systematic remains that no effect of the library explains.",
    }
    return sentence[answer["verdict"]]


def without_deviations(base: Base) -> Base:
    """Refit a base for all runs together, as a drive file would hold it."""
    plain = base.copy()
    plain.deviations[:] = 0.0
    plain.fit(steps=REFIT_STEPS)
    return plain


def diagnosis_section(drive: Drive, found: Diagnosis, files: Sequence[str | Path]) -> Section:
    """Say what a diagnosis found, on what it rests, and what to do next."""
    answer = found.answer()
    selection = found.selection
    assert selection is not None
    before = without_deviations(selection.settled[0].base)
    added = len(selection.settled) > 1
    after = without_deviations(selection.settled[-1].base) if added else before
    floor = found.noise_floor_arcsec
    c = before.conditions
    last = answer["ladder"][-1]
    lead = verdict_sentence({**answer, "effects": map(words, answer["effects"])})
    for one in answer["unexplained"]["depends_on"]:
        lead += f" It depends on {words(one['covariate'])}: {one['shape']}."
    section = Section(
        f"{drive.name}: what is missing",
        lead,
        [
            ("verdict", answer["verdict"].replace("-", " ")),
            ("error of the base, rms", f"{answer['ladder'][0]['rms_arcsec']:.3g} arcsec"),
            ("with what was found, rms", f"{last['rms_arcsec']:.3g} arcsec"),
            ("on runs that the fit has not seen", f"{last['rms_heldout_arcsec']:.3g} arcsec"),
            ("noise floor", f"{floor:.3g} arcsec"),
            ("noise within runs", f"{answer['noise']['within_runs_arcsec']:.3g} arcsec"),
            ("samples", f"{grouped(str(answer['samples']))} in {answer['runs']} runs"),
        ],
        [],
        sources_of(drive, files, answer["data_fingerprint"]),
    )
    blocks = section.blocks
    blocks.append(Notes("What to do next", [answer["next_experiment"]]))
    blocks.append(ladder_figure(answer["ladder"], floor, drive.name))
    blocks.append(overlay_figure(before, after, floor, drive.name))
    residuals = [("base", before.residual())]
    if added:
        residuals.append(("added", after.residual()))
    blocks.append(grids_figure(c, residuals, floor, drive.name))
    blocks.append(_contest(answer))
    blocks.append(dots_figure(selection, c.labels, drive.name))
    figures: list[Figure | None] = [shape_figure(step, drive.name) for step in selection.steps]
    figures.append(alike_figure(selection.steps[0], drive.name))
    blocks += [figure for figure in figures if figure is not None]
    if answer["events"]:
        blocks.append(
            Rows(
                "Sudden changes",
                ("run", "at, s", "size, arcsec"),
                [
                    (str(e["run"]), f"{e['time_s']:.6g}", f"{e['size_arcsec']:.3g}")
                    for e in answer["events"]
                ],
                (1, 2),
            )
        )
    blocks.append(_detectable(answer))
    blocks.append(_scatter(answer))
    if answer["not_testable"]:
        lines = [f"{words(name)}: {why}" for name, why in answer["not_testable"].items()]
        blocks.append(Notes("Not testable with these recordings", lines, folded=True))
    findings = [str(finding) for finding in c.campaign.findings]
    if answer.get("outliers"):
        findings.append(f"{answer['outliers']} single wild samples set to their neighbours")
    if findings:
        blocks.append(Notes("About the data", findings))
    return section


def _contest(answer: dict[str, Any]) -> Rows:
    rows = []
    for candidate in [c for c in answer["candidates"] if c["testable"]][:CANDIDATES_SHOWN]:
        chosen = candidate["name"] in answer["effects"]
        known = quantities(candidate["parameters"])
        values = ", ".join(known[:VALUES_SHOWN])
        if len(known) > VALUES_SHOWN:
            values += " …"
        rows.append(
            (
                words(candidate["name"]) + (" ✓" if chosen else ""),
                signs(f"{candidate['evidence']:.1f}"),
                chance(candidate["p"]).removeprefix("p "),
                words(", ".join(candidate["confused_with"])) or "–",
                values if candidate["plausible"] else f"!{values} (implausible)",
            )
        )
    return Rows(
        "The contest",
        ("effect", "gain, nats", "p", "like", "values"),
        rows,
        (1, 2),
        "Gain: leave-one-run-out log predictive density over the base (of what was not chosen: "
        "over the last model). p: run-level F test after Bonferroni. ✓: in the answer. The JSON "
        "answer has all effects.",
    )


def _detectable(answer: dict[str, Any]) -> Rows:
    rows = [
        (words(name), *sized(d), f"{d['rms_arcsec']:.2f}")
        for name, d in sorted(
            answer["smallest_detectable"].items(), key=lambda item: item[1]["rms_arcsec"]
        )
    ]
    return Rows(
        "The smallest that would have been found",
        ("effect", "parameter", "smallest size", "", "rms, arcsec"),
        rows,
        (2, 4),
        "Size of each effect that these runs would show with a chance of 80 %.",
    )


def sized(detectable: Mapping[str, Any]) -> tuple[str, str, str]:
    """Write a smallest size in three cells: of which parameter, the number, its unit."""
    unit = detectable["unit"].replace(" ", "_").removeprefix("-")
    return words(detectable["parameter"]), written(detectable["value"]), unit_text(unit)


def _scatter(answer: dict[str, Any]) -> Rows:
    scatter = answer["noise"]["scatter"]
    rows = []
    for name, value in scatter.items():
        if name in ("stiffness", "friction"):
            rows.append((name, f"{100 * value:.2g} %"))
        else:
            rows.append((name.removesuffix("_arcsec"), f"{value:.3g} arcsec"))
    return Rows("Scatter from run to run", ("of", "standard deviation"), rows, (1,))


def _of_effect(key: str, value: float, error: float) -> tuple[str, ...]:
    effect, _, name = key.partition(".")
    return words(effect), *_named(name, value, error)


def _named(name: str, value: float, error: float) -> tuple[str, ...]:
    stem, factor, unit = split_quantity(name, value)
    known = written(factor * error, 2) if error else "given"
    return stem, written(factor * value, 4), known, unit


def fit_section(drive: Drive, model: FittedModel, files: Sequence[str | Path]) -> Section:
    """Say how the error fell with each effect that was added, and what the values are."""
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
        f"The error falls from {first['rms_arcsec']:.3g} to {last['rms_arcsec']:.3g} arcsec; on "
        f"runs that the fit has not seen it is {last['rms_heldout_arcsec']:.3g} arcsec. The noise "
        f"floor is {floor:.3g} arcsec.",
        [
            ("error of the base, rms", f"{first['rms_arcsec']:.3g} arcsec"),
            ("with effects, rms", f"{last['rms_arcsec']:.3g} arcsec"),
            ("on runs that the fit has not seen", f"{last['rms_heldout_arcsec']:.3g} arcsec"),
            ("noise floor", f"{floor:.3g} arcsec"),
            ("samples", f"{grouped(str(c.rows))} in {c.runs} runs"),
        ],
        [ladder_figure(model.ladder, floor, drive.name)],
        sources_of(drive, files, answer["data_fingerprint"]),
    )
    if not after.terms:
        before = after
    section.blocks.append(overlay_figure(before, after, floor, drive.name))
    residuals = [("base", before.residual())]
    if after.terms:
        residuals.append(("added", after.residual()))
    section.blocks.append(grids_figure(c, residuals, floor, drive.name))
    of_effects = [
        _of_effect(name, value, error)
        for name, value, error in zip(model.names, model.values, model.standard_errors, strict=True)
        if "." in name
    ]
    if of_effects:
        section.blocks.append(
            Rows(
                "Values of the effects",
                ("effect", "parameter", "value", "standard error", ""),
                of_effects,
                (2, 3),
            )
        )
    rest = [
        _named(name, value, error)
        for name, value, error in zip(model.names, model.values, model.standard_errors, strict=True)
        if "." not in name
    ]
    if model.inseparable:
        lines = [f"{a} and {b}" for a, b in model.inseparable]
        section.blocks.append(Notes("Not separated by these recordings", lines))
    section.blocks.append(
        Rows(
            f"Values of the base: {len(rest)}",
            ("parameter", "value", "standard error", ""),
            rest,
            (1, 2),
            folded=True,
        )
    )
    return section
