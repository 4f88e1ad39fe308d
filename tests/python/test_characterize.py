"""`characterize`: figures of simulated loops within their stated errors, and the file it writes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from loops_of_known_drives import ARCMIN, ARCSEC, SIZES, Loop
from scipy import stats

from lostmotion.characterize import characterize, standard_figures
from lostmotion.characterize.backlash import find_backlash
from lostmotion.characterize.characterization import CURVE, fit_torsion_curve
from lostmotion.characterize.figures import Estimate, hysteresis_loss, lost_motion
from lostmotion.characterize.stretches import collect
from lostmotion.characterize.three_slopes import developed
from lostmotion.cli import main
from lostmotion.compare import compare, zero_widths
from lostmotion.discover.fitted_model import fit_model
from lostmotion.drives import parse_drive, read_drive
from lostmotion.effects.library import library
from lostmotion.errors import InputError
from lostmotion.fit.drive_file import make_base
from lostmotion.recordings import Campaign, Run, read_campaign
from lostmotion.threads import one_thread

DATA = Path(__file__).parents[1] / "data"

FIGURES = (
    "T1",
    "K1",
    "T2",
    "K2",
    "K3",
    "lost motion 3 %",
    "lost motion 4 %",
    "hysteresis",
)


def campaign_of(loop: Loop, seed: int) -> Campaign:
    runs = []
    for number, (torque, angle) in enumerate(loop.runs(seed), start=1):
        columns = {
            "time": 0.05 * np.arange(torque.size),
            "torque": torque,
            "lost_motion": angle,
        }
        runs.append(Run(number, "simulated.csv", columns))
    return Campaign(runs)


def figures_of(loop: Loop, seed: int) -> tuple[dict[str, Estimate], float]:
    """Figures by the names of `FIGURES`, without the search for a backlash, and their dof."""
    campaign = campaign_of(loop, seed)
    samples = collect(campaign)
    fit, curve = fit_torsion_curve(samples)
    assert fit is not None
    found = dict(curve)
    for share in (0.03, 0.04):
        torque = share * loop.rated
        window = collect(campaign, window_Nm=8 * torque)
        found[f"lost motion {100 * share:.0f} %"] = lost_motion(window, torque, fit)
    found["hysteresis"] = hysteresis_loss(samples, fit)
    return found, fit.dof


def truths(loop: Loop) -> dict[str, float]:
    return {
        **loop.truth,
        "lost motion 3 %": loop.lost_motion(0.03),
        "lost motion 4 %": loop.lost_motion(0.04),
        "hysteresis": loop.hysteresis,
    }


def within(found: Estimate, truth: float, dof: float, confidence: float) -> bool:
    """Whether the truth is within the interval of a confidence, by the stated error."""
    assert found.value is not None
    assert found.standard_error is not None
    if confidence == 0.95:
        assert found.interval is not None
        return found.interval[0] <= truth <= found.interval[1]
    half = float(stats.t.ppf(0.5 + confidence / 2, dof)) * found.standard_error
    return abs(found.value - truth) <= half


SEEDS = 200


def test_intervals_cover_the_truth_as_often_as_they_state() -> None:
    """Of 200 drives 68 % and 95 %: binomial limits at 4 standard errors of a share of 200.

    Six loops have five degrees of freedom; with coloured noise and loops that differ, errors from
    the residual of single samples would be several times too small.
    """
    loop = Loop(samples=400)
    truth = truths(loop)
    hits = {name: {0.68: 0, 0.95: 0} for name in FIGURES}
    missing = dict.fromkeys(FIGURES, 0)
    with one_thread():
        for seed in range(SEEDS):
            found, dof = figures_of(loop, seed)
            for name in FIGURES:
                if found[name].value is None:
                    missing[name] += 1
                    continue
                for confidence in (0.68, 0.95):
                    hits[name][confidence] += within(found[name], truth[name], dof, confidence)
    print({name: (count, missing[name]) for name, count in hits.items()})
    assert max(missing.values()) <= 0.02 * SEEDS
    for name, count in hits.items():
        seen = SEEDS - missing[name]
        for confidence, limit in ((0.68, 0.132), (0.95, 0.062)):
            share = count[confidence] / seen
            assert abs(share - confidence) <= limit, f"{name}: {share:.3f} of {confidence}"


@pytest.mark.parametrize("hysteresis", [1.0 * ARCMIN, 3.0 * ARCMIN])
def test_a_transition_that_ends_behind_a_kink_does_not_move_it(hysteresis: float) -> None:
    """Friction that reverses within a third of the amplitude bends the middle of the loop there.

    Of 40 drives 95 %: the binomial limit at 4 standard errors is 33.
    """
    loop = Loop(shape="many contacts", hysteresis=hysteresis, samples=1200)
    hits, seen = dict.fromkeys(CURVE, 0), dict.fromkeys(CURVE, 0)
    with one_thread():
        for seed in range(40):
            _, curve = fit_torsion_curve(collect(campaign_of(loop, seed)))
            for name in CURVE:
                if curve[name].value is not None:
                    seen[name] += 1
                    hits[name] += within(curve[name], loop.truth[name], 0.0, 0.95)
    print(hits, seen)
    assert min(seen.values()) >= 38
    for name in CURVE:
        assert hits[name] >= seen[name] - 7, name


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("shape", ["ellipse", "coulomb"])
@pytest.mark.parametrize("from_rest", [False, True])
def test_catalogue_sizes_come_out_within_a_few_percent(
    size: int, shape: str, from_rest: bool
) -> None:
    """Loops that close as an ellipse and loops of Coulomb friction; from rest and from a tip."""
    loop = Loop(size=size, shape=shape, from_rest=from_rest, scatter=0.001)
    found, _ = figures_of(loop, seed=7)
    for name, truth in truths(loop).items():
        limit = 0.08 if name.startswith(("T", "lost")) else 0.04
        assert found[name].value == pytest.approx(truth, rel=limit), name


def test_a_single_loop_states_larger_errors_and_states_what_is_not_in_them() -> None:
    single = characterize(campaign_of(Loop(loops=1), 3), rated_torque_Nm=67.0)
    answer = single.answer()
    assert answer["standard_errors_from"] == "pieces of loops"
    assert any("do not include" in line for line in answer["assumptions"])
    for name in ("T1", "K1", "K2", "K3"):
        assert within(single.figures.curve[name], Loop().truth[name], 0.0, 0.95), name


@pytest.mark.parametrize("gap", [0.3 * ARCMIN, 2.0 * ARCMIN])
def test_a_gap_is_found_and_leaves_the_slopes_alone(gap: float) -> None:
    found = standard_figures(campaign_of(Loop(gap=gap, loops=8), 5), 67.0)
    backlash = found.backlash.figure
    assert backlash.value == pytest.approx(gap, abs=max(0.02 * gap, 0.03 * ARCMIN))
    assert found.curve["K1"].value == pytest.approx(31e3, rel=0.02)
    for share, truth in ((0.03, Loop(gap=gap).lost_motion(0.03)),):
        assert found.lost_motion[share].value == pytest.approx(truth, rel=0.05)


@pytest.mark.parametrize("share", [0.5, 1.0, 2.0])
def test_a_fit_has_the_gap_in_its_torsion_curve_alone(share: float) -> None:
    """The gap of the file is where the fit starts; that of the recordings is what it finds."""
    gap = 20.0 * ARCMIN
    known = characterize(campaign_of(Loop(gap=gap, loops=8), 5), rated_torque_Nm=67.0)
    drive = parse_drive(known.document())
    assert [table["name"] for table in drive.effects] == ["free_play"]
    campaign = campaign_of(Loop(gap=share * gap, loops=8), 7)
    model = fit_model(drive, campaign)
    assert not model.base.terms
    assert "effect" not in model.document(drive)
    assert model.ladder[-1]["rms_arcsec"] < 2.0
    again = make_base(parse_drive(model.document(drive)), campaign, None, library())
    assert np.array_equal(again.curve.slopes * ARCSEC, model.base.curve.slopes * ARCSEC)
    if share == 1.0:
        assert compare(drive, campaign).answer()["unfitted_rms_arcsec"] < 30.0


def test_a_fitted_file_that_has_the_gap_apart_gives_the_same_angle() -> None:
    """Files of earlier versions have slopes and a free play, both fitted."""
    campaign = campaign_of(Loop(gap=2.0 * ARCMIN, loops=8), 5)
    drive = parse_drive(characterize(campaign, rated_torque_Nm=67.0).document())
    document = fit_model(drive, campaign).document(drive)
    one = make_base(parse_drive(document), campaign, None, library())
    document["effect"] = drive.document["effect"]
    both = make_base(parse_drive(document), campaign, None, library())
    play = drive.effects[0]
    torque = np.linspace(-67.0, 67.0, 401)
    share = np.clip(torque / play["takeup_Nm"], -1, 1)
    added = both.curve.angle(torque) - one.curve.angle(torque)
    assert added == pytest.approx(play["gap_rad"] / ARCSEC * share, abs=1e-9)
    with pytest.raises(InputError, match="absorbed by the torsion curve"):
        fit_model(drive, campaign, ["free_play"])


def test_without_a_gap_there_is_none_above_a_stated_size() -> None:
    bounds = []
    with one_thread():
        for seed in range(12):
            steady = developed(collect(campaign_of(Loop(), seed)))
            found = find_backlash(steady, 3)
            assert found.figure.value is None
            bounds.append(found.none_above_rad)
    assert max(bounds) < 0.3 * ARCMIN


def test_a_curve_that_is_soft_for_long_has_a_soft_slope_and_no_gap() -> None:
    """The shipped joint has a wind-up over some N m about zero, which its sheet states as K1."""
    joint = DATA / "joint"
    drive = read_drive(joint / "joint.toml")
    campaign = read_campaign(joint / "joint.csv.gz", ratio=drive.ratio)
    found = standard_figures(campaign, drive.rated_torque_Nm)
    assert found.backlash.figure.value is None
    assert "soft first slope" in found.backlash.figure.reason
    assert found.curve["K1"].value < 0.6 * found.curve["K2"].value


def test_a_preload_stiffens_the_first_slope_and_closes_the_lost_motion() -> None:
    """Six steps of a preload screw on a printed reducer, which is known to close its play."""
    campaign = read_campaign(DATA / "cycloidal_preload" / "conic_axial.csv.gz")
    stiffness, lost = [], []
    for step in range(0, 600, 100):
        runs = [run for run in campaign.runs if np.median(run.columns["axial_force"]) == step]
        found = standard_figures(Campaign(runs), 35.0)
        stiffness.append(found.curve["K1"].value)
        lost.append(found.lost_motion[0.04].value)
    assert stiffness == sorted(stiffness)
    assert np.mean(lost[3:]) < 0.8 * np.mean(lost[:2])


def test_loops_below_the_second_knee_give_no_third_slope() -> None:
    found = standard_figures(campaign_of(Loop(amplitude=40.0), 1), 67.0)
    assert found.curve["K3"].value is None
    assert "40 N m" in found.curve["K3"].reason
    assert found.curve["K2"].value == pytest.approx(50e3, rel=0.02)
    document = characterize(campaign_of(Loop(amplitude=40.0), 1), rated_torque_Nm=67.0).document()
    assert document["catalogue"]["K3_Nm_per_rad"] == document["catalogue"]["K2_Nm_per_rad"]
    said = document["characterization"]["assumptions"]
    assert any("Beyond 40 N m" in line for line in said)
    assert any("hysteresis loss" in line for line in said)


def test_the_figures_follow_the_mean_curve_whatever_its_direction_of_use() -> None:
    """A drive measured with both signs reversed is the same drive."""
    loop = Loop()
    turned = Campaign(
        [
            Run(
                run.label,
                run.file,
                {
                    "time": run.time_s,
                    "torque": -run.torque_Nm,
                    "lost_motion": -run.lost_motion_rad,
                },
            )
            for run in campaign_of(loop, 2).runs
        ]
    )
    one = standard_figures(campaign_of(loop, 2), 67.0)
    other = standard_figures(turned, 67.0)
    for name in ("K1", "K2", "K3"):
        assert other.curve[name].value == pytest.approx(one.curve[name].value, rel=1e-3)
    assert other.hysteresis_loss.value == pytest.approx(one.hysteresis_loss.value, rel=1e-3)


def test_one_direction_gives_slopes_and_states_why_there_is_no_lost_motion() -> None:
    runs = []
    for number, (torque, angle) in enumerate(Loop(loops=5).runs(1), start=1):
        up = torque > -0.5
        columns = {
            "time": np.arange(np.count_nonzero(up)) * 0.05,
            "torque": torque[up],
            "lost_motion": angle[up],
        }
        runs.append(Run(number, "one_way.csv", columns))
    found = standard_figures(Campaign(runs), 67.0)
    assert found.curve["K1"].value == pytest.approx(31e3, rel=0.05)
    for figure in (*found.lost_motion.values(), found.hysteresis_loss):
        assert figure.value is None
        assert "one direction" in figure.reason


def test_one_branch_gives_slopes_and_no_width() -> None:
    runs = []
    for number, (torque, angle) in enumerate(Loop(loops=5, hysteresis=0.0).runs(1), start=1):
        half = torque.size // 2
        columns = {
            "time": np.arange(half) * 0.05,
            "torque": torque[:half],
            "lost_motion": angle[:half],
        }
        runs.append(Run(number, "loading.csv", columns))
    found = standard_figures(Campaign(runs), 67.0)
    assert found.curve["K1"].value == pytest.approx(31e3, rel=0.05)
    assert "one branch" in found.hysteresis_loss.reason


def test_a_lost_motion_that_falls_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = Loop(loops=2).write(tmp_path / "loops.csv")
    words = ["characterize", str(file), "--map", "torque_Nm=-torque_Nm"]
    assert main([*words, "-o", str(tmp_path / "drive.toml")]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "--map" in said
    assert not (tmp_path / "drive.toml").exists()


def test_the_written_file_is_taken_by_every_other_command(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = Loop(loops=6, samples=240, shape="coulomb").write(tmp_path / "loops.csv", ratio=100.0)
    drive = tmp_path / "drive.toml"
    words = ["characterize", str(file), "--ratio", "100", "--rated-torque-Nm", "67"]
    assert main([*words, "-o", str(drive), "--json", str(tmp_path / "answer.json")]) == 0
    answer = json.loads((tmp_path / "answer.json").read_text())
    assert answer["schema"] == "lostmotion.characterization/1"
    read = read_drive(drive)
    assert read.catalogue is not None
    found = answer["torsion_curve"]["K2_Nm_per_rad"]["value"]
    assert read.catalogue.K2_Nm_per_rad == pytest.approx(found, rel=1e-12)
    assert read.ratio == 100.0
    assert read.rated_torque_Nm == 67.0
    capsys.readouterr()
    fitted = tmp_path / "fitted.toml"
    for command in (
        ["predict", str(drive)],
        [
            "export",
            str(drive),
            "-o",
            str(tmp_path / "sheet.bin"),
            "--set",
            "period_us=500",
        ],
        ["compare", str(drive), str(file), "--json", "-"],
        ["diagnose", str(drive), str(file)],
        ["fit", str(drive), str(file), "--friction", "inside", "-o", str(fitted)],
        [
            "export",
            str(fitted),
            "-o",
            str(tmp_path / "params.h"),
            "--set",
            "period_us=500",
        ],
        ["characterize", str(file), str(drive), "-o", str(tmp_path / "again.toml")],
    ):
        assert main(command) == 0, (command, capsys.readouterr().err)
        said = capsys.readouterr().out
        if command[0] == "compare":
            measured = json.loads(said)["standard_figures"]["measured"]["torsion_curve"]
            assert measured["K2_Nm_per_rad"]["value"] == pytest.approx(found, rel=1e-6)
    assert read_drive(tmp_path / "again.toml").catalogue == pytest.approx(read.catalogue)


WIDTHS_ARCMIN = pytest.mark.parametrize("width_arcmin", [0.3, 1.0])
"""Widths of loops of Coulomb friction: possible ones, and one that no drive has.

