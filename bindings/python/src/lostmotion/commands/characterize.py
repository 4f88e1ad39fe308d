"""The command ``lostmotion characterize``."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from lostmotion.characterize import Characterization, characterize
from lostmotion.characterize.characterization import DRIVE_FILE, ESTIMATED_RATIO, STATED
from lostmotion.characterize.printed import NAMES, cells, flat
from lostmotion.characterize.ratio import needs_ratio
from lostmotion.commands.inputs import protocol_of
from lostmotion.drives import MOST_RATED_NM, Drive, format_toml, read_drive
from lostmotion.errors import InputError, one_line
from lostmotion.files import write_whole
from lostmotion.options import ratio_of, read_number
from lostmotion.recordings import Campaign, Protocol, parse_map, recording_files
from lostmotion.recordings.joining import Join
from lostmotion.recordings.protocol import FREE
from lostmotion.recordings.ratio import estimate_ratio
from lostmotion.sample import read_or_sample
from lostmotion.terminal import deliver, show_findings, show_list, show_table
from lostmotion.units import plain_number


def run_characterize(arguments: argparse.Namespace) -> None:
    """``lostmotion characterize``."""
    drive, paths = split_drive(arguments.data)
    rated = None
    if arguments.rated_torque is not None:
        rated = read_number("--rated-torque-Nm", arguments.rated_torque, MOST_RATED_NM)
        if rated <= 0:
            expected = "a torque above 0"
            raise InputError("--rated-torque-Nm", "", f"'{arguments.rated_torque}'", expected)
    mapping = {**(drive.columns if drive else {}), **parse_map(arguments.map)}
    protocol = protocol_of(arguments, drive.protocol if drive else FREE)
    stated = None if arguments.ratio is None else ratio_of(arguments.ratio)
    if stated is not None and abs(stated) <= 1:
        raise InputError("--ratio", "", f"'{arguments.ratio}'", "more than 1 or less than -1")
    campaign, ratio, ratio_from = read_with_ratio(
        paths, stated, drive, mapping, protocol, arguments.join, arguments.dask
    )
    recorded = [str(file) for file in recording_files(paths)]
    result = characterize(
        drive,
        campaign,
        ratio=ratio,
        ratio_from=ratio_from,
        rated_torque_Nm=rated,
        name=None if drive else Path(recorded[0]).name.split(".")[0],
        mapping=mapping,
        protocol=protocol,
    )
    answer = result.answer()
    if arguments.output is not None:
        write_whole(arguments.output, format_toml(result.document(arguments.output)))
    if arguments.report is not None:
        from lostmotion.report import characterization_section, write_report

        section = characterization_section(result, recording_files(paths))
        lead = "The standard figures of a drive from its recordings alone."
        write_report(
            arguments.report, "Characterized drive", lead, [section], arguments.command_line
        )
    deliver(answer, arguments, lambda: print_characterization(result, answer, arguments.output))


def split_drive(data: list[str]) -> tuple[Drive | None, list[str]]:
    """Separate the drive file, if there is one, from the recordings."""
    files = [name for name in data if name.lower().endswith(".toml")]
    paths = [name for name in data if name not in files]
    if len(files) > 1:
        raise InputError("DATA", files[1], "a second drive file", "one drive file, or none")
    if not paths:
        raise InputError("DATA", "", "no recording", "recordings, with or without a drive file")
    return (read_drive(files[0]) if files else None), paths


def read_with_ratio(
    paths: list[str],
    stated: float | None,
    drive: Drive | None,
    mapping: Mapping[str, str],
    protocol: Protocol,
    join: Join | None,
    dask: str | None,
) -> tuple[Campaign, float | None, str]:
    """Read recordings with the ratio stated, from the drive file, or from turning runs."""

    def read(ratio: float) -> Campaign:
        return read_or_sample(
            paths, ratio=ratio, mapping=mapping, protocol=protocol, join=join, dask=dask
        )

    if stated is not None:
        return read(stated), stated, STATED
    if drive is not None:
        return read(drive.ratio), drive.ratio, DRIVE_FILE
    campaign = read(1.0)
    if not needs_ratio(campaign, 1.0):
        campaign.findings = [f for f in campaign.findings if f.kind != "ratio"]
        return campaign, None, ""
    found = None if protocol.locked else estimate_ratio(campaign)
    if found is None:
        raise InputError(
            campaign.runs[0].file,
            "input_angle_rad",
            "an input angle that moves, no ratio, and no run that turns",
            "the ratio: --ratio N, input turns for one output turn",
        )
    return read(found), found, ESTIMATED_RATIO


def print_characterization(
    result: Characterization, answer: Mapping[str, Any], file: str | None
) -> None:
    """Print a characterization."""
    rated = answer["rated_torque_Nm"]
    print(
        f"{one_line(result.name)}: {answer['loops']} loop{'s' * (answer['loops'] != 1)} in "
        f"{answer['runs']} run{'s' * (answer['runs'] != 1)}, "
        f"{answer['torque_range_Nm'][0]:.4g} to {answer['torque_range_Nm'][1]:.4g} N m, "
        f"{answer['samples']} samples"
    )
    rate = answer["loading_rate_Nm_per_s"]
    print(f"rated torque {rated:.4g} N m ({answer['rated_torque_from']})", end="")
    if answer["ratio"] is not None:
        print(f", ratio {answer['ratio']:.6g} ({answer['ratio_from']})", end="")
    print("" if rate is None else f", loading rate {rate:.3g} N m/s", end="\n\n")
    figures = flat(answer)
    sheet = answer["sheet"]
    head = ["figure", "measured", "standard error", "95 %", *(["sheet"] if sheet else [])]
    rows, reasons = [], []
    for key, name in NAMES.items():
        found = figures[key]
        row = [name, *cells(found)]
        if sheet:
            value = sheet.get(key)
            row.append("-" if value is None else plain_number(value, 4))
        rows.append(row)
        if found["value"] is None:
            above = found.get("none_above")
            more = "" if above is None else f", none above {above:.2g} arcmin"
            reasons.append(f"{name.partition(',')[0]}: {found['reason']}{more}")
    show_table(head, rows)
    if answer["rms_arcsec"] is not None:
        print(f"\nresidual of the loops {plain_number(answer['rms_arcsec'])} arcsec rms")
    for reason in dict.fromkeys(reasons):
        print(reason)
    show_list("assumptions", answer["assumptions"])
    show_findings(answer["findings"])
    if file is not None:
        print(f"\nwritten: {one_line(file)}")
