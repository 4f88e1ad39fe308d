"""The commands of discovery: diagnose, merge, fit, effects, check, forecast, next."""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.commands.inputs import protocol_of, read_inputs
from lostmotion.discover.advice import count_runs
from lostmotion.discover.answer import Diagnosis
from lostmotion.discover.common_columns import gather_body
from lostmotion.discover.diagnosis import diagnose
from lostmotion.discover.events import dependence
from lostmotion.discover.fitted_model import FittedModel, fit_model
from lostmotion.discover.forecast import forecast
from lostmotion.discover.merged_verdict import judge_body
from lostmotion.discover.next_run import next_runs
from lostmotion.discover.plan_file import read_plan
from lostmotion.discover.recording_check import check
from lostmotion.drives import Drive, format_toml, read_drive
from lostmotion.effects.effect import Effect, card, find_effect
from lostmotion.effects.library import library
from lostmotion.effects.template import template
from lostmotion.errors import InputError
from lostmotion.evidence.file import load_body
from lostmotion.evidence.merging import merge_bodies
from lostmotion.evidence.sign_flips import runs_least
from lostmotion.files import write_whole
from lostmotion.fit.forms import friction_form
from lostmotion.friction import FORMS, WORDS, Friction
from lostmotion.model import make_torsion_curve
from lostmotion.options import effects_of, ratio_of
from lostmotion.recordings import (
    Campaign,
    Finding,
    parse_map,
    read_campaign,
    recording_files,
    say_findings,
)
from lostmotion.recordings.findings import RUNS_LISTED
from lostmotion.recordings.gate import check_encoders
from lostmotion.recordings.ratio import estimate_ratio
from lostmotion.recordings.soundness import STUCK_TURN_RAD
from lostmotion.report import diagnosis_section, fit_section, write_report
from lostmotion.report.discovery import verdict_sentence
from lostmotion.report.wording import (
    AT_BOUND,
    NOISE_FLOOR,
    NOISE_FLOOR_IS,
    NOT_FITTED,
    TOO_SMALL,
    confounded_with,
    event_text,
)
from lostmotion.terminal import Progress, deliver, show_findings
from lostmotion.threads import one_thread
from lostmotion.units import plain_number


def run_diagnose(arguments: argparse.Namespace) -> None:
    """``lostmotion diagnose``."""
    drive, result, findings = diagnosis_of(arguments)
    if arguments.save_evidence is not None:
        result.need_selection("--save-evidence")
    if arguments.report is not None:
        with one_thread():
            section = diagnosis_section(drive, result, recording_files(arguments.data))
        lead = "Which physical effect the recordings show that the model of the drive lacks."
        write_report(
            arguments.report, "Diagnosis of lost motion", lead, [section], arguments.command_line
        )
    if arguments.save_evidence is not None:
        with one_thread():
            body = gather_body(result, effects_of(arguments), drive.ratio)
        body.save(arguments.save_evidence)
    answer = {**result.answer(), "findings": findings}
    deliver(answer, arguments, lambda: show_diagnosis(answer))


def run_merge(arguments: argparse.Namespace) -> None:
    """``lostmotion merge``."""
    with one_thread():
        bodies = [load_body(file) for file in arguments.evidence]
        answer = judge_body(merge_bodies(bodies, arguments.evidence), effects_of(arguments))
    deliver(answer, arguments, lambda: show_diagnosis(answer))


def diagnosis_of(arguments: argparse.Namespace) -> tuple[Drive, Diagnosis, list[str]]:
    """Diagnose the recordings that the arguments name."""
    effects = effects_of(arguments)
    drive, campaign, torsion_curve = read_inputs(arguments)
    with Progress("diagnosing", quiet=arguments.quiet) as bar:
        result = diagnose(
            drive,
            campaign,
            torsion_curve=torsion_curve,
            effects=effects,
            friction=getattr(arguments, "friction", None),
            progress=bar,
        )
    return drive, result, say_findings(campaign.findings)


