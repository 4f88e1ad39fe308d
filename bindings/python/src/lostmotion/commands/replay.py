"""The command ``lostmotion replay``."""

from __future__ import annotations

import argparse

from lostmotion.commands.inputs import protocol_of
from lostmotion.export import read_settings
from lostmotion.files import write_whole
from lostmotion.options import own_effects
from lostmotion.recordings import parse_map, read_campaign
from lostmotion.replay import Replay, read_parameters, replay
from lostmotion.terminal import Progress, deliver, show_list


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
    deliver(result.answer(), arguments, lambda: show_replay(result))


def show_replay(result: Replay) -> None:
    """Print the answer of the command."""
    answer = result.answer()
    print(f"{answer['samples']} ticks, bits {answer['bits_crc32']}\n")
    print("rms error of the output, with the zero that fits the model best:")
    for name in ("uncompensated", "compensated"):
        print(f"  {name:14}{answer[f'rms_{name}_arcsec']:9.2f} arcsec")
    print(f"  {'model alone':14}{answer['rms_model_arcsec']:9.2f} arcsec")
    print(f"largest correction {answer['largest_correction_arcsec']:.2f} arcsec")
    print("\nuncertainty from the unknown history before the log, at its start and end:")
    for run in answer["by_run"]:
        start, end = run["unknown_at_start_arcsec"], run["unknown_at_end_arcsec"]
        print(f"  run {run['run']}: {start:.2f} and {end:.2f} arcsec")
    seen = ((name.replace("_", " "), n) for name, n in answer["states"].items() if n)
    show_list("status bits, ticks", (f"{name}: {count}" for name, count in seen))
    for note in answer["notes"]:
        print(f"\n{note}")
