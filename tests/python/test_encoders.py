"""Encoders: continuous readings stay unchanged, lost turns are restored, the rest is reported.

The test makes thousands of logs, each from a motion of the output, a lost motion and two encoders.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from lostmotion.cli import main
from lostmotion.recordings.encoders import OPEN_ACTION, TURN, Counter, count_rad, put_back
from lostmotion.recordings.findings import Finding
from lostmotion.recordings.soundness import sound_run
from lostmotion.units import ARCMIN

LOGS = 3000
RATIOS = (11, 13, 30, 50, 80, 100, 101, 120, 160, 272.22, 51.5)
MOTIONS = ("locked", "stations", "jumped stations", "turning", "swinging", "wandering")


@dataclass
class Log:
    """A log: readings of the encoders, and the truth."""

    ratio: float
    motion: str
    torque: np.ndarray
    input_rad: np.ndarray
    output_rad: np.ndarray
    lost_rad: np.ndarray
    single_in: bool
    single_out: bool

    @property
    def read(self) -> tuple[np.ndarray, np.ndarray]:
        """Readings of the two encoders."""
        return (
            np.mod(self.input_rad, TURN) if self.single_in else self.input_rad.copy(),
            np.mod(self.output_rad, TURN) if self.single_out else self.output_rad.copy(),
        )


def output_of(motion: str, rows: int, rng: np.random.Generator) -> np.ndarray:
    """Angle of the output without the lost motion."""
    i = np.arange(rows)
    if motion == "locked":
        return np.zeros(rows)
    if motion == "turning":
        return rng.choice([-1, 1]) * 10 ** rng.uniform(-5, -1.3) * TURN * i
    if motion == "swinging":
        return rng.uniform(0.05, 3) * np.sin(TURN * i / rows * rng.uniform(1, 8))
    if motion == "wandering":
        return np.cumsum(rng.normal(0, 10 ** rng.uniform(-5, -2.5), rows)) * TURN
    stations = int(rng.integers(2, 12))
    at = rng.uniform(10, 80) * np.pi / 180
    level = np.floor(i * stations / rows)
    if motion == "jumped stations":  # the moves are not in the log
        return at * level
    part = i * stations / rows - level
    return at * (level + np.clip((part - 0.7) / 0.3, 0, 1))


def made(seed: int) -> Log:
    """Make a log."""
    rng = np.random.default_rng(seed)
    ratio = float(rng.choice(RATIOS)) * rng.choice([-1, 1])
    motion = MOTIONS[seed % len(MOTIONS)]
    rows = int(rng.choice([30, 100, 400, 1500]))
    loops = rows / rng.choice([8, 20, 50, 300])
    unit = TURN / abs(ratio)
    size = min(10 ** rng.uniform(-0.3, 1.0) * ARCMIN, 0.1 * unit)
    torque = np.sin(TURN * loops * np.arange(rows) / rows + rng.uniform(0, 6))
    lost = size * (0.8 * torque + 0.2 * np.sign(np.gradient(torque)))
    lost += rng.uniform(0, 0.01) * size * rng.normal(size=rows)
    output = output_of(motion, rows, rng) + rng.uniform(-4, 4) + lost
    put_in = ratio * (output - lost)
    return Log(ratio, motion, torque, put_in, output, lost, *(rng.random(2) < 0.5))


def findings_of(
    log: Log,
    read: tuple[np.ndarray, np.ndarray],
    counters: dict[str, Counter] | None = None,
) -> tuple[dict, list[Finding]]:
    """Read a log as a run."""
    findings: list[Finding] = []
    columns = {
        "time": np.arange(read[0].size) * 0.01,
        "torque": log.torque,
        "input_angle": read[0],
        "output_angle": read[1],
    }
    run = sound_run("a.csv", 1, dict(columns), log.ratio, findings, counters)
    assert run is not None
    return run.columns, findings


@pytest.mark.parametrize("part", range(6))
def test_thousands_of_logs(part: int) -> None:
    open_logs, repaired = 0, 0
    for seed in range(part * LOGS // 6, (part + 1) * LOGS // 6):
        log = made(seed)
        put_in, out = log.read
        raw = out - put_in / log.ratio
        columns, findings = findings_of(log, (put_in, out))
        said = [f for f in findings if f.kind in ("wrap", "jump")]
        where = f"seed {seed}: {log.motion}, ratio {log.ratio:g}, {log.single_in, log.single_out}"
        continuous = np.max(np.abs(np.diff(raw))) < 0.25 * TURN / abs(log.ratio)
        if continuous:
            assert np.array_equal(columns["input_angle"], put_in), where
            assert np.array_equal(columns["output_angle"], out), where
            assert not said, where
            continue
        lost = columns["output_angle"] - columns["input_angle"] / log.ratio
        error = lost - log.lost_rad
        if np.ptp(error) > 1e-6 * TURN / abs(log.ratio):
            # A turn that is not restored is reported as uncertain.
            assert any(f.kind == "jump" or f.action == OPEN_ACTION for f in said), where
            open_logs += 1
        else:
            assert any(f.kind == "wrap" for f in said), where
            repaired += 1
    assert repaired > 0.15 * LOGS / 6
    assert open_logs < 0.02 * LOGS / 6


@pytest.mark.parametrize("ratio", [100.0, -50.0])
@pytest.mark.parametrize("single_in", [False, True])
@pytest.mark.parametrize("single_out", [False, True])
def test_check_needs_no_ratio_to_see_what_encoders_lost(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    ratio: float,
    single_in: bool,
    single_out: bool,
) -> None:
    i = np.arange(2000)
    lost = 3 * ARCMIN * np.sin(i / 40) + 1e-6 * np.random.default_rng(1).normal(size=2000)
    out = 1.2 * np.sin(i / 200) + 1
    log = Log(ratio, "", 20 * np.sin(i / 40), ratio * out, out + lost, lost, single_in, single_out)
    rows = zip(i * 0.01, log.torque, *log.read, strict=True)
    head = "time_s,torque_Nm,input_angle_rad,output_angle_rad\n"
    (tmp_path / "a.csv").write_text(
        head + "".join(",".join(f"{x:.9g}" for x in row) + "\n" for row in rows)
    )
    assert main(["check", str(tmp_path / "a.csv"), "--json", "-"]) == 0
    said = json.loads(capsys.readouterr().out)["findings"]
    columns = [name for name, single in (("input", single_in), ("output", single_out)) if single]
    assert len(said) == len(columns)
    for name, finding in zip(columns, said, strict=True):
        assert f"{name}_angle_rad" in finding
        assert "whole turns restored" in finding


@pytest.mark.parametrize("single_in", [False, True])
@pytest.mark.parametrize("teeth", [1, 2, 3, 4, 6])
def test_teeth_that_slipped_are_no_turns_of_an_encoder(single_in: bool, teeth: int) -> None:
    for ratio in (50.0, -100.0, 160.0):
        for slow in (0.0, 1e-3):
            rows = 900
            torque = np.sin(TURN * 3 * np.arange(rows) / rows)
            lost = 5 * ARCMIN * torque
            lost[480:] += teeth * TURN / (2 * abs(ratio) + 2)
            turned = slow * np.arange(rows) * TURN + 1.0
            put_in, out = turned, turned / ratio + lost
            log = Log(ratio, "", torque, put_in, out, lost, single_in, False)
            read = log.read
            columns, _ = findings_of(log, read)
            got = columns["output_angle"] - columns["input_angle"] / ratio
            np.testing.assert_allclose(got - got[0], lost - lost[0], atol=1e-9)
            if not (single_in and slow):
                assert np.array_equal(columns["input_angle"], read[0])


@pytest.mark.parametrize("moved_deg", [0.5, 4.0, 36.3, 90.0, 181.0])
def test_a_zero_that_moved_inside_a_run_stays_moved(moved_deg: float) -> None:
    rows = 900
    torque = np.sin(TURN * 3 * np.arange(rows) / rows)
    lost = 5 * ARCMIN * torque
    lost[500:] += np.radians(moved_deg)
    for single in (False, True):
        put_in = np.full(rows, 0.7)
        log = Log(100.0, "", torque, put_in, lost + 0.3, lost, single, single)
        columns, _ = findings_of(log, log.read)
        got = columns["output_angle"] - columns["input_angle"] / 100
        np.testing.assert_allclose(got - got[0], lost - lost[0], atol=1e-9)


@pytest.mark.parametrize("bits", [8, 16, 24])
@pytest.mark.parametrize("ratio", [100.0, -50.0])
def test_a_counter_that_overflows_is_named_by_its_width(bits: int, ratio: float) -> None:
    rows = 3000
    per_turn = 2.0**bits / 7.3
    output = 0.9 * TURN * np.sin(TURN * np.arange(rows) / rows) * (16 / abs(ratio))
    torque = np.sin(TURN * 9 * np.arange(rows) / rows)
    lost = 2 * ARCMIN * torque
    counts = np.rint(ratio * output / TURN * per_turn)
    overflowed = np.mod(counts + 2.0 ** (bits - 1), 2.0**bits) - 2.0 ** (bits - 1)
    read = overflowed / per_turn * TURN
    truth = output + lost - counts / per_turn * TURN / ratio
    log = Log(ratio, "", torque, read, output + lost, lost, False, False)
    stated = Counter(TURN / per_turn)
    columns, findings = findings_of(log, log.read, {"input_angle": stated} if bits > 16 else None)
    got = columns["output_angle"] - columns["input_angle"] / ratio
    np.testing.assert_allclose(got - got[0], truth - truth[0], atol=1e-9)
    (wrap,) = (f for f in findings if f.kind == "wrap")
    assert (wrap.column, f"2^{bits} counts" in wrap.action) == ("input_angle_rad", True)
    jumps = np.abs(np.diff(overflowed)) > 2.0 ** (bits - 1)
    assert wrap.count == np.count_nonzero(jumps)


def test_the_count_of_an_encoder_is_found_in_its_readings() -> None:
    rng = np.random.default_rng(1)
    angle = np.cumsum(rng.integers(-9, 10, 2000)) * TURN / 16384
    assert count_rad(angle) == pytest.approx(TURN / 16384, rel=1e-6)
    assert count_rad(rng.normal(size=2000)) is None


def test_wild_readings_beside_a_seam_leave_no_turn_behind() -> None:
    rows = 600
    torque = np.sin(TURN * 3 * np.arange(rows) / rows)
    lost = 4 * ARCMIN * torque
    for seed in range(200):
        rng = np.random.default_rng(seed)
        put_in = 100 * (0.002 * np.arange(rows) + 1.0)
        read = np.mod(put_in, TURN)
        out = 0.002 * np.arange(rows) + 1.0 + lost
        wild = rng.integers(2, rows - 2)
        reading = (read, out)[seed % 2]
        reading[wild] = rng.choice([0.0, rng.uniform(0, 6), 655.35])
        got = put_back(read, out, 100.0)
        rest = np.delete(got.output_rad - got.input_rad / 100 - lost, wild)
        assert np.ptp(rest) < 1e-9, seed