def run_fit(arguments: argparse.Namespace) -> None:
    """``lostmotion fit``."""
    effects = effects_of(arguments)
    drive, campaign, torsion_curve = read_inputs(arguments)
    with Progress("fitting", quiet=arguments.quiet) as bar:
        model = fit_model(
            drive,
            campaign,
            arguments.add,
            torsion_curve=torsion_curve,
            effects=effects,
            friction=arguments.friction,
            progress=bar,
        )
    if arguments.report is not None:
        with one_thread():
            section = fit_section(drive, model, recording_files(arguments.data))
        lead = "The model of a drive fitted to its recordings, with the effects that were added."
        write_report(
            arguments.report, "Fitted lost motion", lead, [section], arguments.command_line
        )
    write_whole(arguments.output, format_toml(model.document(drive)))
    answer = {**model.answer(), "findings": say_findings(campaign.findings)}
    deliver(answer, arguments, lambda: show_fit(model, arguments.output))


def run_effects(arguments: argparse.Namespace) -> None:
    """``lostmotion effects``."""
    words = arguments.name
    if words and words[0] == "new":
        if len(words) != 2:
            raise InputError("effects new", "", "no name", "one name, e.g. effects new cable_pull")
        files = template(words[1], in_c=arguments.c)
        for file in files:
            if Path(file).exists():
                raise InputError(file, "", "a file that exists", "a new name")
        for file, text in files.items():
            write_whole(file, text)
        answer: dict[str, Any] = {"schema": "lostmotion.template/1", "files": list(files)}
        deliver(answer, arguments, lambda: print("\n".join(files)))
        return
    effects = effects_of(arguments)
    if len(words) > 1:
        raise InputError("effects", words[1], "a second name", "one")
    chosen = [find_effect(words[0], effects)] if words else list(effects.values())
    answer = {"schema": "lostmotion.effects/1", "effects": [card(effect) for effect in chosen]}
    deliver(answer, arguments, lambda: show_effects(chosen, whole=bool(words)))


def run_check(arguments: argparse.Namespace) -> None:
    """``lostmotion check``."""
    stated = None if arguments.ratio is None else ratio_of(arguments.ratio)
    paths, mapping = arguments.data, parse_map(arguments.map)
    protocol = protocol_of(arguments)
    # With an infinite ratio the input angle has no influence, so the encoders are not compared.
    ratio = math.inf if stated is None else stated
    campaign = read_campaign(
        paths, ratio=ratio, mapping=mapping, protocol=protocol, join=arguments.join
    )
    found = stated
    known = stated is not None or not any(np.ptp(angle) > 0 for angle in input_angles(campaign))
    if not known:
        found = estimate_ratio(campaign)
        if found is not None:
            campaign = read_campaign(
                paths, ratio=found, mapping=mapping, protocol=protocol, join=arguments.join
            )
        campaign.findings = [f for f in campaign.findings if not in_doubt(f, campaign, found)]
    else:
        check_encoders(campaign, stated)
    answer = {**check(campaign, library()), "ratio_known": known}
    if not known and found is None:
        answer["lost_motion_arcmin"] = None
    deliver(answer, arguments, lambda: show_check(answer))


def input_angles(campaign: Campaign) -> list[FloatArray]:
    """Input angles of the runs that have both angles."""
    both = {"input_angle", "output_angle"}
    return [run.columns["input_angle"] for run in campaign.runs if both <= run.columns.keys()]


def in_doubt(finding: Finding, campaign: Campaign, ratio: float | None) -> bool:
    """Whether a finding needs a ratio that was not stated.

    A ratio estimated from the angles removes the sign of the lost motion. Without a ratio, an
    output that is at rest while the input turns may be locked.
    """
    if finding.kind in ("sign", "ratio"):
        return True
    turning = [
        run.label
        for run in campaign.runs
        if np.ptp(run.columns.get("input_angle", 0.0)) >= STUCK_TURN_RAD
    ]
    dead = (finding.kind, finding.column) == ("stuck", "output_angle_rad")
    return ratio is None and dead and finding.run in turning


