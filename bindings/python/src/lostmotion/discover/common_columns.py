"""Collect the evidence of a campaign in columns with the same meaning in every campaign.

All columns are scaled by the rated torque of the drive and by fixed units, not by the range of the
recordings. Each campaign is linearised at its own baseline model, fitted together with the effects
found: without them, the baseline model and its derivatives would be biased by what is missing. The
initial states of the operators belong to one campaign and are removed, as are the sudden steps
found in it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from lostmotion.candidates.candidate import Candidate
from lostmotion.candidates.named import tangent
from lostmotion.candidates.shapes import ANGLE_ORDERS, channels, legendre, varying_parts
from lostmotion.discover.answer import Diagnosis
from lostmotion.discover.contest_round import make_round, swing_by_run
from lostmotion.discover.form_variance import largest_model, mark_of_form, with_form_error
from lostmotion.discover.gates import judge_all
from lostmotion.discover.linearise import Settled, columns_of, settle
from lostmotion.discover.terms import term_size
from lostmotion.effects.columns import NO_COLUMN, missing_columns
from lostmotion.effects.conditions import side_by_side
from lostmotion.effects.effect import Effect
from lostmotion.evidence.file import Body
from lostmotion.evidence.gram import Evidence, gather
from lostmotion.evidence.noise import Noise
from lostmotion.evidence.shared_error import without_columns, without_shared
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.hysteresis import PLAY_RANGE, PLAYS
from lostmotion.fit.segmented_curve import KNOT_RANGE, KNOTS

TORQUE_WAVES = 32
"""Largest number of periods of a ripple over twice the rated torque."""

UNITS = {
    "temperature": (20.0, 25.0),
    "cycles": (0.0, 2e5),
    "speed": (0.0, 100.0),
    "time": (0.0, 600.0),
}
"""Centre and half range for scaling a shape; torques and forces are scaled by the rated torque."""


def common_base(base: BaselineModel, steps: int) -> BaselineModel:
    """Put a baseline model on the grid of the rated torque, without its first sudden steps."""
    other = base.copy()
    for step in other.additives[:steps]:
        other.measured = other.measured - step.columns @ step.coefficients
    other.additives, other.widens = other.additives[steps:], False
    other.curve.knots_Nm = base.rated_torque_Nm * np.geomspace(*KNOT_RANGE, KNOTS)
    radii = base.rated_torque_Nm * np.geomspace(*PLAY_RANGE, PLAYS)
    loads = np.full(base.hysteresis.count - PLAYS, radii[0])
    other.hysteresis.radius_Nm = np.concatenate((radii, loads))
    ends = np.concatenate(([0.0], base.curve.knots_Nm))
    place = np.searchsorted(ends, np.concatenate(([0.0], other.curve.knots_Nm)), side="right") - 1
    other.curve.slopes = base.curve.slopes[place].copy()
    other.curve.prior_slopes = base.curve.prior_slopes[place].copy()
    other.deviations[:] = 0.0
    return other


def gather_body(diagnosis: Diagnosis, effects: Mapping[str, Effect], ratio: float) -> Body:
    """Gather the evidence of a campaign.

    Parameters
    ----------
    diagnosis : Diagnosis
        Of the campaign.
    effects : mapping
        Effects that may be missing.
    ratio : float
        Of the drive.
    """
    settled_models = diagnosis.need_selection().settled
    first, final = (settled_models[i].base for i in (0, -1))
    noise = settled_models[-1].noise
    start = common_base(final, len(first.additives))
    start.first_fit()
    start = with_form_error(start, noise, common_candidates(start, effects, ratio)[0])
    settled = settle(start, noise)
    base = settled.base.copy()
    base.terms, base.additives = base.terms[: len(first.terms)], []
    c = base.conditions
    at, (point, _, _) = base.at(), base.vector()
    names = [term.effect.name for term in base.terms]
    # Slipped teeth belong to one campaign: they are removed from it and reported as its events.
    present = [term.effect.name for term in base.terms if term.free]
    candidates, closed = common_candidates(
        base, {name: effect for name, effect in effects.items() if name not in names}, ratio
    )
    if base.form_error is not None:
        known = make_round(Settled(base, settled.contest, noise), candidates, closed)
        mark_of_form(largest_model(base, candidates), known, judge_all(known))
        for candidate in candidates:
            # An effect that the diagnosis found without a form error remains an effect.
            candidate.of_form &= candidate.name not in diagnosis.effects
    blocks = [(candidate.name, candidate.columns) for candidate in candidates]
    fixed, precision, scatter, response = columns_of(base, at)
    white = gather(fixed, precision, scatter, blocks, response, noise, c.starts)
    if base.form_error is not None:
        form = white.fixed[-base.form_error.precision.size :]
        white = without_shared(white, form, settled.contest.omega_of(white))
    fixed, precision, scatter, response = columns_of(base, at, form=False)
    plainly = Noise([np.zeros(0)] * c.runs, np.ones(c.runs))
    plain = gather(fixed, precision, scatter, blocks, response, plainly, c.starts)
    plain.precision = plain.precision * float(np.mean(noise.sigma)) ** 2
    return Body(
        without_start(white, base.start_places()),
        without_start(plain, base.start_places()),
        point[: point.size - (len(base.hysteresis.start) - 1) * base.hysteresis.count],
        np.array([noise.spread(r) for r in range(c.runs)]),
        np.diff(c.starts).astype(np.float64),
        {
            "rated_torque_Nm": base.rated_torque_Nm,
            "ratio": ratio,
            "knots_Nm": base.curve.knots_Nm.tolist(),
            "radius_Nm": base.hysteresis.radius_Nm.tolist(),
            "effects": present,
            "candidates": [
                {
                    "name": k.name,
                    "named": k.named,
                    "covariate": k.covariate,
                    "shape": k.shape,
                    "starts": [s.tolist() for s in k.starts],
                    "start_of": k.start_of,
                    "kind": k.kind,
                    "of_form": k.of_form,
                }
                for k in candidates
            ],
            "closed": closed,
            "swing_arcsec": swing_by_run(base, at).tolist(),
            "given_arcsec": {name: term_size(base, names.index(name)) for name in present},
            "runs": [str(label) for label in c.labels],
            "events": [named_apart(event) for event in diagnosis.events],
            "data_fingerprints": [c.campaign.fingerprint()],
            "run_fingerprints": [run.fingerprint() for run in c.campaign.runs],
            "alone": [{"verdict": diagnosis.verdict, "effects": diagnosis.effects}],
        },
    )


def named_apart(event: Mapping[str, Any]) -> dict[str, Any]:
    """An event by the label of its run, because run numbers change in merged evidence."""
    rest = {key: value for key, value in event.items() if key != "run_number"}
    return {**rest, "run": str(event["run"])}


def common_candidates(
    base: BaselineModel, effects: Mapping[str, Effect], ratio: float
) -> tuple[list[Candidate], dict[str, str]]:
    """Effects and shapes whose columns have the same meaning in every campaign.

    An effect is kept if its column is constant here: another campaign may have another value.
    """
    point = base.at()
    c = base.conditions
    out: list[Candidate] = []
    closed: dict[str, str] = {}
    for name, effect in effects.items():
        missing = missing_columns(effect, c)
        if missing:
            closed[name] = NO_COLUMN + ", ".join(missing)
        elif effect.absorbed:
            closed[name] = "not testable: " + effect.absorbed
        else:
            candidate = tangent(effect, base, point, ratio)
            if candidate.columns.shape[1]:
                out.append(candidate)
            else:
                closed[name] = "not identifiable with this plan: it has no influence here"
    parts = varying_parts(base, point)
    for channel, values in channels(base).items():
        if channel == "run":
            continue
        middle, half = UNITS.get(channel, (0.0, base.rated_torque_Nm))
        waves = legendre(np.clip((values - middle) / half, -4.0, 4.0))
        for part, column in parts.items():
            columns = side_by_side(*(column * wave for wave in waves))
            shape = Candidate(f"{part} by {channel}", False, columns, channel, f"{part}, smooth")
            out.append(shape)
    period = 2.0 * base.rated_torque_Nm
    for k in range(1, TORQUE_WAVES + 1):
        phase = 2 * np.pi * k / period * c.torque
        columns = side_by_side(np.cos(phase), np.sin(phase))
        words = f"ripple of {period / k:.3g} Nm"
        name = f"wave {k} over torque"
        out.append(Candidate(name, False, columns, "torque", words, kind="ripple"))
    for channel in ("input_angle", "output_angle"):
        angle = c.columns.get(f"{channel}_rad")
        if angle is None:
            continue
        for order in ANGLE_ORDERS:
            columns = side_by_side(np.cos(order * angle), np.sin(order * angle))
            words = f"{order:g} per revolution"
            name = f"order {order:g} of {channel}"
            out.append(Candidate(name, False, columns, channel, words, kind="ripple"))
    return out, closed


def without_start(evidence: Evidence, places: Sequence[slice]) -> Evidence:
    """Remove the columns of the start states from every run: they belong to one campaign.

    Those of the first session are kept as zeros, so that every campaign has the same columns.
    """
    s = np.concatenate([evidence.fixed[at] for at in places])
    prior = np.concatenate([evidence.precision[at] for at in places])
    gram = evidence.gram
    inner = gram[:, s[:, None], s] + np.diag(np.maximum(prior, 1e-12))
    taken = np.linalg.solve(inner, gram[:, s, :])
    gram = gram - np.einsum("rsi,rsj->rij", gram[:, s, :], taken, optimize=True)
    gram[:, s, :] = 0.0
    gram[:, :, s] = 0.0
    gone = s[places[0].stop - places[0].start :]
    return without_columns(replace(evidence, gram=gram), gone)
