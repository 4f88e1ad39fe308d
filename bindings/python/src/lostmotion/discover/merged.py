"""Evidence that merges: campaigns of months or machines, judged together without their recordings.

What a campaign says is saved as Gram matrices, one a run: of the base's derivatives, of what
scatters from run to run, of every effect and every shape, and of the residual, whitened and plain.
So that the columns of two campaigns mean the same, all of them are measured by the drive's rated
torque and by fixed units here, not by the range of the recordings. Each campaign is linearised at
its own base; moving to a common one adds a combination of the base's columns to the residual. Where
the plays stood before a campaign is its own matter and is taken out when it is saved.

The judgement is that of `diagnose` with one difference: effects are refitted by one step, in the
Gram matrices, and not in the recordings.
"""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from lostmotion.discover.backbone import (
    DEVIATIONS,
    KNOT_RANGE,
    KNOTS,
    PLAY_RANGE,
    PLAYS,
    Base,
)
from lostmotion.discover.candidates import LATENT, Candidate, missing_columns, tangent
from lostmotion.discover.contest import Contest, Result
from lostmotion.discover.effects import Effect
from lostmotion.discover.evidence import Evidence, gather
from lostmotion.discover.noise import Noise
from lostmotion.discover.selection import (
    LEFTOVER_SHARE,
    NAMED_SHARE,
    NESTED_DEG,
    RIVAL_SHARE,
    RUNS_PER_TERM,
    SHAPE_AFTER_NAMED,
    SIZE_LEAST,
    TERMS_MAX,
    Contender,
    Step,
    accepted,
    judge_all,
    rivals,
    tests_made,
)
from lostmotion.discover.shapes import ANGLE_ORDERS, channels, legendre, parts_of
from lostmotion.discover.study import Field, columns_of, settle
from lostmotion.errors import InputError, one_line
from lostmotion.files import write_whole

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.intp]

SCHEMA = "lostmotion.campaign_evidence/1"
"""Name and version of the saved form."""

RUNS_LEAST = 6
"""With fewer runs no names are given, as in a diagnosis."""

TORQUE_WAVES = 32
"""Periods of a ripple over twice the rated torque, finest."""

UNITS = {
    "temperature": (20.0, 25.0),
    "cycles": (0.0, 2e5),
    "speed": (0.0, 100.0),
    "time": (0.0, 600.0),
}
"""Middle and half range that a shape is measured by; torques and forces by the rated torque."""


@dataclass
class Body:
    """Evidence of a campaign, or of several.

    Attributes
    ----------
    white, plain : Evidence
        Gram matrices of the same columns: whitened, and in arc seconds as they are.
    point : ndarray
        Values of the base's parameters that the columns are derivatives at.
    spread, rows : ndarray
        Noise within each run in arc seconds, and its samples.
    about : dict
        Everything that is not a number a run: grid, candidates, labels, where from.
    """

    white: Evidence
    plain: Evidence
    point: FloatArray
    spread: FloatArray
    rows: FloatArray
    about: dict[str, Any]

    def save(self, file: str | Path) -> None:
        """Write it to an ``.npz`` file, whole or not at all."""
        out = io.BytesIO()
        names = list(self.white.blocks)
        blocks: dict[str, Any] = {
            f"block_{i}": self.white.blocks[name] for i, name in enumerate(names)
        }
        arrays: dict[str, Any] = {
            "schema": np.array(SCHEMA),
            "about": np.array(json.dumps(self.about)),
            "point": self.point,
            "spread": self.spread,
            "rows": self.rows,
            "white": self.white.gram,
            "plain": self.plain.gram,
            "white_scale": self.white.scale,
            "plain_scale": self.plain.scale,
            "fixed": self.white.fixed,
            "scatter": self.white.scatter,
            "response": np.array(self.white.response),
            "white_precision": self.white.precision,
            "plain_precision": self.plain.precision,
            "names": np.array(names),
            **blocks,
        }
        np.savez_compressed(out, **arrays, checksum=np.array(checksum(arrays)))
        write_whole(file, out.getvalue())


def checksum(arrays: Mapping[str, Any]) -> str:
    """Sum over everything that is saved: numbers that fit together cannot be told from others."""
    digest = hashlib.sha256()
    for name in sorted(arrays):
        values = np.ascontiguousarray(arrays[name])
        digest.update(f"{name} {values.dtype.str} {np.shape(arrays[name])}\n".encode())
        digest.update(values.tobytes())
    return digest.hexdigest()