def run_forecast(arguments: argparse.Namespace) -> None:
    """``lostmotion forecast``."""
    drive = read_drive(arguments.drive)
    mapping = {**drive.columns, **parse_map(arguments.map)}
    protocol = protocol_of(arguments, drive.protocol)
    plan = read_plan(arguments.data, drive.ratio, mapping, protocol)
    with one_thread():
        torsion_curve = make_torsion_curve(drive, plan.largest_torque_Nm)
        answer = forecast(drive, plan, torsion_curve, effects_of(arguments))
    deliver(answer, arguments, lambda: show_forecast(answer))


def run_next(arguments: argparse.Namespace) -> None:
    """``lostmotion next``."""
    drive = read_drive(arguments.drive)
    mapping = {**drive.columns, **parse_map(arguments.map)}
    protocol = protocol_of(arguments, drive.protocol)
    options = read_plan(arguments.plan, drive.ratio, mapping, protocol)
    drive, result, _ = diagnosis_of(arguments)
    with one_thread():
        ranking = next_runs(result, options, effects_of(arguments), drive.ratio)
    said = {key: result.answer()[key] for key in ("verdict", "effects", "runs")}
    answer = {**ranking, "diagnosis": said}
    deliver(answer, arguments, lambda: show_next(answer))


def show_diagnosis(answer: Mapping[str, Any]) -> None:
    """Print a diagnosis."""
    show_findings(answer.get("findings", []))
    print(verdict_sentence(answer))
    within = answer["noise"]["within_runs_arcsec"]
    print(
        f"\n{NOISE_FLOOR} {answer['noise_floor_arcsec']:.2f} arcsec, {within:.2f} within runs\n"
        f"({NOISE_FLOOR_IS})"
    )
    show_friction(answer.get("friction", FORMS[0]))
    for rung in answer["ladder"]:
        what = " + ".join(["baseline", *rung["effects"]])
        print(
            f"  {what:<48} {rung['rms_arcsec']:8.2f}  leave-one-run-out "
            f"{rung['rms_heldout_arcsec']:8.2f}"
        )
        show_conditions(rung, "    ")
    for part in answer.get("alone", ()):
        print(f"  {part['file']} alone: {verdict_sentence(part)}")
    steps = [dependence(event, 1)["shape"] for event in answer["events"]]
    for one in answer["unexplained"]["depends_on"]:
        if one["shape"] not in steps:
            print(f"depends on {one['covariate']}: {one['shape']} (p = {one['p']:.2g})")
            if "formula" in one:
                print(f'  to fit it: fit --add "{one["formula"]}"')
    for event in answer["events"]:
        print(f"sudden: {event_text(event)}")
    for one in answer["unexplained"]["depends_on"]:
        if one["shape"] in steps and "formula" in one:
            print(f'  to fit it: fit --add "{one["formula"]}"')
    print("\nstrongest candidates:")
    for candidate in [c for c in answer["candidates"] if c["testable"]][:5]:
        others = ", ".join(confounded_with(candidate))
        notes = [f"confounded with {others}"] if others else []
        if candidate.get("too_small"):
            notes.append(f"{candidate['size_arcsec']:.2g} arcsec, {TOO_SMALL}")
        print(
            f"  {candidate['name']:<26} {candidate['evidence']:10.1f} nats  p = "
            + "  ".join([f"{candidate['p']:.2g}", *notes])
        )
    for candidate in answer["candidates"]:
        if candidate["name"] not in answer["effects"]:
            continue
        for name, size in candidate["parameters"].items():
            if name in candidate.get("not_fitted", ()):
                known = f", {NOT_FITTED}"
            elif name in candidate.get("at_bound", ()):
                known = f", {AT_BOUND}"
            elif "standard_errors" in candidate:
                if name not in candidate["standard_errors"]:
                    continue
                known = f" +- {candidate['standard_errors'][name]:.2g}"
            else:
                known = ""
            print(f"  {candidate['name']}.{name} = {size:.5g}{known}")
    print(f"\nnext: {answer['next_experiment']}")


