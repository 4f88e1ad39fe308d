"""Effects that laboratories of other friction hide are named, and so is the friction itself."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rig.laboratory import Laboratory

from lostmotion.discover import diagnose
from lostmotion.discover.fitted_model import fit_model
from lostmotion.drives import read_drive
from lostmotion.recordings import read_campaign


@pytest.mark.parametrize(
    ("law", "noises", "seed"),
    [
        ("dead_zone", 2.0, 4),  # the common part of the gaps is in a curve far above its sheet
        ("lugre", 1.0, 2),  # wear gains as much, but does not predict the left-out runs as well
    ],
)
def test_a_gap_that_opens_with_temperature_is_no_scatter_and_no_wear(
    law: str, noises: float, seed: int, tmp_path: Path
) -> None:
    """On an arm that warms up: temperature and cycles rise together."""
    truth = Laboratory(seed, law, "arm").write(tmp_path, "thermal_gap", noises)
    drive = read_drive(tmp_path / "drive.toml")
    campaign = read_campaign(sorted(tmp_path.glob("*.csv.gz")), ratio=drive.ratio)
    found = diagnose(drive, campaign)
    assert (found.verdict, found.effects) == ("missing-effect", ["thermal_gap"])
    assert found.ladder[-1]["rms_arcsec"] < 1.02 * truth["noise_arcsec_rms"]


@pytest.mark.parametrize("seed", [40, 42])
def test_friction_that_falls_with_the_speed_of_sliding_is_no_lag_of_the_sensor(
    seed: int, tmp_path: Path
) -> None:
    """LuGre, with its Stribeck speed; a lag of the torque narrows fast loops as well."""
    lab = Laboratory(seed, "lugre", "bench")
    lab.write(tmp_path)
    drive = read_drive(tmp_path / "drive.toml")
    campaign = read_campaign(sorted(tmp_path.glob("*.csv.gz")), ratio=drive.ratio)
    found = diagnose(drive, campaign)
    assert (found.verdict, found.effects) == ("missing-effect", ["rate_dependent_friction"])
    speed = found.params["rate_dependent_friction.stribeck_rad_per_s"]
    assert speed.error
    assert abs(speed.value - lab.drive.stribeck_rad_per_s) < 3.0 * speed.error


@pytest.mark.parametrize(
    ("seed", "protocol", "effects"),
    [
        (31, "bench", {"rate_dependent_friction", "thermal_stiffness"}),
        # Eight runs do not separate the predictions of an effect and of the friction.
        (49, "8 runs", {"thermal_stiffness"}),
    ],
)
def test_what_explains_another_part_is_no_rival(
    seed: int, protocol: str, effects: set[str], tmp_path: Path
) -> None:
    """LuGre, whose friction falls with the speed of sliding, beside a hidden effect."""
    Laboratory(seed, "lugre", protocol).write(tmp_path, "thermal_stiffness", 2.0)
    drive = read_drive(tmp_path / "drive.toml")
    campaign = read_campaign(sorted(tmp_path.glob("*.csv.gz")), ratio=drive.ratio)
    found = diagnose(drive, campaign)
    assert found.verdict == "missing-effect"
    assert set(found.effects) == effects


def test_an_effect_is_kept_in_the_form_that_is_chosen_beside_it(tmp_path: Path) -> None:
    """Creep calls for friction in parallel, where Dahl's friction hides it in the form error."""
    truth = Laboratory(103, "dahl", "60 runs").write(tmp_path, "creep", 1.0)
    drive = read_drive(tmp_path / "drive.toml")
    campaign = read_campaign(sorted(tmp_path.glob("*.csv.gz")), ratio=drive.ratio)
    found = diagnose(drive, campaign)
    assert found.effects == ["creep"]
    assert found.ladder[-1]["rms_arcsec"] < 1.1 * truth["noise_arcsec_rms"]
    fitted = fit_model(drive, campaign, "creep")
    share, told = (one.params["creep.share"] for one in (fitted, found))
    assert told.value == pytest.approx(share.value)


def test_a_step_that_overshoots_the_kinks_is_damped(tmp_path: Path) -> None:
    """Files that begin in unknown states: no part of the undamped step lowers the misfit."""
    truth = Laboratory(109, "dead_zone", "strangers").write(tmp_path, "stiffness_modulation", 2.0)
    drive = read_drive(tmp_path / "drive.toml")
    campaign = read_campaign(sorted(tmp_path.glob("*.csv.gz")), ratio=drive.ratio)
    found = diagnose(drive, campaign)
    assert (found.verdict, found.effects) == ("missing-effect", ["stiffness_modulation"])
    assert found.ladder[-1]["rms_arcsec"] < 1.2 * truth["noise_arcsec_rms"]


def test_an_effect_is_not_kept_beside_the_one_that_it_imitated(tmp_path: Path) -> None:
    """With operators inside creep is selected second, after a lag that explains a part of it."""
    Laboratory(111, "lugre", "60 runs").write(tmp_path, "creep", 2.0)
    drive = read_drive(tmp_path / "drive.toml")
    campaign = read_campaign(sorted(tmp_path.glob("*.csv.gz")), ratio=drive.ratio)
    assert diagnose(drive, campaign, friction="inside").effects == ["creep"]