def load_body(file: str | Path) -> Body:
    """Read what `Body.save` wrote.

    Raises
    ------
    InputError
        When the file is not evidence of this version, or not as it was saved.
    """
    try:
        with np.load(file, allow_pickle=False) as data:
            saved = {name: data[name] for name in data.files}
        schema, summed = str(saved["schema"]), str(saved.pop("checksum", "none"))
    except Exception as error:  # NumPy raises many kinds for a file that is none of its own
        found = one_line(str(error)) or "no evidence"
        if isinstance(error, FileNotFoundError):
            found = "no such file"
        elif Path(file).is_file() and not zipfile.is_zipfile(file):
            found = "no .npz archive"
        raise InputError(file, "", found, "evidence by diagnose --save-evidence") from None
    if schema != SCHEMA:
        raise InputError(file, "schema", schema, SCHEMA)
    if summed != checksum(saved):
        raise InputError(file, "checksum", summed, f"{checksum(saved)}, as of its contents")
    blocks = {str(n): saved[f"block_{i}"] for i, n in enumerate(saved["names"])}
    white, plain = (
        Evidence(
            saved[kind],
            saved[f"{kind}_scale"],
            saved["fixed"],
            saved["scatter"],
            dict(blocks),
            int(saved["response"]),
            saved[f"{kind}_precision"],
        )
        for kind in ("white", "plain")
    )
    about = json.loads(str(saved["about"]))
    return Body(white, plain, saved["point"], saved["spread"], saved["rows"], about)


# --- from a campaign ------------------------------------------------------------------------------


def common_base(base: Base) -> Base:
    """Put a base on the grid of the drive's rated torque; a fitted drive file keeps its own."""
    other = base.copy()
    other.terms, other.additives, other.widens = [], [], False
    other.knots_Nm = base.rated_torque_Nm * np.geomspace(*KNOT_RANGE, KNOTS)
    other.radius_Nm = base.rated_torque_Nm * np.geomspace(*PLAY_RANGE, PLAYS)
    ends = np.concatenate(([0.0], base.knots_Nm))
    place = np.searchsorted(ends, np.concatenate(([0.0], other.knots_Nm)), side="right") - 1
    other.slopes = base.slopes[place].copy()
    other.prior_slopes = base.prior_slopes[place].copy()
    other.deviations[:] = 0.0
    return other


def gather_body(base: Base, noise: Noise, effects: Mapping[str, Effect], ratio: float) -> Body:
    """Gather the evidence of a campaign.

    Parameters
    ----------
    base : Base
        Of a diagnosis, before anything was added.
    noise : Noise
        As the diagnosis estimated it.
    effects : mapping
        Effects that may be missing.
    """
    start = common_base(base)
    start.first_fit()
    settled = settle(start, noise)
    base = settled.base
    c = base.conditions
    candidates, closed = common_candidates(base, effects, ratio)
    fixed, precision, scatter, response = columns_of(base, base.at())
    blocks = [(candidate.name, candidate.columns) for candidate in candidates]
    plainly = Noise([np.zeros(0)] * c.runs, np.ones(c.runs))
    kept = []
    for how in (noise, plainly):
        evidence = gather(fixed, precision, scatter, blocks, response, how, c.starts)
        weight = 1.0 if how is noise else float(np.mean(noise.sigma)) ** 2
        evidence.precision = evidence.precision * weight
        kept.append(without_start(evidence, base.slopes.size + PLAYS))
    return Body(
        kept[0],
        kept[1],
        base.vector()[0],
        np.array([noise.spread(r) for r in range(c.runs)]),
        np.diff(c.starts).astype(np.float64),
        {
            "rated_torque_Nm": base.rated_torque_Nm,
            "ratio": ratio,
            "knots_Nm": base.knots_Nm.tolist(),
            "radius_Nm": base.radius_Nm.tolist(),
            "candidates": [
                {
                    "name": k.name,
                    "named": k.named,
                    "covariate": k.covariate,
                    "shape": k.shape,
                    "starts": [s.tolist() for s in k.starts],
                    "start_of": k.start_of,
                }
                for k in candidates
            ],
            "closed": closed,
            "runs": [str(label) for label in c.labels],
            "data_fingerprints": [c.campaign.fingerprint()],
        },
    )


