"""Output of the commands for measurements: each statement once, with the next step."""

from __future__ import annotations

import itertools
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import spearmanr
from small_campaigns import DRIVE, campaign, gap, write

from lostmotion.cli import main
from lostmotion.commands.discover import show_diagnosis, show_next
from lostmotion.compare import Comparison, compare
from lostmotion.discover.recording_check import rank_correlation
from lostmotion.effects.effect import find_effect
from lostmotion.effects.library import library
from lostmotion.effects.loading import load
from lostmotion.errors import InputError
from lostmotion.fit.drive_file import term_from
from lostmotion.recordings import Campaign, Finding, read_campaign, say_findings
from lostmotion.torsion_curve import TorsionCurve
from lostmotion.units import ARCSEC
from lostmotion.workbench.bench import Bench


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("said")
    (made / "drive.toml").write_text(DRIVE)
    write(campaign(add=gap), made / "warm.csv")
    return made


def compare_runs(data: Campaign) -> Comparison:
    torque = np.linspace(-40.0, 40.0, 81)
    return compare(
        TorsionCurve(torque, (7.0 * torque + 25.0 * np.tanh(torque / 8.0)) * ARCSEC), data
    )


def said(capsys: pytest.CaptureFixture[str], *words: str | Path) -> str:
    assert main([str(word) for word in words]) == 0
    return capsys.readouterr().out


