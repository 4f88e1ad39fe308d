"""Before and after measuring: what a plan can tell apart, and which run to do next."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from lostmotion import units
from lostmotion.backbone import Backbone
from lostmotion.discover.base import Base
from lostmotion.discover.candidates import DERIVED, missing_columns, named_candidates
from lostmotion.discover.conditions import Conditions
from lostmotion.discover.contest import Contest, reduce
from lostmotion.discover.diagnosis import RUNS_LEAST, TWIN_DEG, Diagnosis, detectable
from lostmotion.discover.drive_base import require_plan, restore
from lostmotion.discover.effects import Effect
from lostmotion.discover.noise import Noise
from lostmotion.discover.selection import Selection
from lostmotion.discover.study import make_field, noise_rms, settle
from lostmotion.drives import Drive
from lostmotion.errors import InputError
from lostmotion.recordings import QUANTITIES, Campaign, Run, recording_files, told
from lostmotion.recordings.columns import check_range, parse_column
from lostmotion.recordings.protocol import REPLACED
from lostmotion.recordings.reading import run_codes
from lostmotion.recordings.soundness import check_steps
from lostmotion.recordings.tables import numbers_of, read_table

FloatArray = npt.NDArray[np.float64]

USUAL_NOISE_ARCSEC = 1.5
"""Angle noise that is taken for granted where nothing was measured yet."""

USUAL_PHI = (0.5,)
"""Its correlation from sample to sample."""

USUAL_SCATTER = (0.003, 0.02, 0.2, 2.0)
"""Scatter from run to run: stiffness, friction (relative), gap and offset (arc seconds)."""

WARN_DEG = 30.0
"""Effects within this angle are hard to tell apart."""

ELSEWHERE = 0.05
"""A run begins elsewhere when its torque is this share of the largest from where the last ended."""

ALIASED = 0.9
"""Rank correlation of two columns' means over the runs from which they cannot be told apart."""


def read_plan(
    paths: Sequence[str | Path], ratio: float, mapping: Mapping[str, str] | None = None
) -> Campaign:
    """Read planned runs: like recordings, but what will be measured may be left out.

    Raises
    ------
    InputError
        As for recordings; time and torque must be there.
    """
    runs: list[Run] = []
    for file in recording_files(paths):
        table = read_table(file)
        columns: dict[str, FloatArray] = {}
        labels = None
        for header in table:
            name = parse_column(str(file), header, (mapping or {}).get(header, header))
            if name is None or name.quantity.name in REPLACED:
                continue
            if name.quantity.name == "run":
                labels = table[header]
                continue
            values = name.factor * numbers_of(str(file), header, table[header])
            if name.unit is not None:
                values = units.convert(values, name.unit.symbol, name.quantity.unit)
            check_range(str(file), header, values, name.quantity)
            unknown = np.flatnonzero(~np.isfinite(values))
            if unknown.size:
                found = f"{values[unknown[0]]} in row {unknown[0] + 1}"
                raise InputError(file, header, found, "a number: a plan is known in full")
            columns[name.quantity.name] = values
        lacking = [
            QUANTITIES[needed].column for needed in ("time", "torque") if needed not in columns
        ]
        if lacking:
            nothing = f"no such column (there are {', '.join(table)})"
            raise InputError(file, ", ".join(lacking), nothing, " and ".join(lacking))
        rows = columns["torque"].size
        if "input_angle" in columns and "output_angle" not in columns:
            columns["output_angle"] = columns["input_angle"] / ratio
        columns.setdefault("lost_motion", np.zeros(rows))
        if labels is None:
            codes = np.zeros(rows, dtype=np.intp)
            names: list[int | str] = [file.name.split(".")[0]]
        else:
            codes, names = run_codes(str(file), "run", labels)
        for code, label in enumerate(names):
            at = codes == code
            check_steps(str(file), columns["time"][at])
            runs.append(Run(label, str(file), {k: v[at] for k, v in columns.items()}))
        if rows == 0:
            raise InputError(file, "", "no rows", "a planned run")
    return Campaign(runs)


def usual_noise(runs: int) -> Noise:
    """Noise of a rig that was not measured yet."""
    phi = np.array(USUAL_PHI)
    sigma = USUAL_NOISE_ARCSEC * np.sqrt(1.0 - float(phi @ phi))
    return Noise([phi] * runs, np.full(runs, sigma))