def common_candidates(
    base: Base, effects: Mapping[str, Effect], ratio: float
) -> tuple[list[Candidate], dict[str, str]]:
    """Effects and shapes whose columns mean the same in every campaign.

    An effect stays in when its column is constant here: another campaign may have another value.
    """
    point = base.at()
    c = base.conditions
    out: list[Candidate] = []
    closed: dict[str, str] = {}
    for name, effect in effects.items():
        missing = missing_columns(effect, c)
        if missing:
            closed[name] = "not testable with these columns: no " + ", ".join(missing)
        elif name in LATENT:
            closed[name] = "not testable: " + LATENT[name]
        else:
            candidate = tangent(effect, base, point, ratio)
            if candidate.columns.shape[1]:
                out.append(candidate)
            else:
                closed[name] = "not visible with this plan: it does nothing here"
    parts = parts_of(base, point)
    for channel, values in channels(base).items():
        if channel == "run":
            continue
        middle, half = UNITS.get(channel, (0.0, base.rated_torque_Nm))
        waves = legendre(np.clip((values - middle) / half, -4.0, 4.0))
        for part, column in parts.items():
            columns = np.column_stack([column * wave for wave in waves])
            shape = Candidate(f"{part} by {channel}", False, columns, channel, f"{part}, smooth")
            out.append(shape)
    period = 2.0 * base.rated_torque_Nm
    for k in range(1, TORQUE_WAVES + 1):
        phase = 2 * np.pi * k / period * c.torque
        columns = np.column_stack((np.cos(phase), np.sin(phase)))
        words = f"ripple of {period / k:.3g} Nm"
        out.append(Candidate(f"wave {k} over torque", False, columns, "torque", words))
    for channel in ("input_angle", "output_angle"):
        angle = c.columns.get(f"{channel}_rad")
        if angle is None:
            continue
        for order in ANGLE_ORDERS:
            columns = np.column_stack((np.cos(order * angle), np.sin(order * angle)))
            words = f"{order:g} per revolution"
            out.append(Candidate(f"order {order:g} of {channel}", False, columns, channel, words))
    return out, closed


def without_start(evidence: Evidence, first: int) -> Evidence:
    """Take the columns of the start states out of every run: they belong to one campaign."""
    s = evidence.fixed[first : first + PLAYS]
    gram = evidence.gram
    inner = gram[:, s[:, None], s] + np.diag(
        np.maximum(evidence.precision[first : first + PLAYS], 1e-12)
    )
    taken = np.linalg.solve(inner, gram[:, s, :])
    gram = gram - np.einsum("rsi,rsj->rij", gram[:, s, :], taken, optimize=True)
    gram[:, s, :] = 0.0
    gram[:, :, s] = 0.0
    evidence.gram = gram
    return evidence


# --- together -------------------------------------------------------------------------------------


def merge_bodies(bodies: Sequence[Body], files: Sequence[str | Path]) -> Body:
    """Combine evidence of several campaigns at the linearisation of the first.

    Raises
    ------
    InputError
        When a part is of another drive or of another grid.
    """
    first = bodies[0]
    for body, file in zip(bodies[1:], files[1:], strict=True):
        for key in ("rated_torque_Nm", "ratio", "knots_Nm", "radius_Nm"):
            one, two = np.array(body.about[key]), np.array(first.about[key])
            if one.shape != two.shape or not np.allclose(one, two, rtol=1e-9):
                raise InputError(
                    file, key, f"{np.ravel(one)[0]:.6g}", f"{np.ravel(two)[0]:.6g} as in {files[0]}"
                )
    seen: set[str] = set()
    for body, file in zip(bodies, files, strict=True):
        for fingerprint in body.about["data_fingerprints"]:
            if fingerprint in seen:
                raise InputError(file, "data_fingerprints", "recordings a second time", "others")
            seen.add(fingerprint)
    sizes = [{n: p.size for n, p in body.white.blocks.items()} for body in bodies]
    common = [name for name, size in sizes[0].items() if all(s.get(name) == size for s in sizes)]
    closed = {k: v for body in bodies for k, v in body.about["closed"].items()}
    for body in bodies:
        for name in body.white.blocks:
            if name not in common:
                closed[name] = "not in all of the evidence"
    white, plain = (
        merge_grams([getattr(body, kind) for body in bodies], [b.point for b in bodies], common)
        for kind in ("white", "plain")
    )
    return Body(
        white,
        plain,
        first.point,
        np.concatenate([body.spread for body in bodies]),
        np.concatenate([body.rows for body in bodies]),
        {
            **first.about,
            "candidates": [k for k in first.about["candidates"] if k["name"] in common],
            "closed": closed,
            "runs": [
                label if len(bodies) == 1 else f"{i + 1}:{label}"
                for i, body in enumerate(bodies)
                for label in body.about["runs"]
            ],
            "data_fingerprints": sorted(seen),
        },
    )