def test_a_diagnosis_states_sizes_and_the_next_step(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    printed = said(capsys, "diagnose", folder / "drive.toml", folder / "warm.csv")
    assert "  thermal_gap.gap_rad_per_K = 1.4" in printed
    assert "  thermal_gap.gap_rad = 0.05, fixed: saturation limit" in printed
    assert "at its bound" not in printed
    assert "next: Add it: fit --add thermal_gap. No further significant residual." in printed


def test_a_fit_lists_what_was_not_fitted(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ("fit", folder / "drive.toml", folder / "warm.csv", "--add", "thermal_gap")
    printed = said(capsys, *words, "-o", folder / "fitted.toml")
    assert any(
        line.split() == ["thermal_gap.gap_rad", "0.05,", "fixed:", "saturation", "limit"]
        for line in printed.splitlines()
    )
    assert "at its bound" not in printed


def step_answer(size: float) -> dict[str, Any]:
    return {
        "verdict": "unexplained",
        "effects": [],
        "runs": 8,
        "noise": {"within_runs_arcsec": 1.0},
        "noise_floor_arcsec": 1.0,
        "ladder": [{"effects": [], "rms_arcsec": 1.0, "rms_heldout_arcsec": 1.0}],
        "candidates": [],
        "events": [{"run": 3, "time_s": 20.5, "size_arcsec": size, "score": 9.0}],
        "unexplained": {
            "depends_on": [
                {"covariate": "time", "shape": "step of 2230 arcsec in run 3 at 20.5 s", "p": 1e-9},
                {"covariate": "torque", "shape": "gap, smooth", "p": 1e-9},
            ]
        },
        "next_experiment": "Look.",
    }


def test_a_sudden_step_is_reported_once(capsys: pytest.CaptureFixture[str]) -> None:
    show_diagnosis(step_answer(2234.0))
    out = capsys.readouterr().out
    assert "sudden: run 3 at 20.5 s, 2230 arcsec" in out
    assert out.count("20.5 s") == 1
    assert "depends on torque: gap, smooth" in out


def test_what_is_significant_and_does_not_count_is_reported_as_too_small(
    capsys: pytest.CaptureFixture[str],
) -> None:
    strong = {"testable": True, "evidence": 9.0, "p": 1e-4, "confused_with": [], "parameters": {}}
    candidates = [
        {**strong, "name": "creep", "size_arcsec": 0.1234, "too_small": True},
        {**strong, "name": "wear", "size_arcsec": 0.5, "too_small": False},
    ]
    show_diagnosis({**step_answer(1.0), "candidates": candidates})
    out = capsys.readouterr().out
    lines = {line.split()[0]: line for line in out.splitlines() if "nats" in line}
    assert lines["creep"].endswith("p = 0.0001  0.12 arcsec, too small to count")
    assert lines["wear"].endswith("p = 0.0001")


def test_findings_of_many_runs_are_one_line() -> None:
    findings = [Finding("ignored_column", "a.csv", name, None, 1, "not used") for name in "XYZ"]
    findings += [Finding("duplicate_time", "a.csv", "time_s", r, 10 * r, "kept") for r in (1, 2, 3)]
    findings += [Finding("nan", "a.csv", "torque_Nm", 2, 1, "rows left out")]
    assert say_findings(findings) == [
        "a.csv: not used: the columns X, Y, Z",
        "a.csv: time_s (runs 1, 2, 3): duplicate time x 60: kept",
        "a.csv: torque_Nm (run 2): nan x 1: rows left out",
    ]
    many = [Finding("gap", f"{r}.csv", "time_s", r, 1, "kept") for r in range(12)]
    assert say_findings(many) == ["0.csv and 11 more files: time_s (12 runs): gap x 12: kept"]
    many = [Finding("gap", "a.csv", "time_s", r, 1, "kept") for r in range(12)]
    assert say_findings(many) == ["a.csv: time_s (12 runs, 0 to 11): gap x 12: kept"]


def test_a_column_similar_to_a_missing_one_is_suggested(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "logger.csv"
    rows = [f"{t},{np.sin(t)},{0.01 * np.sin(t)},{20 + t}" for t in np.arange(60) * 0.1]
    file.write_text("\n".join(["TIME,torque_Nm,lost_motion_rad,TEMPERATURE", *rows]) + "\n")
    assert main(["check", str(file)]) == 2
    assert "expected time_s, or --map TIME=time_s" in capsys.readouterr().err
    data = read_campaign(file, mapping={"TIME": "time_s"})
    (line,) = say_findings(data.findings)
    assert line.endswith(
        "TEMPERATURE: ignored column x 1: not used; if it is the temperature: "
        "--map TEMPERATURE=temperature_C"
    )


def test_a_fit_that_is_worse_than_a_constant_explains_nothing(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = folder / "two.csv"
    file.write_text("time_s,torque_Nm,lost_motion_rad\n0,-30,0\n1,30,-1e-6\n")
    printed = said(capsys, "compare", folder / "drive.toml", file)
    assert "-" not in printed.split("variance")[0].split("(")[1]
    assert "2 samples cannot be fitted: at least 50" in printed
    assert "cannot be fitted" not in said(
        capsys, "compare", folder / "drive.toml", folder / "warm.csv"
    )


def test_runs_that_begin_elsewhere_are_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    data = campaign(runs=8)
    write(data, tmp_path / "whole.csv")
    whole = json.loads(said(capsys, "check", tmp_path / "whole.csv", "--json", "-"))
    apart = [
        run.label
        for before, run in itertools.pairwise(data.runs)
        if abs(run.torque_Nm[0] - before.torque_Nm[-1]) > 2.0
    ]
    assert whole["begin_elsewhere"] == apart
    cut = data.runs[3].columns
    data.runs[3].columns = {name: values[40:] for name, values in cut.items()}
    write(data, tmp_path / "cut.csv")
    printed = said(capsys, "check", tmp_path / "cut.csv")
    labels = ", ".join(map(str, sorted({*apart, data.runs[3].label})))
    assert f"begin at a torque other than the last of the previous run: {labels}" in printed


def test_a_clock_that_no_drive_needs_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "drive.toml").write_text(DRIVE)
    rows = [f"{k * 1e-300:g},{40 * np.sin(k / 30):.4f}" for k in range(300)]
    (tmp_path / "plan.csv").write_text("\n".join(["time_s,torque_Nm", *rows]) + "\n")
    assert main(["forecast", str(tmp_path / "drive.toml"), str(tmp_path / "plan.csv")]) == 2
    said_once = capsys.readouterr().err
    assert "plan.csv: time_s: found steps of 1e-300 s, expected 1e-09 s or more" in said_once
    (tmp_path / "data.csv").write_text(
        "\n".join(["time_s,torque_Nm,lost_motion_rad", *(f"{row},0.001" for row in rows)]) + "\n"
    )
    with pytest.raises(InputError, match=r"data\.csv: time_s: found steps of 1e-300 s"):
        read_campaign(tmp_path / "data.csv")


def test_a_ripple_in_torque_hangs_on_the_torque() -> None:
    data = campaign(add=lambda columns, _: 5.0 * np.cos(2 * np.pi * columns["torque"] / 6.0))
    shares = {failure.covariate: failure.share for failure in compare_runs(data).failures}
    assert shares["torque"] > 0.5
    assert max(shares, key=lambda name: shares[name]) == "torque"


def test_rank_correlation_is_that_of_scipy() -> None:
    random = np.random.default_rng(5)
    for levels in (3, 8, 1000):
        a, b = random.integers(0, levels, (2, 30)).astype(np.float64)
        assert rank_correlation(a, b) == pytest.approx(spearmanr(a, b).statistic, abs=1e-12)


def test_an_effect_that_is_nowhere_may_be_ones_own() -> None:
    with pytest.raises(InputError, match=r"did you mean 'creep'.*or your own by --effects FILE"):
        find_effect("crepe", library())


OWN = """
from lostmotion.discover import Value, formula

warm_gap = formula(
    "warm_gap",
    "size_rad_per_K * (temperature_C - 20) * tanh(wound_Nm / 0.5)",
    values=[Value("size_rad_per_K", role="linear", typical=1e-6, low=-1e-3, high=1e-3)],
)
"""


def test_the_workbench_reads_a_fitted_drive_as_the_commands_do(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "own.py").write_text(OWN)
    own = ("--effects", folder / "own.py")
    fitted, data = folder / "own.toml", folder / "warm.csv"
    words = ("fit", folder / "drive.toml", data, "--add", "warm_gap", *own, "-o", fitted)
    said(capsys, *words)
    answer = json.loads(said(capsys, "compare", fitted, data, *own, "--json", "-"))
    bench = Bench(effects={**library(), **load(folder / "own.py")})
    try:
        bench.load_drive(fitted)
        bench.load_recordings([data], {}, lambda *_: None)
        assert bench.comparison is not None
        assert bench.comparison.answer() == answer
        assert answer["effects"] == ["warm_gap"]
        header, _ = bench.export(".h", [], "full", "joint")
        assert b"lm_effect_warm_gap" in header
    finally:
        bench.close()


def test_next_states_what_the_diagnosis_was(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ("next", folder / "drive.toml", folder / "warm.csv", "--plan", folder / "warm.csv")
    printed = said(capsys, *words)
    assert printed.startswith("Missing: thermal_gap.\n\nto decide between thermal_gap, ")


def test_evidence_of_any_size_is_written_without_a_power_of_ten(
    capsys: pytest.CaptureFixture[str],
) -> None:
    answer = {
        "diagnosis": {**step_answer(30.0), "verdict": "ambiguous", "effects": ["a", "b"]},
        "between": ["a", "b"],
        "runs": [{"run": "fast", "separation_nats": 48140.01, "per_minute": 96280.02}],
    }
    show_next(answer)
    assert "run fast: 48100 nats, 96300 a minute" in capsys.readouterr().out


def test_an_unknown_effect_named_by_a_file_is_reported_with_the_file() -> None:
    with pytest.raises(InputError, match=r"own\.toml: flange: found no such effect, .*--effects"):
        term_from({"name": "flange", "bend_rad": 1e-6}, library(), "own.toml")


def test_a_plan_needs_no_lost_motion(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = [row.split(",") for row in (folder / "warm.csv").read_text().splitlines()]
    known = [i for i, name in enumerate(rows[0]) if not name.startswith(("lost_", "output_"))]
    plan = tmp_path / "plan.csv"
    plan.write_text("".join(",".join(row[i] for i in known) + "\n" for row in rows))
    assert main(["forecast", str(folder / "drive.toml"), str(plan)]) == 0
    assert "thermal_gap" in capsys.readouterr().out


def test_a_forecast_of_few_runs_states_it(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = (folder / "warm.csv").read_text().splitlines()
    place = rows[0].split(",").index("run")
    first = {row.split(",")[place] for row in rows[1:]}
    kept = sorted(first, key=float)[:3]
    few = tmp_path / "few.csv"
    few.write_text("\n".join([rows[0], *(r for r in rows[1:] if r.split(",")[place] in kept), ""]))
    assert main(["forecast", str(folder / "drive.toml"), str(few)]) == 0
    assert "fewer than 6 runs" in capsys.readouterr().out
    assert main(["forecast", str(folder / "drive.toml"), str(folder / "warm.csv")]) == 0
    assert "fewer than" not in capsys.readouterr().out
