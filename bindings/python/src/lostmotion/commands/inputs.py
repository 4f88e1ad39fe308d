"""Inputs of the commands for recordings: drive, recordings, torsion curve."""

from __future__ import annotations

import argparse

from lostmotion.drives import Drive, read_drive
from lostmotion.errors import InputError
from lostmotion.hold_against import hold_against
from lostmotion.options import read_number
from lostmotion.recordings import Campaign, Protocol, parse_map
from lostmotion.recordings.protocol import FREE
from lostmotion.sample import read_or_sample
from lostmotion.torsion_curve import TorsionCurve

TORQUE_CONSTANT_MAX = 1e3
"""Largest torque constant of a motor in N m/A; direct drives have up to some tens."""


def protocol_of(arguments: argparse.Namespace, stated: Protocol = FREE) -> Protocol:
    """Read which side was locked, from the options or the drive file."""
    constant = stated.torque_constant_Nm_per_A
    if arguments.torque_constant is not None:
        option = "--torque-constant-Nm-per-A"
        constant = read_number(option, arguments.torque_constant, TORQUE_CONSTANT_MAX)
        if constant == 0:
            raise InputError(option, "", "0", "the torque of the motor for one ampere")
    locked = stated.locked if arguments.locked is None else arguments.locked
    return Protocol(locked, constant)


def read_inputs(arguments: argparse.Namespace) -> tuple[Drive, Campaign, TorsionCurve]:
    """Read the drive and the recordings that the arguments name, and check their consistency."""
    drive = read_drive(arguments.drive)
    mapping = {**drive.columns, **parse_map(arguments.map)}
    protocol = protocol_of(arguments, drive.protocol)
    campaign = read_or_sample(
        arguments.data,
        ratio=drive.ratio,
        mapping=mapping,
        protocol=protocol,
        join=arguments.join,
        dask=arguments.dask,
    )
    return drive, campaign, hold_against(campaign, drive)