def merge_grams(
    parts: Sequence[Evidence], points: Sequence[FloatArray], common: Sequence[str]
) -> Evidence:
    """Bring Gram matrices to the same columns, units and linearisation, and put them together."""
    first = parts[0]
    grams = []
    for part, point in zip(parts, points, strict=True):
        keep = np.concatenate(
            [part.fixed, part.scatter, *(part.blocks[n] for n in common), [part.response]]
        ).astype(np.intp)
        gram = part.gram[:, keep[:, None], keep]
        ratio = part.scale[keep] / first.scale[places(first, common)]
        gram = gram * np.outer(ratio, ratio)
        # The residual about the first point: what the base does between the two is put back.
        step = (point - points[0]) * first.scale[first.fixed][: point.size]
        change = np.eye(keep.size)
        change[: step.size, -1] = step
        grams.append(np.einsum("ai,rab,bj->rij", change, gram, change, optimize=True))
    n, m = first.fixed.size, first.scatter.size
    blocks, at = {}, n + m
    for name in common:
        blocks[name] = np.arange(at, at + first.blocks[name].size, dtype=np.intp)
        at += first.blocks[name].size
    return Evidence(
        np.concatenate(grams),
        first.scale[places(first, common)],
        np.arange(n, dtype=np.intp),
        np.arange(n, n + m, dtype=np.intp),
        blocks,
        at,
        first.precision,
    )


def places(evidence: Evidence, common: Sequence[str]) -> IntArray:
    """Places of the base's columns, of what scatters, of some blocks and of the residual."""
    parts = [evidence.fixed, evidence.scatter, *(evidence.blocks[name] for name in common)]
    return np.concatenate([*parts, [evidence.response]]).astype(np.intp)


# --- the judgement --------------------------------------------------------------------------------


def centred(plain: Evidence) -> FloatArray:
    """Plain Gram matrices with the mean of each run taken off; the last scatter column is ones."""
    ones = plain.scatter[-1]
    gram = plain.gram
    count = np.maximum(gram[:, ones, ones], 1e-300)
    return np.asarray(gram - gram[:, :, ones, None] * gram[:, None, ones, :] / count[:, None, None])


def errors(body: Body, more: IntArray) -> tuple[float, float]:
    """Fitted and held-out rms of the base with more columns, arc seconds."""
    plain = body.plain
    index = np.concatenate((plain.fixed, more)).astype(np.intp)
    gram = centred(plain)
    h, g = gram[:, index[:, None], index], gram[:, index, plain.response]
    own = gram[:, plain.response, plain.response]
    ridge = np.zeros(index.size)
    ridge[: plain.precision.size] = plain.precision
    total = h.sum(axis=0)
    ridge = np.diag(ridge + 1e-9 * np.maximum(np.diag(total), 1.0))
    delta = np.linalg.solve(total + ridge, g.sum(axis=0))
    fitted = own.sum() - 2 * delta @ g.sum(axis=0) + delta @ total @ delta
    apart = np.linalg.solve(total - h + ridge, (g.sum(axis=0) - g)[:, :, None])[:, :, 0]
    held = own - 2 * np.einsum("ri,ri->r", apart, g)
    held = held + np.einsum("ri,rij,rj->r", apart, h, apart, optimize=True)
    rows = float(body.rows.sum())
    return float(np.sqrt(max(fitted, 0.0) / rows)), float(np.sqrt(max(held.sum(), 0.0) / rows))


def size_beside_base(body: Body, block: IntArray, result: Result) -> float:
    """Root mean square of what a candidate explains beside the base, arc seconds."""
    plain = body.plain
    own = result.coefficients / body.white.scale[block] * plain.scale[block]
    gram = centred(plain).sum(axis=0)
    f = plain.fixed
    cross = gram[np.ix_(f, block)] @ own
    h = gram[np.ix_(f, f)]
    left = own @ gram[np.ix_(block, block)] @ own
    left -= cross @ np.linalg.solve(h + 1e-9 * np.diag(np.maximum(np.diag(h), 1.0)), cross)
    return float(np.sqrt(max(left, 0.0) / body.rows.sum()))


