"""The baseline model of a drive for its recordings, and the effects in a drive file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from lostmotion.arrays import FloatArray
from lostmotion.drives import (
    FREE_PLAY,
    KNOT,
    PLAY_RADIUS,
    Drive,
    effect_values,
)
from lostmotion.effects.columns import absorbed, missing_columns
from lostmotion.effects.conditions import Conditions
from lostmotion.effects.effect import Effect, find_effect
from lostmotion.effects.formula import written_formula
from lostmotion.errors import InputError
from lostmotion.fit.baseline import FILED, BaselineModel
from lostmotion.fit.terms import Term
from lostmotion.model import fit_values
from lostmotion.recordings import Campaign
from lostmotion.torsion_curve import TorsionCurve
from lostmotion.units import ARCSEC

SAMPLES_LEAST = 50
"""The baseline model alone has about forty parameters: slopes, operators, offsets."""


def effect_table(term: Term) -> dict[str, Any]:
    """An ``[[effect]]`` table."""
    values = {v.name: float(x) for v, x in zip(term.effect.values, term.values, strict=True)}
    formula = {"formula": term.effect.formula} if term.effect.in_file else {}
    return {"name": term.effect.name, **formula, **values}


def term_from(table: Mapping[str, Any], effects: Mapping[str, Effect], file: str) -> Term:
    """Read an ``[[effect]]`` table."""
    name = str(table["name"])
    own = table.get("formula")
    effect = find_effect(name, effects, file) if own is None else written_formula(own, name)
    place = f"effect.{effect.name}"
    values = np.array(effect_values(file, place, table, effect.ranges()))
    return Term(effect, values, effect.free())


def require_within_bounds(drive: Drive, effects: Mapping[str, Effect]) -> None:
    """Refuse a drive file with an effect that is limited by a bound."""
    for table in drive.effects:
        if table["name"] in effects or "formula" in table:
            term = term_from(table, effects, drive.file)
            refuse_bound(drive.file, term.effect, term.values)


def refuse_bound(file: str, effect: Effect, values: FloatArray) -> None:
    """Refuse values of an effect that are limited by a bound."""
    stopped = effect.stopped_at_bound(values)
    if stopped:
        known = next(value for value in effect.values if value.name == stopped[0])
        x = values[effect.values.index(known)]
        expected = f"a value between {known.low:g} and {known.high:g}, or --force"
        raise InputError(file, f"{effect.name}.{known.name}", f"{x:g}, its bound", expected)


def written_effects(drive: Drive) -> dict[str, Effect]:
    """Effects that a drive file contains as formulas."""
    return {
        table["name"]: written_formula(table["formula"], table["name"])
        for table in drive.effects
        if "formula" in table
    }


def restore(drive: Drive, base: BaselineModel, effects: Mapping[str, Effect]) -> None:
    """Set a baseline model to the values and effects of a drive file.

    An effect that the baseline model absorbs keeps the value of the file, because only one of the
    two can be estimated; a free play becomes a part of the torsion curve.
    """
    base.terms = [
        term_from(table, effects, drive.file)
        for table in drive.effects
        if table["name"] != FREE_PLAY
    ]
    for term in base.terms:
        if absorbed(term.effect, base.conditions):
            term.free = []
    knots, radii = fit_values(drive, KNOT), fit_values(drive, PLAY_RADIUS)
    if knots.size == 0 or radii.size == 0:
        return
    values = (drive.fit or {}).get("values", {})
    for filed in FILED:
        filed.restore(base, values)
    play = drive.free_play
    if play is not None:
        base.curve.add_step(play.step_rad / ARCSEC, play.within_Nm)
    base.hysteresis.fill_up()
    base.curve.prior_slopes = np.maximum(base.curve.slopes, 1e-3 * base.curve.mean_slope)


def torsion_curve_of(drive: Drive, torsion_curve: TorsionCurve | None) -> TorsionCurve | None:
    """Torsion curve of the data sheet with the free play of the drive file."""
    play = drive.free_play
    if play is None or torsion_curve is None:
        return torsion_curve
    return torsion_curve.with_step(play.step_rad, play.within_Nm)


def make_base(
    drive: Drive,
    campaign: Campaign,
    torsion_curve: TorsionCurve | None,
    effects: Mapping[str, Effect],
) -> BaselineModel:
    """Make the baseline model of a drive for a campaign, with the fit and effects of its file."""
    campaign.require_variation()
    sheet = torsion_curve_of(drive, torsion_curve)
    base = BaselineModel(Conditions(campaign), drive.rated_torque_Nm, sheet)
    restore(drive, base, effects)
    for term in base.terms:
        require(term.effect, base.conditions)
    return base


def require_plan(campaign: Campaign) -> None:
    """Refuse runs with too few samples for the baseline model, or with constant torque."""
    file = campaign.runs[0].file
    if campaign.rows < SAMPLES_LEAST:
        raise InputError(file, "", f"{campaign.rows} samples", f"at least {SAMPLES_LEAST}")
    campaign.require_torque()


def require_samples(campaign: Campaign) -> None:
    """Like `require_plan`, and refuse a lost motion that is constant in every run."""
    require_plan(campaign)
    campaign.require_variation()


def require(effect: Effect, conditions: Conditions) -> None:
    """Refuse an effect whose columns are missing."""
    missing = missing_columns(effect, conditions)
    if missing:
        raise InputError(
            conditions.campaign.runs[0].file,
            missing[0],
            "no such column",
            f"this column, for the effect {effect.name}",
        )
