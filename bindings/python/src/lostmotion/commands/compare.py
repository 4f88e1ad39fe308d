"""The command ``lostmotion compare``."""

from __future__ import annotations

import argparse
from typing import Any

from lostmotion import units
from lostmotion.characterize.printed import NAMES, cells, flat
from lostmotion.commands.inputs import read_inputs
from lostmotion.compare import REPEATABILITY, Comparison, compare
from lostmotion.fit.drive_file import SAMPLES_LEAST
from lostmotion.fit.fitted_range import in_words
from lostmotion.friction import WORDS
from lostmotion.options import effects_of, whole_number
from lostmotion.recordings import QUANTITIES, recording_files
from lostmotion.report.wording import CROSS_VALIDATED, event_text, explained_text
from lostmotion.terminal import Progress, deliver, fixed, show_findings, show_table
from lostmotion.units import plain_number

SEED_MAX = 2**63 - 1
"""Largest seed of anything random."""


def run_compare(arguments: argparse.Namespace) -> None:
    """``lostmotion compare``."""
    seed = whole_number("--seed", arguments.seed, 0, SEED_MAX)
    drive, campaign, _ = read_inputs(arguments)
    with Progress("comparing", quiet=arguments.quiet) as progress:
        result = compare(
            drive,
            campaign,
            effects=effects_of(arguments),
            fit_on=None if arguments.fit_on is None else arguments.fit_on.split(","),
            friction=arguments.friction,
            seed=seed,
            progress=progress,
        )
    if arguments.report is not None:
        from lostmotion.report import comparison_section, write_report

        lead = "Recordings against the model of their drive: where it fits and where it fails."
        section = comparison_section(drive, result, recording_files(arguments.data))
        write_report(
            arguments.report, "Measured lost motion", lead, [section], arguments.command_line
        )
    deliver(result.answer(), arguments, lambda: show_comparison(result))


def show_comparison(result: Comparison) -> None:
    """Print a comparison."""
    answer = result.answer()
    show_findings(answer["findings"])
    unit = "arcsec" if answer["unfitted_rms_arcsec"] < 600 else "arcmin"
    scale = 1.0 if unit == "arcsec" else units.ARCSEC / units.ARCMIN

    def shown(value: float) -> str:
        return f"{value * scale:.2f} {unit}"

    print(f"data-sheet model    {shown(answer['unfitted_rms_arcsec'])}")
    if answer["samples"] < SAMPLES_LEAST:
        show_few(result, answer, scale, unit)
        return
    explains = explained_text(answer)
    print(
        f"fitted              {shown(answer['rms_arcsec'])}  (explains {explains} of the variance)"
    )
    if answer["heldout_by"] == "runs not fitted":
        print(f"predicted           {shown(answer['heldout_rms_arcsec'])}")
        if far := in_words(answer["beyond_fitted_range"]):
            print(f"  (beyond: {far})")
        if answer["least_amplitude_ratio"] < 1.0:
            print(
                f"  (loops of {answer['least_amplitude_ratio']:.2g} times the smallest fitted "
                "amplitude)"
            )
    else:
        held = CROSS_VALIDATED[answer["heldout_by"]]
        print(f"{held:<19} {shown(answer['heldout_rms_arcsec'])}")
    print(f"{REPEATABILITY:<19} {shown(answer['noise_floor_arcsec'])}  ({result.noise.parts})")
    print(f"\nfriction {WORDS[answer['friction']]}; cross-validated:", end="")
    for name, errors in answer["frictions"].items():
        print(f"  {name} {shown(errors['heldout_rms_arcsec'])}", end="")
    print("\n\nerror by run:")
    rows = [
        [
            str(run["run"]) + ("" if run["fitted"] else " *"),
            fixed(run["rms_arcsec"] * scale, 2),
            fixed(run["width_at_zero_arcmin"], 3),
            fixed(run["model_width_at_zero_arcmin"], 3),
            str(run["samples"]),
        ]
        for run in answer["by_run"]
    ]
    head = ["run", f"rms {unit}", "width at 0 Nm, arcmin", "of the model", "samples"]
    show_table(head, rows)
    if not all(run["fitted"] for run in answer["by_run"]):
        print("* predicted, not fitted")
    print("\nwhere it fails:")
    rows = [
        [failure["covariate"], f"{100 * failure['share']:.1f} %", f"{failure['p']:.4f}"]
        for failure in answer["where_it_fails"]
    ]
    show_table(["covariate", "share", "p"], rows)
    for event in answer["events"]:
        print(f"sudden: {event_text(event)}")
    if answer["not_testable"]:
        print("\nnot testable with these columns:")
        for column, effects in answer["not_testable"].items():
            name = QUANTITIES[column].column if column in QUANTITIES else column
            print(f"  without {name}: {', '.join(effects)}")


def show_few(result: Comparison, answer: dict[str, Any], scale: float, unit: str) -> None:
    """Print a comparison of few readings: the values that they determine, with intervals."""

    def shown(arcsec: float) -> str:
        return f"{plain_number(arcsec * scale, 2)} {unit}"

    samples = answer["samples"]
    if result.few is None:
        print(f"  (explains {explained_text(answer)} of the variance)")
        few = f"{samples} sample{'s' if samples > 1 else ''}"
        print(f"{few} cannot be fitted: at least {SAMPLES_LEAST}; only the first line is valid")
    else:
        print(
            f"fitted              {shown(answer['rms_arcsec'])}  "
            f"({answer['values']} values from {samples} readings)"
        )
        print(f"leave-one-out       {shown(answer['heldout_rms_arcsec'])}")
        print(f"error of a reading  {shown(answer['noise_floor_arcsec'])}")
        print("  (standard deviation, from the residual)\n")
        figures = flat(answer["standard_figures"]["measured"])
        rows = [
            [NAMES[key], *cells(found)]
            for key, found in figures.items()
            if found["value"] is not None
        ]
        show_table(["figure", "measured", "standard error", "95 %"], rows)
    print("\nToo few samples to determine where the model fails.")