def stage_of(body: Body, white: Evidence, left: Sequence[Candidate]) -> Field:
    """Make a round of the contest from evidence alone."""
    for candidate in left:
        block = white.blocks[candidate.name]
        for start in sorted(set(candidate.start_of)):
            chosen = [i for i, s in enumerate(candidate.start_of) if s == start]
            white.blocks[f"{candidate.name}#{start}"] = block[chosen]
    nothing: Any = None
    return Field(nothing, Contest(white), {c.name: c for c in left}, dict(body.about["closed"]))


def judge_body(body: Body, effects: Mapping[str, Effect]) -> dict[str, Any]:
    """Judge evidence as `diagnose` judges recordings.

    Returns
    -------
    dict
        The answer of ``merge``, ready for JSON.
    """
    left = [
        Candidate(
            k["name"],
            k["named"],
            np.zeros((0, body.white.blocks[k["name"]].size)),
            k["covariate"],
            k["shape"],
            effects.get(k["name"]),
            [np.array(s) for s in k["starts"]],
            list(k["start_of"]),
        )
        for k in body.about["candidates"]
    ]
    within = float(np.sqrt(np.average(body.spread**2, weights=body.rows)))
    runs = body.white.runs
    white = copy_of(body.white)
    taken: list[IntArray] = []
    steps: list[Step] = []
    ladder = [rung([], errors(body, np.zeros(0, dtype=np.intp)))]
    limit = max(1, min(TERMS_MAX, runs // RUNS_PER_TERM))
    while True:
        stage = stage_of(body, white, left)
        results = judge_all(stage)
        step = choose(body, stage, results, within, steps)
        steps.append(step)
        if step.chosen is None or len(taken) >= limit:
            break
        chosen = step.chosen
        block = white.blocks[chosen.result.block]
        taken.append(block)
        left = [candidate for candidate in left if candidate.name != chosen.candidate.name]
        white = promoted(white, block, [candidate.name for candidate in left])
        names = [*ladder[-1]["effects"], chosen.candidate.name]
        ladder.append(rung(names, errors(body, np.concatenate(taken))))
    return conclude(body, steps, ladder, within, len(taken))


def copy_of(evidence: Evidence) -> Evidence:
    """Copy evidence whose blocks are going to change."""
    return Evidence(
        evidence.gram,
        evidence.scale,
        evidence.fixed,
        evidence.scatter,
        dict(evidence.blocks),
        evidence.response,
        evidence.precision,
    )


def promoted(white: Evidence, block: IntArray, names: Sequence[str]) -> Evidence:
    """Take a block into the base."""
    other = copy_of(white)
    other.fixed = np.concatenate((white.fixed, block)).astype(np.intp)
    other.precision = np.concatenate((white.precision, np.zeros(block.size)))
    other.blocks = {name: white.blocks[name] for name in names}
    return other


def rung(effects: list[str], found: tuple[float, float]) -> dict[str, Any]:
    """Make a rung of the ladder."""
    return {"effects": effects, "rms_arcsec": found[0], "rms_heldout_arcsec": found[1]}


def choose(
    body: Body, stage: Field, results: list[Result], within: float, before: Sequence[Step]
) -> Step:
    """Find what is missing most, by the gates and sizes of a diagnosis."""
    count = tests_made(stage)
    earlier = [s.chosen for s in before if s.chosen is not None]
    largest = max((c.size for c in earlier), default=0.0)
    least = max(SIZE_LEAST * within, LEFTOVER_SHARE * largest)
    named_before = any(c.candidate.named for c in earlier)
    contenders = []
    for result in results:
        if not accepted(result, count):
            continue
        candidate = stage.candidates[result.name]
        size = size_beside_base(body, stage.contest.evidence.blocks[result.block], result)
        limit = max(least, SHAPE_AFTER_NAMED * within) if named_before else least
        if size >= (least if candidate.named else limit):
            contenders.append(
                Contender(result, candidate, None, result.gain, result.gain_by_run, size)
            )
    named = next((c for c in contenders if c.candidate.named), None)
    shape = next((c for c in contenders if not c.candidate.named), None)
    chosen = named or shape
    if named is not None and shape is not None and named.gain < NAMED_SHARE * shape.gain:
        angles = stage.contest.angles(named.result.name, shape.result.name, named.result.omega)
        if not (angles.size and float(angles[0]) < NESTED_DEG):
            chosen = shape
    step = Step(stage, results, chosen, contenders)
    if chosen is not None and chosen.candidate.named:
        alike = rivals(stage, results, contenders, chosen)
        step.rivals = [name for name in alike if not needed_beside(stage, chosen, name, results)]
    return step


def needed_beside(stage: Field, chosen: Contender, rival: str, results: Sequence[Result]) -> bool:
    """Whether the chosen effect is needed with a rival in the model: then that is no substitute.

    Without a refit in the recordings the gain of an effect that is far from its tangent falls
    behind, and others come close to it that explain something else.
    """
    white = stage.contest.evidence
    other = next(result for result in results if result.name == rival)
    left = promoted(white, white.blocks[other.block], list(white.blocks))
    beside = Contest(left).test(chosen.result.block)
    return (
        beside is not None
        and accepted(beside, tests_made(stage))
        and beside.gain >= RIVAL_SHARE * chosen.gain
    )


def conclude(
    body: Body, steps: Sequence[Step], ladder: list[dict[str, Any]], within: float, count: int
) -> dict[str, Any]:
    """Turn the rounds into an answer."""
    runs = body.white.runs
    chosen = [s for s in steps if s.chosen is not None][:count]
    names = [s.chosen.candidate.name for s in chosen if s.chosen and s.chosen.candidate.named]
    shapes = [s for s in chosen if s.chosen and not s.chosen.candidate.named]
    twins = sorted({name for s in chosen for name in s.rivals if name not in names})
    if runs < RUNS_LEAST:
        verdict, shown = ("unexplained" if chosen else "complete"), []
    elif shapes:
        verdict, shown = "unexplained", names
    elif names:
        verdict, shown = ("ambiguous", names + twins) if twins else ("missing-effect", names)
    else:
        verdict, shown = "complete", []
    contest = steps[-1].field.contest
    omega = contest.null_omega / contest.evidence.scale[contest.evidence.scatter] ** 2
    diagonal = np.einsum("rii->i", centred(body.plain))[body.plain.scatter]
    diagonal = diagonal * body.plain.scale[body.plain.scatter] ** 2 / body.rows.sum()
    scatter = np.sqrt(omega)
    floor = float(np.sqrt(within**2 + diagonal[: len(DEVIATIONS)] @ omega[: len(DEVIATIONS)]))
    judged: dict[str, dict[str, Any]] = {}
    for step in steps:
        for result in step.results:
            candidate = step.field.candidates[result.name]
            if candidate.named and result.name not in {n for n in names if n in judged}:
                judged[result.name] = {
                    "name": result.name,
                    "heldout_rms_arcsec": ladder[-1]["rms_heldout_arcsec"],
                    "evidence": result.gain,
                    "parameters": {},
                    "confused_with": sorted(step.rivals) if result.name in names else [],
                    "plausible": True,
                    "testable": True,
                    "p": float(min(1.0, result.p * tests_made(step.field))),
                }
    order = sorted(
        judged.values(), key=lambda c: (c["name"] not in shown, -c["evidence"], c["name"])
    )
    return {
        "schema": "lostmotion.diagnosis/1",
        "verdict": verdict,
        "noise_floor_arcsec": floor,
        "effects": shown,
        "ladder": ladder,
        "candidates": order,
        "events": [],
        "smallest_detectable": {},
        "unexplained": {
            "share": 0.0
            if not shapes
            else float(
                min(
                    1.0,
                    sum(s.chosen.size**2 for s in shapes if s.chosen)
                    / max(ladder[0]["rms_arcsec"] ** 2, 1e-300),
                )
            ),
            "depends_on": [
                {
                    "covariate": s.chosen.candidate.covariate,
                    "shape": s.chosen.candidate.shape,
                    "p": float(min(1.0, s.chosen.result.p * tests_made(s.field))),
                    "rms_arcsec": s.chosen.size,
                }
                for s in shapes
                if s.chosen is not None
            ],
        },
        "next_experiment": advice(verdict, runs),
        "noise": {
            "within_runs_arcsec": within,
            "scatter": dict(zip((*DEVIATIONS, "offset_arcsec"), map(float, scatter), strict=True)),
        },
        "runs": runs,
        "samples": int(body.rows.sum()),
        "not_testable": dict(sorted(body.about["closed"].items())),
        "data_fingerprints": body.about["data_fingerprints"],
    }


def advice(verdict: str, runs: int) -> str:
    """Say what to do next."""
    if runs < RUNS_LEAST:
        return f"{runs} runs cannot carry a name: add evidence, {RUNS_LEAST} runs or more."
    return {
        "complete": "Nothing is left above the noise.",
        "missing-effect": "Diagnose the recordings of one campaign for the effect's values.",
        "ambiguous": "Add evidence of runs in which only one of the effects changes.",
        "unexplained": "Look at the recordings in which what it depends on changes alone.",
    }[verdict]
