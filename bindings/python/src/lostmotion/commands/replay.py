"""The command ``lostmotion replay``."""

from __future__ import annotations

import argparse

from lostmotion.commands.inputs import protocol_of
from lostmotion.export import read_settings
from lostmotion.files import write_whole
from lostmotion.options import own_effects
from lostmotion.recordings import parse_map, read_campaign
from lostmotion.replay import read_parameters, replay, show_replay
from lostmotion.terminal import Progress, deliver


def run_replay(arguments: argparse.Namespace) -> None:
    """``lostmotion replay``."""
    parameters, ratio, columns = read_parameters(
        arguments.drive, read_settings(arguments.set), own=own_effects(arguments, 32)
    )
    mapping = {**columns, **parse_map(arguments.map)}
    protocol = protocol_of(arguments)
    campaign = read_campaign(
        arguments.data, ratio=ratio, mapping=mapping, protocol=protocol, join=arguments.join
    )
    with Progress("replaying", quiet=arguments.quiet) as progress:
        result = replay(parameters, campaign, progress)
    if arguments.table is not None:
        write_whole(arguments.table, result.table())
    deliver(result.answer(), arguments, lambda out: show_replay(result, out))
