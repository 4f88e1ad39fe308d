"""What the commands over recordings read: a drive, its recordings, its characteristic."""

from __future__ import annotations

import argparse

from lostmotion.backbone import Backbone
from lostmotion.drives import Drive, read_drive
from lostmotion.model import make_backbone
from lostmotion.recordings import Campaign, check_scale, parse_map
from lostmotion.sample import read_or_sample


def read_inputs(arguments: argparse.Namespace) -> tuple[Drive, Campaign, Backbone]:
    """Read the drive and the recordings that the arguments name, and hold one against the other."""
    drive = read_drive(arguments.drive)
    campaign = read_or_sample(
        arguments.data,
        ratio=drive.ratio,
        mapping={**drive.columns, **parse_map(arguments.map)},
        dask=arguments.dask,
    )
    campaign.require_variation()
    backbone = make_backbone(drive, campaign.largest_torque_Nm)
    check_scale(campaign, backbone)
    return drive, campaign, backbone
