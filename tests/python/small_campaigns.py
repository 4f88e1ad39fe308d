"""Small generated campaigns for tests."""

from __future__ import annotations

import numpy as np

from lostmotion.discover import diagnose
from lostmotion.recordings import Campaign, Run
from lostmotion.torsion_curve import run_plays

ARCSEC = np.pi / 180 / 3600
RATED_NM = 40.0
RATIO = 100.0
DRIVE = """
[drive]
name = "small"
ratio = 100
rated_torque_Nm = 40
[catalogue]
T1_Nm = 7
T2_Nm = 25
K1_Nm_per_rad = 16e3
K2_Nm_per_rad = 25e3
K3_Nm_per_rad = 29e3
"""


def torque_of(run, rows):
    """Triangles of three amplitudes."""
    t = np.arange(rows) * 0.1
    size = RATED_NM * (0.4, 0.7, 1.0)[run % 3]
    return size * 2 / np.pi * np.arcsin(np.sin(2 * np.pi * t / 25.0))


def campaign(seed=1, runs=12, rows=500, add=None, *, warm=True, noise=1.0, slip=None, zero=5.0):
    """Torque loops at several temperatures, with noise, friction and scatter from run to run."""
    rng = np.random.default_rng(seed)
    made = []
    swings = [torque_of(r, rows) for r in range(runs)]
    # The memory of the friction continues from run to run.
    remembered = run_plays(np.array([3.0]), np.concatenate(swings), 0.0)[:, 0].reshape(runs, rows)
    temperature = rng.permutation(np.linspace(10, 45, runs)) if warm else np.full(runs, 20.0)
    for r in range(runs):
        t = np.arange(rows) * 0.1
        torque = swings[r]
        stiff, wide = 1 + 0.003 * rng.normal(), 1 + 0.02 * rng.normal()
        wound = torque + 0.5 * wide * remembered[r]
        torsion_curve = stiff * (wound * 7.0 + 25.0 * np.tanh(wound / 8.0))
        columns = {
            "time": t,
            "torque": torque,
            "temperature": temperature[r] + 0.02 * t,
            "input_angle": np.full(rows, 0.7 * r),
            "output_angle": np.full(rows, 0.007 * r),
        }
        y = torsion_curve + noise * rng.normal(size=rows) + zero * rng.normal()
        if add is not None:
            y = y + add(columns, wound)
        if slip is not None and slip[0] == r:
            y = y + slip[2] * (t >= slip[1])
        if slip is not None and slip[0] < r and zero == 0.0:  # otherwise the sensor is zeroed again
            y = y + slip[2]
        columns["lost_motion"] = y * ARCSEC
        made.append(Run(r + 1, "made.csv", columns))
    return Campaign(made)


def gap(columns, wound):
    """A gap that opens with temperature: 1 arcsec a K in all."""
    return 0.3 * (columns["temperature"] - 20.0) * np.tanh(wound / 0.2)


def ripple(columns, wound):
    """An effect that no drive has."""
    return 3.0 * np.cos(2 * np.pi * columns["torque"] / 5.0)


def answer_of(data, **more):
    return diagnose(None, data, ratio=RATIO, rated_torque_Nm=RATED_NM, **more).answer()


def read_by_encoders(data, *, turned=True):
    """The output's encoder, whose reading contains the lost motion and its noise."""
    made = []
    for run in data.runs:
        columns = dict(run.columns)
        columns["output_angle"] = columns["input_angle"] / RATIO + columns["lost_motion"]
        if not turned:
            del columns["input_angle"]
        made.append(Run(run.label, run.file, columns))
    return Campaign(made)


def write(data, file):
    """Write a campaign as CSV."""
    names = [
        "time",
        "torque",
        "lost_motion",
        "temperature",
        "input_angle",
        "output_angle",
    ]
    heads = ["time_s", "torque_Nm", "lost_motion_rad", "temperature_C"]
    heads += ["input_angle_rad", "output_angle_rad"]
    lines = [",".join(["run", *heads])]
    for run in data.runs:
        table = np.column_stack([run.columns[n] for n in names])
        lines += [f"{run.label}," + ",".join(f"{x:.9g}" for x in row) for row in table]
    file.write_text("\n".join(lines) + "\n")


def turning_joint(file, *, dead=False, locked=False):
    """A joint that swings under gravity: torque rises with the angle, the lost motion with both."""
    output = np.zeros(1000) if locked else np.sin(0.01 * np.arange(1000))
    torque = 30 * np.sin(0.01 * np.arange(1000))
    turned = 100 * (output - torque / 3e4) * (10 if locked else 1)
    output[500:] = output[500] if dead else output[500:]
    rows = np.column_stack((0.01 * np.arange(1000), torque, turned, output))
    head = "time_s,torque_Nm,input_angle_rad,output_angle_rad"
    np.savetxt(file, rows, delimiter=",", header=head, comments="")
    return str(file)
