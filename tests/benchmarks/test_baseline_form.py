"""The selected form of the baseline model is that of the drive, regardless of hidden effects."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rig.laboratory import Laboratory

from lostmotion.candidates.named import named_candidates
from lostmotion.discover import diagnose
from lostmotion.discover.baseline_form import choose_form, half_cycles, tried
from lostmotion.drives import read_drive
from lostmotion.effects.conditions import Conditions
from lostmotion.effects.library import library
from lostmotion.fit.baseline import BaselineModel
from lostmotion.model import make_torsion_curve
from lostmotion.recordings import Campaign, read_campaign


def fitted(
    law: str, protocol: str, folder: Path, effect: str = "", runs: int | None = None
) -> tuple[BaselineModel, float]:
    """A baseline model fitted to a laboratory's first recordings, and their true noise."""
    truth = Laboratory(2, law, protocol).write(folder, effect, 1.0)
    drive = read_drive(folder / "drive.toml")
    campaign: Campaign = read_campaign(sorted(folder.glob("*.csv.gz")), ratio=drive.ratio)
    campaign = Campaign(campaign.runs[:runs])
    sheet = make_torsion_curve(drive, campaign.largest_torque_Nm)
    base = BaselineModel(Conditions(campaign), drive.rated_torque_Nm, sheet)
    base.first_fit()
    return base, truth["noise_arcsec_rms"]


@pytest.mark.parametrize(
    ("law", "form"),
    [("maxwell", "inside"), ("dahl", "inside"), ("load", "inside+load"), ("outside", "both")],
)
def test_held_out_runs_decide_the_form(law: str, form: str, tmp_path: Path) -> None:
    base, noise = fitted(law, "8 runs", tmp_path)
    chosen = choose_form(base, library(), 100.0)
    assert chosen.form == form
    assert np.sqrt(chosen.tried[chosen.form].mean_square) < 1.2 * noise


@pytest.mark.parametrize(("law", "form"), [("load", "inside+load"), ("outside", "both")])
def test_a_missing_effect_of_the_temperature_does_not_hide_the_form(
    law: str, form: str, tmp_path: Path
) -> None:
    base, _ = fitted(law, "8 runs", tmp_path, "thermal_stiffness")
    assert choose_form(base, library(), 100.0).form == form


def test_an_effect_that_the_form_holds_is_not_named_beside_it(tmp_path: Path) -> None:
    base, _ = fitted("load", "8 runs", tmp_path)
    known = {name for name, effect in library().items() if effect.is_hysteresis}
    assert known
    for form, there in (("inside", True), ("inside+load", False)):
        model = choose_form(base, library(), 100.0, form=form).base
        candidates, closed = named_candidates(library(), model, model.at(), 100.0)
        assert (known <= {one.name for one in candidates}) is there
        assert (known <= set(closed)) is not there


def test_runs_that_are_predicted_have_no_part_in_the_fit(tmp_path: Path) -> None:
    """Further runs do not change the numbers that the forms are fitted to."""
    base, _ = fitted("load", "8 runs", tmp_path)
    rows = base.conditions.run_of < 6
    spoilt = base.copy()
    spoilt.measured = np.where(rows, base.measured, 3.0 * base.measured)
    made = []
    for model in (base, spoilt):
        model.fit(rows=rows)
        chosen = choose_form(model, library(), 100.0, rows=rows)
        asked = choose_form(model, library(), 100.0, form="inside+load", rows=rows)
        made.append((chosen.form, asked.base.hysteresis.shares))
    assert made[0][0] == made[1][0]
    np.testing.assert_allclose(made[0][1], made[1][1], rtol=1e-6, atol=1e-9)


def test_a_form_that_is_asked_for_is_used(tmp_path: Path) -> None:
    base, _ = fitted("maxwell", "8 runs", tmp_path)
    assert choose_form(base, library(), 100.0, form="both+load").form == "both+load"


def test_a_run_of_a_session_of_its_own_is_predicted_from_where_its_operators_stood(
    tmp_path: Path,
) -> None:
    """A file that is left out keeps its start state and offset: neither belongs to the drive."""
    base, noise = fitted("maxwell", "strangers", tmp_path)
    assert np.sqrt(tried(base, refits=True).mean_square) < 1.2 * noise


def test_half_cycles_of_few_runs_decide_whether_friction_grows_with_the_load(
    tmp_path: Path,
) -> None:
    """They do not decide where friction is: that needs loops of several sizes."""
    base, _ = fitted("load", "8 runs", tmp_path, runs=2)
    chosen = choose_form(base, library(), 100.0)
    assert chosen.form == "inside+load"
    assert set(chosen.tried) == {"inside", "inside+load"}


def test_a_half_cycle_ends_where_the_torque_changes_its_sign() -> None:
    torque = np.array([0.1, -0.1, 4.0, 0.2, -0.3, 0.1, -0.2, -4.0, -2.0, 3.0])
    assert half_cycles(torque).tolist() == [5, 9]
    assert half_cycles(np.array([1.0, -1.0])).tolist() == [1]
    assert half_cycles(np.zeros(3)).tolist() == []


def test_of_an_equal_form_and_effect_the_form_with_fewer_values_counts(tmp_path: Path) -> None:
    """On this arm friction that grows with the load explains friction in series as well."""
    Laboratory(45, "outside", "arm").write(tmp_path, "", 0.0)
    drive = read_drive(tmp_path / "drive.toml")
    campaign = read_campaign(sorted(tmp_path.glob("*.csv.gz")), ratio=drive.ratio)
    answer = diagnose(drive, campaign).answer()
    assert (answer["verdict"], answer["effects"]) == ("complete", [])
    assert answer["friction"] == "outside"
