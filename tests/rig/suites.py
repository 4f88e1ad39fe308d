"""Suites of campaigns: many seeds, with neutral names."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from .bench import TooSmallError, stream
from .campaign import STANDARD, Campaign, Conditions, make_campaign
from .drives import SIZES
from .hidden import EFFECTS, HIDDEN, OUTSIDE

DEVELOP = range(0, 1000)
JUDGE = range(10_000, 100_000)
KINDS = ("single", "clean", "outside", "pair", "aliased")

TOGETHER = 0.98
"""From this cosine on, no method can separate two effects with a plan."""
APART = 0.5
"""Below this cosine two effects are hidden as a pair."""

SINGLES = (
    "kinematic_error",
    "thermal_gap",
    "creep",
    "load_dependent_friction",
    "torque_offset",
    "stiffness_modulation",
    "wear",
    "output_eccentricity",
    "thermal_friction",
    "asymmetric_stiffness",
    "viscous_friction",
    "thermal_stiffness",
    "kinematic_sideband",
    "sensor_lag",
    "stribeck_friction",
    "output_tilt",
    "inertia",
    "axial_shift",
    "input_coupling_play",
    "lobe_eccentricity",
)
"""Effects that the standard plan shows, in the order of a suite."""
ALIASED = ("thermal_gap", "wear")
"""Effects that the plan `aliased` makes rise together."""


def seeds_of(kind: str, seeds: str) -> Iterator[int]:
    """Yield the seeds of a suite: different ones for each kind, for development and evaluation."""
    span = DEVELOP if seeds == "develop" else JUDGE
    share = len(span) // len(KINDS)
    first = span.start + share * KINDS.index(kind)
    return iter(range(first, first + share))


def _extra_columns(seed: int) -> tuple[str, ...]:
    """Some campaigns contain columns of loads that no hidden effect depends on."""
    chance = stream(seed, "columns")
    return tuple(name for name in ("tilt_moment_Nm", "axial_force_N") if chance.random() < 0.3)


def _make(
    kind: str,
    index: int,
    seed: int,
    sigma: float,
    plan: str,
    conditions: Conditions,
    only: tuple[str, ...],
) -> Campaign:
    chance = stream(seed, "choice")
    names: tuple[str, ...] | list[str]
    if kind == "clean":
        return make_campaign(seed, index % len(SIZES), {}, plan, conditions, kind=kind)
    if kind == "pair":
        # Two that are not confounded, the second at half the size of the first.
        for _ in range(20):
            names = chance.choice(SINGLES, 2, replace=False).tolist()
            sizes = dict(zip(names, (2 * sigma, sigma), strict=True))
            try:
                campaign = make_campaign(
                    seed, index % len(SIZES), sizes, plan, conditions, kind=kind
                )
            except TooSmallError:
                continue
            left = np.column_stack([campaign.residuals[name].left_rad for name in names])
            found = campaign.bench.information(left)
            if abs(found[0, 1]) < APART * np.sqrt(found[0, 0] * found[1, 1]):
                return campaign
        raise TooSmallError(f"seed {seed}: no pair of effects that the plan could separate")
    names = only or {"single": SINGLES, "outside": tuple(OUTSIDE), "aliased": ALIASED}[kind]
    # Every effect meets every drive before any meets one again.
    for attempt in range(len(names)):
        name = names[(index + attempt) % len(names)]
        drive = (index // len(names) + index) % len(SIZES)
        try:
            return make_campaign(seed, drive, {name: sigma}, plan, conditions, kind=kind)
        except TooSmallError:
            continue
    raise TooSmallError(f"the plan {plan} shows none of the effects")


def twins_of(campaign: Campaign, least: float = TOGETHER) -> dict[str, float]:
    """Effects that no method could separate from the hidden one, with the cosine between them."""
    if len(campaign.effects) != 1:
        return {}
    (truth,) = campaign.effects
    names = [
        name
        for name, hidden in EFFECTS.items()
        if name != truth
        and not hidden.spike
        and set(hidden.columns) <= set(campaign.columns)
        and not HIDDEN[truth].spike
    ]
    cosines = campaign.bench.twins(campaign.residuals[truth], names)
    return {name: cosine for name, cosine in cosines.items() if cosine > least}


def write_suite(
    kind: str,
    count: int,
    seeds: str,
    folder: Path,
    sigma: float = 0.5,
    plan: str | None = None,
    conditions: Conditions = STANDARD,
    twins: bool = True,
    report: Callable[[str], None] = print,
    skip: int = 0,
    every: int = 1,
    only: tuple[str, ...] = (),
) -> list[dict[str, Any]]:
    """Write `count` campaigns and their truths, with every n-th seed from `skip` on."""
    plan = plan or ("aliased" if kind == "aliased" else "standard")
    truths = []
    dealt_seeds = islice(enumerate(seeds_of(kind, seeds)), skip, skip + count * every, every)
    for index, seed in dealt_seeds:
        extra = tuple(dict.fromkeys(conditions.extra_columns + _extra_columns(seed)))
        dealt = Conditions(**{**vars(conditions), "extra_columns": extra})
        campaign = _make(kind, index, seed, sigma, plan, dealt, only)
        name = f"campaign_{seed:05d}"
        near = twins_of(campaign) if twins and kind in ("single", "aliased") else {}
        truth = campaign.write(folder, name, near)
        truths.append({"name": name} | truth)
        report(f"{name}: {truth['drive']}, {', '.join(campaign.effects) or 'nothing hidden'}")
    (folder / "suite.json").write_text(json.dumps(truths, indent=1) + "\n")
    return truths