def forecast(
    drive: Drive,
    campaign: Campaign,
    backbone: Backbone | None,
    effects: Mapping[str, Effect],
) -> dict[str, Any]:
    """Say which effects a plan would find, how small, and which it could not separate."""
    require_plan(campaign)
    base = Base(Conditions(campaign), drive.rated_torque_Nm, backbone)
    base.mean_slope = float(np.mean(base.prior_slopes))
    base.slopes = base.prior_slopes.copy()
    restore(drive, base, effects)
    noise = usual_noise(base.conditions.runs)
    candidates, closed = named_candidates(effects, base, base.at(), drive.ratio)
    stage = make_field(settle(base, noise, rounds=0), candidates, closed)
    contest = stage.contest
    scale = contest.evidence.scale[contest.evidence.scatter]
    contest.null_omega = (np.array(USUAL_SCATTER) * scale) ** 2
    found = detectable(stage, noise_rms(noise, base), stage.form_arcsec)
    for candidate in candidates:
        if candidate.name not in found:
            closed[candidate.name] = "not visible with this plan: the base takes it up"
    rows = [
        {"name": name, "testable": name in found, **found.get(name, {"reason": closed.get(name)})}
        for name in effects
    ]
    pairs = []
    for a, b in combinations(found, 2):
        angle = float(contest.angles(a, b)[0])
        if angle < WARN_DEG:
            pairs.append({"effects": [a, b], "angle_deg": angle, "separable": angle >= TWIN_DEG})
    pairs.sort(key=lambda p: (p["angle_deg"], p["effects"]))
    return {
        "schema": "lostmotion.forecast/1",
        "runs": base.conditions.runs,
        "samples": base.conditions.rows,
        "enough_runs": base.conditions.runs >= RUNS_LEAST,
        "effects": rows,
        "confusable": pairs,
        "assumed": {
            "noise_arcsec": USUAL_NOISE_ARCSEC,
            "scatter": dict(
                zip(
                    ("stiffness", "friction", "gap_arcsec", "offset_arcsec"),
                    USUAL_SCATTER,
                    strict=True,
                )
            ),
        },
    }