def show_fit(model: FittedModel, file: str) -> None:
    """Print how the error fell."""
    show_findings(say_findings(model.base.conditions.campaign.findings))
    for rung in model.ladder:
        what = " + ".join(["baseline", *rung["effects"]])
        print(
            f"{what:<48} {rung['rms_arcsec']:8.2f} arcsec  leave-one-run-out "
            f"{rung['rms_heldout_arcsec']:8.2f}"
        )
        show_conditions(rung, "  ")
    print(
        f"{NOISE_FLOOR:<48} {model.noise_floor_arcsec:8.2f} arcsec  within runs "
        f"{model.within_runs_arcsec:4.2f}\n({NOISE_FLOOR_IS})"
    )
    show_friction(friction_form(model.base))
    print()
    held = model.not_fitted()
    bound = {name: value for name, value in model.at_bound().items() if name not in held}
    for name, value, error in zip(model.names, model.values, model.standard_errors, strict=True):
        if "." in name and name not in bound:
            print(f"{name:<48} {value:.5g} +- {error:.2g}")
    for name, value in bound.items():
        print(f"{name:<48} {value:.5g}, {AT_BOUND}: export requires --force")
    for name, value in held.items():
        print(f"{name:<48} {value:.5g}, {NOT_FITTED}")
    for name, one in model.tested.items():
        if not one.significant:
            print(f"not significant: {name} (p = {one.p:.2g})")
    for pair in model.inseparable:
        print(f"these recordings do not separate {pair[0]} and {pair[1]}")
    print(f"\nwritten: {file}")


def show_friction(form: Friction) -> None:
    """Print the form of the hysteresis, if it is not the first to be tried."""
    if form != FORMS[0]:
        print(f"baseline model with friction {WORDS[form]}")


def show_conditions(rung: Mapping[str, Any], indent: str) -> None:
    """Print details of a rung: errors by condition, gain, settings with a larger error."""
    by = rung.get("heldout_by_condition", {})
    if by:
        parts = [
            f"{name} {one['rms_heldout_arcsec']:.2f}{extrapolated(name, one['settings'])}"
            for name, one in by.items()
        ]
        print(f"{indent}leave-one-condition-out: {', '.join(parts)}")
    if "gain_arcsec" in rung:
        low, high = rung["gain_interval_arcsec"]
        said = f"{indent}gain {rung['gain_arcsec']:.2f} arcsec ({low:.2f} to {high:.2f})"
        if "confidence" in rung:
            said += f", confidence {confidence_text(rung['confidence'])}"
        if rung.get("rivals"):
            said += f"; confounded with {', '.join(rung['rivals'])}"
        print(said)
    for one in rung.get("harms", ()):
        print(
            f"{indent}worse at {one['setting']}: {one['rms_heldout_arcsec_before']:.2f} to "
            f"{one['rms_heldout_arcsec']:.2f} arcsec, predicted from the other settings"
        )


OWN_RANGE = {"amplitude": "torque", "temperature": "temperature", "speed": "speed"}
"""Range that a condition itself exceeds if one of its settings is left out."""


def extrapolated(condition: str, settings: Sequence[Mapping[str, Any]]) -> str:
    """Describe how far beyond the fitted range the settings of a condition are predicted."""
    own = OWN_RANGE.get(condition)
    far = [one["beyond_fitted_range"].get(own) for one in settings]
    most = max((times for times in far if times is not None), default=None)
    return "" if most is None else f" (up to {most:.2g} times the fitted range)"


