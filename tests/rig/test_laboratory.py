"""Independent laboratories: their laws have the known properties, their sizes are as stated."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from .bench import stream
from .ideal import IdealAnalyst
from .laboratory import HIDEABLE, PROTOCOLS, Laboratory
from .laws import LAWS, LawDrive, LawMemory, LawSamples, make_law_drive, turn_law
from .mechanics import ARCSEC, Array


def turned(drive: LawDrive, torque: Array, step_s: float = 0.0) -> tuple[Array, Array]:
    """Turn a drive through torques without other loads."""
    one = np.ones(len(torque))
    samples = LawSamples(torque, drive.gap_rad * one, one, one, step_s * one)
    return turn_law(drive, samples, LawMemory())


def drive_of(law: str) -> LawDrive:
    return make_law_drive(law, stream(4, law))


@pytest.mark.parametrize("law", LAWS)
def test_elastic_torque_and_friction_balance_the_load(law: str) -> None:
    """The friction torque is within its limits: T = e + F, |F| <= sum of limits + eta |e|."""
    drive = drive_of(law)
    torque = 30.0 * np.sin(np.linspace(0, 4 * np.pi, 400))
    _, elastic = turned(drive, torque)
    most = drive.limit_Nm.sum() * (1 + drive.stribeck) + drive.load_share * np.abs(elastic)
    assert np.all(np.abs(torque - elastic) <= most * (1 + 1e-9))
    assert np.max(np.abs(torque - elastic)) > 0.5 * drive.limit_Nm.sum()


@pytest.mark.parametrize("law", LAWS)
def test_closed_loops_turn_work_into_heat(law: str) -> None:
    drive = drive_of(law)
    torque = 30.0 * np.sin(np.linspace(0, 6 * np.pi, 1501))
    angle, _ = turned(drive, torque)
    last = slice(1000, 1501)
    heat = np.sum(np.diff(angle[last]) * 0.5 * (torque[last][1:] + torque[last][:-1]))
    assert heat > 0


@pytest.mark.parametrize("law", [law for law in LAWS if law != "lugre"])
def test_the_length_of_a_step_does_not_matter(law: str) -> None:
    """Every law except LuGre depends only on the path, and each is exact over a monotone move."""
    drive = drive_of(law)
    coarse = np.array([0.0, 30.0, -20.0, 25.0, -30.0, 10.0])
    fine = np.interp(np.linspace(0, 5, 5001), np.arange(6), coarse)
    few, many = turned(drive, coarse)[0], turned(drive, fine)[0][::1000]
    assert np.max(np.abs(few - many)) < 2e-9


def test_maxwell_slip_keeps_a_small_cycle_where_dahl_drifts() -> None:
    """model.md, section 6: 20 small cycles under a bias relax a Dahl force and no Maxwell slip."""
    path = np.concatenate([[20.0], np.tile([21.0, 20.0], 20)])
    for law, drifts in (("maxwell", False), ("dahl", True)):
        angle, _ = turned(drive_of(law), path)
        moved = abs(angle[-1] - angle[2]) / abs(angle[1] - angle[2])
        assert bool(moved > 0.05) == drifts


def test_a_dead_zone_gives_way_at_no_elastic_torque() -> None:
    drive = replace(drive_of("dead_zone"), limit_Nm=np.array([1e-9]))
    angle, _ = turned(drive, np.array([-0.4, 0.4]))
    wound = 0.8 * drive.compliance_rad_per_Nm
    assert angle[1] - angle[0] == pytest.approx(2 * drive.gap_rad + wound, rel=0.02)


def test_friction_outside_moves_by_its_compliance_within_its_width() -> None:
    drive = drive_of("outside")
    stuck = replace(drive, limit_Nm=1e-12 * drive.limit_Nm)
    free = replace(stuck, outside_rad_per_Nm=0.0)
    torque = np.array([30.0, 30.0 - drive.outside_Nm])
    change = np.diff(turned(stuck, torque)[0] - turned(free, torque)[0])
    assert change[0] == pytest.approx(drive.outside_rad_per_Nm * drive.outside_Nm, rel=1e-9)


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_a_hidden_effect_has_the_size_that_was_asked_for(protocol: str, tmp_path: Path) -> None:
    lab = Laboratory(2, "dahl", protocol)
    effect = HIDEABLE[protocol][0]
    truth = lab.write(tmp_path, effect, 1.0)
    assert lab.left(effect, truth["effects"][effect]) == pytest.approx(lab.noise_arcsec, rel=0.05)
    assert truth["noise_arcsec_rms"] == pytest.approx(lab.noise_arcsec, rel=0.1)
    assert json.loads((tmp_path / "truth.json").read_text()) == truth


def test_a_seed_writes_the_same_bytes(tmp_path: Path) -> None:
    for name in "ab":
        Laboratory(6, "lugre", "strangers").write(tmp_path / name)
    files = sorted((tmp_path / "a").iterdir())
    assert len(files) == 12 + 2
    for file in files:
        assert file.read_bytes() == (tmp_path / "b" / file.name).read_bytes()


def test_strangers_have_a_history_of_their_own() -> None:
    """Between runs of strangers the drive has moved: otherwise its memory continues."""
    lab = Laboratory(2, "maxwell", "strangers")
    lone = Laboratory(2, "maxwell", "strangers")
    lone.protocol = "bench"
    apart = lab.plain - lone.plain
    moved = [np.ptp(apart[rows]) / ARCSEC for rows in lab.plan.slices()]
    assert moved[0] == 0.0
    assert max(moved[1:]) > lab.noise_arcsec


@pytest.mark.parametrize(("law", "effect"), [("dahl", "thermal_gap"), ("maxwell", "")])
def test_the_ideal_analyst_finds_what_is_hidden(law: str, effect: str) -> None:
    lab = Laboratory(2, law, "8 runs")
    hidden = {effect: lab.magnitude_for(effect, 1.0)} if effect else {}
    found = IdealAnalyst(lab, hidden).look()
    assert found.first() == effect
    # The analyst knows noise and scatter: without an effect, each gains as chance does.
    noise = [found.p(name, 0) for name in found.nats if name != effect]
    assert effect or min(noise) > 1e-4
    assert effect == "" or found.nats[effect] > max(n for k, n in found.nats.items() if k != effect)
