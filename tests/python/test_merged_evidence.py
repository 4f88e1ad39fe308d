"""Merged evidence of several campaigns gives the diagnosis of all their recordings."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_campaigns import DRIVE, RATED_NM, RATIO, campaign, gap, ripple, write

from lostmotion.cli import main
from lostmotion.discover import diagnose, fit_model
from lostmotion.discover.common_columns import gather_body
from lostmotion.discover.merged_verdict import judge_body
from lostmotion.drives import parse_drive, read_drive
from lostmotion.effects.library import library
from lostmotion.errors import InputError
from lostmotion.evidence.file import Body, load_body
from lostmotion.evidence.merging import merge_bodies
from lostmotion.recordings import Campaign
from lostmotion.torsion_curve import run_plays
from lostmotion.units import ARCSEC


def diagnosis_of(data: Campaign) -> Any:
    return diagnose(None, data, ratio=RATIO, rated_torque_Nm=RATED_NM)


def body_of(data: Campaign) -> Body:
    return gather_body(diagnosis_of(data), library(), RATIO)


def halves(data: Campaign) -> list[Body]:
    middle = len(data.runs) // 2
    return [body_of(Campaign(runs)) for runs in (data.runs[:middle], data.runs[middle:])]


@pytest.fixture(scope="module")
def warm() -> tuple[Campaign, list[Body]]:
    data = campaign(add=gap)
    return data, halves(data)


def test_two_halves_have_the_verdict_of_the_whole(warm: tuple[Campaign, list[Body]]) -> None:
    data, bodies = warm
    whole = diagnosis_of(data).answer()
    found = judge_body(merge_bodies(bodies, ["a", "b"]), library())
    assert found["verdict"] == whole["verdict"] == "missing-effect"
    assert found["effects"] == whole["effects"] == ["thermal_gap"]
    assert found["runs"] == whole["runs"]
    assert found["samples"] == whole["samples"]
    for one, two in zip(found["ladder"], whole["ladder"], strict=True):
        assert one["rms_arcsec"] == pytest.approx(two["rms_arcsec"], rel=0.1)
        assert one["rms_heldout_arcsec"] == pytest.approx(two["rms_heldout_arcsec"], rel=0.1)
    assert found["noise_floor_arcsec"] == pytest.approx(whole["noise_floor_arcsec"], rel=0.15)
    assert set(found) >= {"candidates", "events", "smallest_detectable", "unexplained"}
    json.dumps(found, allow_nan=False)


def test_sizes_come_with_standard_errors(warm: tuple[Campaign, list[Body]]) -> None:
    found = judge_body(merge_bodies(warm[1], ["a", "b"]), library())
    first = found["candidates"][0]
    assert first["name"] == "thermal_gap"
    size, error = (first[key]["gap_rad_per_K"] for key in ("parameters", "standard_errors"))
    assert abs(size - 0.3 * ARCSEC) < 3 * error
    assert error < 0.1 * size
    assert set(first["parameters"]) == {"gap_rad_per_K", "gap_rad", "takeup_Nm"}


def test_the_smallest_detectable_is_that_of_all_recordings(
    warm: tuple[Campaign, list[Body]],
) -> None:
    found = judge_body(merge_bodies(warm[1], ["a", "b"]), library())["smallest_detectable"]
    whole = diagnosis_of(warm[0]).answer()["smallest_detectable"]
    both = found.keys() & whole.keys()
    assert {"thermal_stiffness", "wear"} & both
    for name in both:
        assert found[name]["unit"] == whole[name]["unit"]
        # Linearised at the baseline models of two halves, not at that of all runs.
        assert 1 / 3 < found[name]["value"] / whole[name]["value"] < 3, name


def test_sudden_steps_stay_in_the_evidence() -> None:
    data = campaign(add=gap, slip=(2, 20.0, 30.0))
    found = judge_body(merge_bodies(halves(data), ["a", "b"]), library())
    assert found["verdict"] == "unexplained"
    assert found["effects"] == ["thermal_gap"]
    (event,) = found["events"]
    assert event["run"] == "1:3"
    assert event["time_s"] == pytest.approx(20.0, abs=0.2)
    (alone,) = diagnosis_of(Campaign(data.runs[:6])).events
    assert event["size_arcsec"] == alone["size_arcsec"]
    steps = [one for one in found["unexplained"]["depends_on"] if one["covariate"] == "time"]
    assert "in run 1:3 at 20" in steps[0]["shape"]
    (first,) = [one for one in found["candidates"] if one["name"] == "thermal_gap"]
    size, error = (first[key]["gap_rad_per_K"] for key in ("parameters", "standard_errors"))
    assert abs(size - 0.3 * ARCSEC) < 3 * error


def test_an_archive_that_is_no_evidence_is_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "other.npz", schema=np.array("somebody/1"), data=np.arange(3))
    with pytest.raises(InputError, match="schema: found somebody/1, expected lostmotion"):
        load_body(tmp_path / "other.npz")
    np.savez(tmp_path / "bare.npz", data=np.arange(3))
    with pytest.raises(InputError, match="evidence by diagnose --save-evidence"):
        load_body(tmp_path / "bare.npz")


def test_a_complete_model_is_reported_complete() -> None:
    found = judge_body(merge_bodies(halves(campaign(seed=2)), ["a", "b"]), library())
    assert found["verdict"] == "complete"
    assert found["effects"] == []


def test_what_no_effect_explains_hangs_on_torque() -> None:
    found = judge_body(merge_bodies(halves(campaign(add=ripple)), ["a", "b"]), library())
    assert found["verdict"] == "unexplained"
    assert found["unexplained"]["depends_on"][0]["covariate"] == "torque"


def test_outlying_runs_are_named_by_their_campaign() -> None:
    def oven(columns: dict[str, Any], wound: Any) -> Any:
        hot = columns["input_angle"][0] in (0.7 * 4, 0.7 * 9, 0.7 * 13)
        return 6.0 * hot * np.tanh(wound / 0.2)

    data = campaign(seed=5, runs=18, add=oven, warm=False)
    bodies = halves(data)
    merged = merge_bodies(bodies, ["a", "b"])
    found, whole = judge_body(merged, library()), diagnosis_of(data).answer()
    assert (found["verdict"], found["effects"]) == ("unexplained", [])
    (one,) = found["unexplained"]["depends_on"]
    hot = [merged.about["runs"][run] for run in (4, 9, 13)]
    assert one["shape"] == "gap, in runs {}, {} and {} alone".format(*hot)
    (apart,) = whole["unexplained"]["depends_on"]
    assert one["rms_arcsec"] == pytest.approx(apart["rms_arcsec"], rel=0.05)
    assert found["next_experiment"] == whole["next_experiment"]


def friction_that_grows(columns: dict[str, Any], wound: Any) -> Any:
    """Friction proportional to the load, and a gap that opens with temperature: both large."""
    torque = columns["torque"]
    plays = run_plays(np.array([0.5, 1.5]), torque, 0.0).sum(axis=1)
    return 5.0 * plays * np.abs(torque) / RATED_NM + 3.0 * gap(columns, wound)


def test_large_effects_keep_their_names() -> None:
    whole = diagnosis_of(campaign(runs=14, add=friction_that_grows))
    body = gather_body(whole, library(), RATIO)
    found = judge_body(merge_bodies([body], ["a.npz"]), library())
    names = ["load_dependent_friction", "thermal_gap"]
    assert sorted(whole.effects) == sorted(found["effects"]) == names
    assert whole.verdict == found["verdict"] == "missing-effect"
    assert found["alone"] == [
        {"file": "a.npz", "runs": 14, "verdict": whole.verdict, "effects": whole.effects}
    ]
    assert "refit the effect" in found["next_experiment"]


def test_what_a_fitted_drive_has_is_not_missing_in_its_evidence(tmp_path: Path) -> None:
    data = campaign(add=gap)
    (tmp_path / "drive.toml").write_text(DRIVE)
    drive = read_drive(tmp_path / "drive.toml")
    fitted = parse_drive(fit_model(drive, data, add="thermal_gap").document(drive))
    whole = diagnose(fitted, data)
    body = gather_body(whole, library(), RATIO)
    found = judge_body(merge_bodies([body], ["a"]), library())
    assert (
        (found["verdict"], found["effects"]) == (whole.verdict, whole.effects) == ("complete", [])
    )
    assert found["ladder"][0]["rms_arcsec"] == pytest.approx(whole.ladder[0]["rms_arcsec"], rel=0.1)
    bare = Body(body.white, body.plain, body.point, body.spread, body.rows, dict(body.about))
    bare.about["effects"] = []
    with pytest.raises(InputError, match="b: effects: found no effect, expected thermal_gap as in"):
        merge_bodies([body, bare], ["a", "b"])


def test_evidence_reads_back_as_it_was(warm: tuple[Campaign, list[Body]], tmp_path: Path) -> None:
    body = warm[1][0]
    body.save(tmp_path / "one.npz")
    again = load_body(tmp_path / "one.npz")
    np.testing.assert_array_equal(again.white.gram, body.white.gram)
    np.testing.assert_array_equal(again.plain.gram, body.plain.gram)
    assert again.about == body.about
    assert list(again.white.blocks) == list(body.white.blocks)


def test_the_order_of_the_campaigns_does_not_matter(warm: tuple[Campaign, list[Body]]) -> None:
    one = judge_body(merge_bodies(warm[1], ["a", "b"]), library())
    two = judge_body(merge_bodies(warm[1][::-1], ["b", "a"]), library())
    assert one.pop("alone") == two.pop("alone")[::-1]
    assert one == two


def test_no_run_counts_twice(warm: tuple[Campaign, list[Body]]) -> None:
    first = warm[1][0]
    overlapping = body_of(Campaign(warm[0].runs[4:]))
    expected = "b: run 5: found the recording of run 5 in a, expected each recording once"
    with pytest.raises(InputError, match=expected):
        merge_bodies([first, overlapping], ["a", "b"])


def test_friction_that_sits_elsewhere_is_refused(warm: tuple[Campaign, list[Body]]) -> None:
    one, two = warm[1]
    other = copy.deepcopy(two)
    for evidence in (other.white, other.plain):
        evidence.fixed = evidence.fixed[:-8]
    expected = (
        "b: friction: found in parallel with the spring alone, expected outside it as well, as in a"
    )
    with pytest.raises(InputError, match=expected):
        merge_bodies([one, other], ["a", "b"])
    with pytest.raises(
        InputError,
        match="a: friction: found outside it as well, expected in parallel with the spring",
    ):
        merge_bodies([other, one], ["b", "a"])


def test_friction_of_other_operators_is_refused(warm: tuple[Campaign, list[Body]]) -> None:
    one, two = warm[1]
    other = copy.deepcopy(two)
    radii = list(one.about["radius_Nm"])
    other.about["radius_Nm"] = radii * 2
    expected = f"b: friction: found {2 * len(radii)} operators, expected {len(radii)} as in a: "
    with pytest.raises(InputError, match=expected + "the same --friction"):
        merge_bodies([one, other], ["a", "b"])


def test_evidence_that_does_not_fit_together_is_refused(
    warm: tuple[Campaign, list[Body]], tmp_path: Path
) -> None:
    one, two = warm[1]
    with pytest.raises(InputError, match="the same recordings twice"):
        merge_bodies([one, one], ["a", "b"])
    other = Body(two.white, two.plain, two.point, two.spread, two.rows, dict(two.about))
    other.about["rated_torque_Nm"] = 41.0
    with pytest.raises(InputError, match="b: rated_torque_Nm: found 41, expected 40 as in a"):
        merge_bodies([one, other], ["a", "b"])
    (tmp_path / "no.npz").write_bytes(b"not a zip")
    with pytest.raises(InputError, match="evidence by diagnose --save-evidence"):
        load_body(tmp_path / "no.npz")


def test_commands_save_and_merge(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    drive = tmp_path / "drive.toml"
    drive.write_text(DRIVE)
    data = campaign(add=gap)
    for name, runs in (("one", data.runs[:6]), ("two", data.runs[6:])):
        write(Campaign(runs), tmp_path / f"{name}.csv")
        words = ["diagnose", str(drive), str(tmp_path / f"{name}.csv"), "--quiet"]
        assert main([*words, "--save-evidence", str(tmp_path / f"{name}.npz")]) == 0
    capsys.readouterr()
    assert main(["merge", str(tmp_path / "one.npz"), str(tmp_path / "two.npz")]) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("Missing: thermal_gap.")
    assert "gap_rad_per_K" in printed
    assert "+-" in printed
    assert main(["merge", str(tmp_path / "one.npz"), str(tmp_path / "none.npz")]) == 2
    assert "none.npz" in capsys.readouterr().err