Its angle rises while the torque falls after a tip, by more than the spring returns.
"""


def coulomb_loops(folder: Path, width_arcmin: float) -> tuple[Path, Path]:
    """Loops of Coulomb friction in series, and the drive file that `characterize` makes of them."""
    loops = Loop(loops=6, samples=240, shape="coulomb", hysteresis=width_arcmin * ARCMIN)
    file = loops.write(folder / "loops.csv", ratio=100.0)
    drive = folder / "drive.toml"
    words = ["characterize", str(file), "--ratio", "100", "--rated-torque-Nm", "67"]
    assert main([*words, "-o", str(drive)]) == 0
    return drive, file


@WIDTHS_ARCMIN
def test_a_model_of_coulomb_friction_in_series_has_the_figures_of_its_loops(
    width_arcmin: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    drive, file = coulomb_loops(tmp_path, width_arcmin)
    capsys.readouterr()
    assert main(["compare", str(drive), str(file), "--json", "-"]) == 0
    answer = json.loads(capsys.readouterr().out)
    measured, model = (
        answer["standard_figures"][kind]["torsion_curve"]["K2_Nm_per_rad"]["value"]
        for kind in ("measured", "model")
    )
    assert model == pytest.approx(measured, rel=0.02)
    if width_arcmin < 1:
        assert answer["friction"] == "outside"
        assert answer["rms_arcsec"] < 1.2 * Loop().noise / ARCSEC


@WIDTHS_ARCMIN
def test_the_form_that_a_fit_chooses_is_taken_by_the_controller(
    width_arcmin: float, tmp_path: Path
) -> None:
    drive, file = coulomb_loops(tmp_path, width_arcmin)
    fitted = tmp_path / "fitted.toml"
    assert main(["fit", str(drive), str(file), "-o", str(fitted)]) == 0
    words = ["export", str(fitted), "-o", str(tmp_path / "params.h"), "--set", "period_us=500"]
    assert main([*words, "--profile", "standard"]) == 0


def test_what_is_not_stated_is_assumed_by_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = Loop(loops=4).write(tmp_path / "loops.csv")
    assert (
        main(
            [
                "characterize",
                str(file),
                "-o",
                str(tmp_path / "drive.toml"),
                "--json",
                "-",
            ]
        )
        == 0
    )
    answer = json.loads(capsys.readouterr().out)
    assert answer["ratio"] is None
    assert answer["rated_torque_from"] == "largest torque of the loops"
    assert answer["rated_torque_Nm"] == pytest.approx(67, rel=0.01)
    said = " ".join(answer["assumptions"])
    assert "rated torque is not stated" in said
    assert "ratio is not stated" in said


def test_the_ratio_is_asked_for_or_taken_from_runs_that_turn(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    torque, lost = Loop(loops=1).runs(1)[0]
    time = 0.05 * np.arange(torque.size)
    for turn, name in ((0.004, "still.csv"), (3.0, "turning.csv")):
        turned = turn * np.sin(0.3 * time)
        table = np.column_stack((time, torque, 80.5 * turned, turned + lost))
        head = "time_s,torque_Nm,input_angle_rad,output_angle_rad"
        np.savetxt(tmp_path / name, table, "%.12g", ",", header=head, comments="")
    assert main(["characterize", str(tmp_path / "still.csv")]) == 2
    assert "--ratio" in capsys.readouterr().err
    assert main(["characterize", str(tmp_path / "turning.csv"), "--json", "-"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["ratio"] == pytest.approx(80.5, rel=1e-3)
    assert answer["ratio_from"] == "runs that turn"


def test_the_sheet_is_beside_what_was_measured(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = Loop(loops=4).write(tmp_path / "loops.csv", ratio=100.0)
    sheet = str(DATA / "drives" / "size_25.toml")
    report = tmp_path / "report.html"
    assert main(["characterize", str(file), sheet, "--report", str(report)]) == 0
    said = capsys.readouterr().out
    assert "sheet" in said
    row = next(line for line in said.splitlines() if line.strip().startswith("K2"))
    assert row.split()[-1] == "50000"
    assert "Standard figures" in report.read_text()


@pytest.mark.parametrize(
    "words",
    [
        ["--rated-torque-Nm", "0"],
        ["--rated-torque-Nm", "much"],
        ["--ratio", "0.5"],
    ],
)
def test_options_out_of_range_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str]
) -> None:
    file = Loop(loops=2).write(tmp_path / "loops.csv")
    assert main(["characterize", str(file), *words]) == 2
    assert words[0] in capsys.readouterr().err


def test_the_printed_reducer_has_the_width_that_its_branches_have() -> None:
    """Loops at ±25 N m of the shipped recording, whose widths at zero differ by a quarter."""
    drive = read_drive(DATA / "cycloidal_locked_output" / "drive.toml")
    campaign = read_campaign(
        DATA / "cycloidal_locked_output" / "base_onyx_runin5.csv",
        ratio=drive.ratio,
        mapping=drive.columns,
    )
    found = characterize(drive, campaign)
    assert found.figures.samples.runs == 3
    large = [run for run in campaign.runs if np.max(run.torque_Nm) > 20]
    widths = [zero_widths(run.torque_Nm, run.lost_motion_rad[:, None]) for run in large]
    assert len(widths) == 3
    assert all(width is not None for width in widths)
    assert found.figures.hysteresis_loss.value == pytest.approx(
        float(np.mean(np.concatenate(widths))), rel=0.25
    )
    assert found.figures.curve["K1"].value is not None


def test_smallest_noise_is_no_trouble() -> None:
    """Loops without noise or scatter: the figures are the truth's, and no error is negative."""
    loop = Loop(noise=0.0, scatter=0.0, loops=4)
    found, _ = figures_of(loop, 1)
    for name, truth in truths(loop).items():
        assert found[name].value == pytest.approx(truth, rel=0.02), name
        assert (found[name].standard_error or 0.0) >= 0.0
    assert found["hysteresis"].standard_error < 0.5 * ARCSEC


def test_no_stiffness_is_stated_where_all_loops_repeat_what_is_no_torsion_curve() -> None:
    # Spring of 40 N m/rad by the maker, gears and Hall sensors around it, no load.
    campaign = read_campaign(DATA / "hebi_x5" / "hebi_x5.csv", ratio=273.18)
    figures = characterize(campaign, ratio=273.18).answer()
    stiffness = figures["torsion_curve"]["K1_Nm_per_rad"]
    assert stiffness["value"] is None
    assert "does not depend on the torque" in stiffness["reason"]
    for share in (3, 4):
        low, high = figures[f"lost_motion_{share}_percent_arcmin"]["interval_95"]
        assert low < 0 < high
    assert any("K1 in the drive file" in line for line in figures["assumptions"])
