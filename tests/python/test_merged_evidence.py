"""Evidence of several campaigns, merged, says what a diagnosis of all their recordings says."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_discover import DRIVE, RATED_NM, RATIO, campaign, gap, ripple, write

from lostmotion.cli import main
from lostmotion.discover import diagnose
from lostmotion.discover.effects import library
from lostmotion.discover.merged import (
    Body,
    gather_body,
    judge_body,
    load_body,
    merge_bodies,
)
from lostmotion.errors import InputError
from lostmotion.recordings import Campaign


def diagnosis_of(data: Campaign) -> Any:
    return diagnose(data, ratio=RATIO, rated_torque_Nm=RATED_NM)


def body_of(data: Campaign) -> Body:
    first = diagnosis_of(data).selection.settled[0]
    return gather_body(first.base, first.noise, library(), RATIO)


def halves(data: Campaign) -> list[Body]:
    middle = len(data.runs) // 2
    return [body_of(Campaign(runs)) for runs in (data.runs[:middle], data.runs[middle:])]


@pytest.fixture(scope="module")
def warm() -> tuple[Campaign, list[Body]]:
    data = campaign(add=gap)
    return data, halves(data)


def test_two_halves_say_what_the_whole_says(warm: tuple[Campaign, list[Body]]) -> None:
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


def test_nothing_is_missing_when_nothing_is() -> None:
    found = judge_body(merge_bodies(halves(campaign(seed=2)), ["a", "b"]), library())
    assert found["verdict"] == "complete"
    assert found["effects"] == []


def test_what_no_effect_explains_hangs_on_torque() -> None:
    found = judge_body(merge_bodies(halves(campaign(add=ripple)), ["a", "b"]), library())
    assert found["verdict"] == "unexplained"
    assert found["unexplained"]["depends_on"][0]["covariate"] == "torque"


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
    assert one["verdict"] == two["verdict"]
    assert one["effects"] == two["effects"]
    assert one["ladder"][-1]["rms_arcsec"] == pytest.approx(
        two["ladder"][-1]["rms_arcsec"], rel=0.02
    )


def test_evidence_that_does_not_fit_together_is_refused(
    warm: tuple[Campaign, list[Body]], tmp_path: Path
) -> None:
    one, two = warm[1]
    with pytest.raises(InputError, match="recordings a second time"):
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
    assert capsys.readouterr().out.startswith("Missing: thermal_gap.")
    assert main(["merge", str(tmp_path / "one.npz"), str(tmp_path / "none.npz")]) == 2
    assert "none.npz" in capsys.readouterr().err