def confidence_text(confidence: float) -> str:
    """Write a confidence, 1 - p over all candidates, in per cent."""
    return "> 99.99 %" if confidence > 0.9999 else f"{100 * confidence:.2f} %"


def show_effects(effects: list[Effect], *, whole: bool) -> None:
    """Print effects: one line each, or all about one."""
    for effect in effects:
        if not whole:
            print(f"{effect.name:<26} {effect.mechanism}")
            continue
        print(f"{effect.name}: {effect.mechanism}\n\n  {effect.equation}\n")
        for v in effect.values:
            print(
                f"  {v.name:<28} {v.role:<7} typical {v.typical:.3g}, {v.low:.3g} to {v.high:.3g}"
            )
        print(f"\ntypical: {effect.typical_size}")
        print(f"needs: {', '.join(sorted(effect.needs))}")
        print(f"confounded with: {', '.join(effect.confused_with) or 'nothing known'}")
        print(f"separated by: {effect.experiment}")


def show_check(answer: Mapping[str, Any]) -> None:
    """Print the faults of recordings and the effects that they cannot identify."""
    swing = answer["lost_motion_arcmin"]
    lost = "" if swing is None else f", lost motion within {swing:.3g} arcmin"
    torque = f"torque up to {answer['largest_torque_Nm']:.3g} Nm"
    print(f"{count_runs(answer['runs'])}, {answer['samples']} samples, {torque}{lost}")
    for finding in answer["findings"] or ["no findings"]:
        print(f"  {finding}")
    if not answer["ratio_known"]:
        print("the sign of the lost motion was not checked: state --ratio")
    show_runs_lacking(answer)
    elsewhere = [str(label) for label in answer["begin_elsewhere"]]
    if elsewhere:
        shown = ", ".join(elsewhere[:RUNS_LISTED]) + (" ..." * (len(elsewhere) > RUNS_LISTED))
        print(
            f"{len(elsewhere)} of {answer['runs']} runs begin at a torque other than the last of "
            f"the previous run: {shown}\n  The torque is assumed to have ramped monotonically "
            "between runs; any other load between them looks like a sudden step."
        )
    for pair in answer["aliased"]:
        a, b = pair["columns"]
        print(f"{a} and {b} change together ({pair['rank_correlation']:+.2f}): vary one alone")
    for name, why in answer["not_testable"].items():
        print(f"{name}: {why}")


def show_runs_lacking(answer: Mapping[str, Any]) -> None:
    """Print a note if there are too few runs to identify an effect."""
    if not answer["enough_runs"]:
        print(f"fewer than {runs_least()} runs: diagnose cannot identify an effect")


def show_forecast(answer: Mapping[str, Any]) -> None:
    """Print a forecast."""
    show_runs_lacking(answer)
    print("smallest size of each effect that this plan would detect, with its error at the output:")
    for effect in answer["effects"]:
        if effect["testable"]:
            print(
                f"{effect['name']:<26} {effect['parameter']} from {effect['value']:.3g}"
                f"{'' if effect['unit'] == '-' else ' ' + effect['unit']} "
                f"({effect['rms_arcsec']:.2f} arcsec rms)"
            )
        else:
            print(f"{effect['name']:<26} {effect['reason']}")
    for pair in answer["confusable"]:
        a, b = pair["effects"]
        how = "hard to separate" if pair["separable"] else "cannot be separated"
        print(f"{a} and {b}: {how} ({pair['angle_deg']:.0f} deg)")


def show_next(answer: Mapping[str, Any]) -> None:
    """Print the ranking of runs."""
    print(verdict_sentence(answer["diagnosis"]))
    print("\nto decide between " + ", ".join(answer["between"]))
    print("expected evidence; 1 nat is a likelihood ratio of 2.7:")
    for run in answer["runs"]:
        print(
            f"  run {run['run']}: {plain_number(run['separation_nats'])} nats, "
            f"{plain_number(run['per_minute'])} a minute"
        )