def next_runs(
    diagnosis: Diagnosis, options: Campaign, effects: Mapping[str, Effect], ratio: float
) -> dict[str, Any]:
    """Rank planned runs by how well each decides between the effects that are still open."""
    selection = diagnosis.selection
    assert selection is not None
    assert diagnosis.base is not None
    open_effects = [n for n in diagnosis.effects if n in effects]
    if len(open_effects) < 2:
        ranked = [c["name"] for c in diagnosis.candidates if c["testable"]]
        open_effects = list(dict.fromkeys([*open_effects, *ranked]))[:2]
    step = selection.steps[0]
    before = selection.settled[0].base
    past = before.conditions.campaign
    names = set(past.quantities()) & set(options.quantities())
    runs = [
        Run(run.label, run.file, {k: run.columns[k] for k in names}, run.begins)
        for run in (*past.runs, *options.runs)
    ]
    joined = Campaign(runs)
    base = before.copy()
    base.conditions = Conditions(joined)
    base.measured = np.concatenate((before.measured, np.zeros(options.rows)))
    base.deviations = np.zeros((len(runs), before.deviations.shape[1]))
    base.deviations[: len(past.runs)] = before.deviations
    base.terms, base.additives = [], []
    noise = step.field.settled.noise
    # An option is sampled as the recordings usually were.
    usual = int(np.argsort(noise.sigma)[noise.sigma.size // 2])
    extended = Noise(
        [*noise.phi, *([noise.phi[usual]] * len(options.runs))],
        np.concatenate((noise.sigma, np.full(len(options.runs), noise.sigma[usual]))),
    )
    lacking = [n for n in open_effects if missing_columns(effects[n], base.conditions)]
    open_effects = [n for n in open_effects if n not in lacking]
    candidates, _ = named_candidates(
        {name: effects[name] for name in open_effects}, base, base.at(), ratio
    )
    stage = make_field(settle(base, extended, rounds=0), candidates, {})
    contest = stage.contest
    contest.null_omega = (
        step.field.contest.null_omega
        * (
            contest.evidence.scale[contest.evidence.scatter]
            / step.field.contest.evidence.scale[step.field.contest.evidence.scatter]
        )
        ** 2
    )
    known = len(past.runs)
    pairs = open_pairs(selection, [c.name for c in candidates])
    apart = np.zeros((max(len(pairs), 1), len(options.runs)))
    for i, (a, b) in enumerate(pairs):
        both = discrimination(contest, a, b, known) + discrimination(contest, b, a, known)
        apart[i] = 0.5 * both
    # A run is worth what it says of the pair that it tells apart least; then, what of all.
    scores = apart.min(axis=0)
    minutes = np.array([max(np.ptp(run.time_s) / 60.0, 1e-3) for run in options.runs])
    order = np.lexsort((-apart.sum(axis=0), -scores))
    return {
        "schema": "lostmotion.next/1",
        "between": open_effects,
        "runs": [
            {
                "run": options.runs[i].label,
                "separation_nats": float(scores[i]),
                "per_minute": float(scores[i] / minutes[i]),
                "minutes": float(minutes[i]),
            }
            for i in order
        ],
        "suggested": options.runs[int(order[0])].label if pairs else None,
    }


def open_pairs(selection: Selection, names: Sequence[str]) -> list[tuple[str, str]]:
    """Pairs of effects that recordings leave open: what was found with each rival, else all."""
    found = [
        (step.chosen.result.name, rival)
        for step in selection.steps
        if step.chosen is not None
        for rival in step.rivals
    ]
    kept = [(a, b) for a, b in found if a in names and b in names]
    return kept or list(combinations(names, 2))


def discrimination(contest: Contest, true: str, rival: str, known: int) -> FloatArray:
    """Expected evidence of each new run against `rival` when `true` is right (T-optimality)."""
    e = contest.evidence
    index = e.index(true, rival)
    matrix = reduce(e, index, contest.null_omega).matrix
    n0, na = e.fixed.size, e.blocks[true].size
    ridge = np.diag(contest.ridge(index))
    past = matrix[:known].sum(axis=0)
    keep_a = np.arange(n0 + na)
    keep_b = np.concatenate((np.arange(n0), np.arange(n0 + na, index.size - 1)))

    def solve(keep: npt.NDArray[np.intp]) -> FloatArray:
        part = past[np.ix_(keep, keep)] + ridge[np.ix_(keep, keep)]
        part += 1e-8 * np.diag(np.diag(part))
        out = np.zeros(index.size - 1)
        out[keep] = np.linalg.solve(part, past[keep, -1])
        return out

    apart = solve(keep_a) - solve(keep_b)
    h = past[np.ix_(keep_b, keep_b)] + ridge[np.ix_(keep_b, keep_b)]
    h += 1e-8 * np.diag(np.diag(h))
    scores = []
    for run in range(known, matrix.shape[0]):
        own = matrix[run][:-1, :-1]
        push = own @ apart
        free = push[keep_b]
        taken = free @ np.linalg.solve(h + own[np.ix_(keep_b, keep_b)], free)
        scores.append(0.5 * max(float(apart @ push - taken), 0.0))
    return np.array(scores)


def begin_elsewhere(campaign: Campaign) -> list[int | str]:
    """Name the runs whose torque does not begin where the run before ended.

    Friction remembers what lay between; the model takes it that the torque went straight there.
    """
    least = ELSEWHERE * campaign.largest_torque_Nm
    return [
        run.label
        for before, run in pairwise(campaign.runs)
        if abs(run.torque_Nm[0] - before.torque_Nm[-1]) > least
    ]


def ranks(values: FloatArray) -> FloatArray:
    """Rank of each value; equal ones share theirs."""
    _, place, counts = np.unique(values, return_inverse=True, return_counts=True)
    return np.asarray((np.cumsum(counts) - 0.5 * (counts - 1))[place], dtype=np.float64)


def rank_correlation(a: FloatArray, b: FloatArray) -> float:
    """Spearman's correlation; scipy.stats takes half a second to load."""
    return float(np.corrcoef(ranks(a), ranks(b))[0, 1])


def check(campaign: Campaign, effects: Mapping[str, Effect]) -> dict[str, Any]:
    """Say whether recordings are sound, and what this plan can and cannot tell apart."""
    conditions = Conditions(campaign)
    columns = dict(conditions.columns)
    columns.pop("elapsed_s", None)
    means = {
        name: conditions.run_mean(values) for name, values in columns.items() if np.ptp(values) > 0
    }
    means["order of the runs"] = np.arange(conditions.runs, dtype=np.float64)
    aliased = []
    if conditions.runs >= 3:
        for a, b in combinations(means, 2):
            if {a, b} == {"input_angle_rad", "output_angle_rad"}:
                continue  # the gear binds them
            if np.ptp(means[a]) == 0 or np.ptp(means[b]) == 0:
                continue
            close = rank_correlation(means[a], means[b])
            if abs(close) > ALIASED:
                aliased.append({"columns": [a, b], "rank_correlation": close})
    constant = [n for n, values in columns.items() if np.ptp(values) == 0]
    blind = {}
    for name, effect in effects.items():
        missing = missing_columns(effect, conditions)
        flat = [need for need in sorted(effect.needs) if need in constant]
        if missing:
            blind[name] = "not testable with these columns: no " + ", ".join(missing)
        elif flat:
            shown = ", ".join(DERIVED.get(need, need) for need in flat)
            blind[name] = f"not visible with this plan: constant {shown}"
    return {
        "schema": "lostmotion.check/1",
        "sound": not campaign.findings,
        "findings": told(campaign.findings),
        "runs": conditions.runs,
        "samples": conditions.rows,
        "enough_runs": conditions.runs >= RUNS_LEAST,
        "constant": constant,
        "begin_elsewhere": begin_elsewhere(campaign),
        "aliased": aliased,
        "not_testable": blind,
        "data_fingerprint": campaign.fingerprint(),
    }
