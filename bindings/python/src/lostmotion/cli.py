"""The command ``lostmotion``."""

from __future__ import annotations

import argparse
import contextlib
import logging
import math
import os
import shlex
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NoReturn, TextIO

import numpy as np

from lostmotion import __version__, units
from lostmotion.compare import Comparison, compare
from lostmotion.completion import SHELLS, completion_script
from lostmotion.demo import demonstrate, show_demonstration
from lostmotion.design.command import add_design_command
from lostmotion.discover.commands import add_commands
from lostmotion.discover.effects import library
from lostmotion.discover.ladder import make_base
from lostmotion.drives import read_drive
from lostmotion.errors import InputError, LostMotionError, one_line
from lostmotion.export import PROFILES, export, make_controller, read_settings, show_export
from lostmotion.files import check_place, reason, write_whole
from lostmotion.model import make_backbone
from lostmotion.options import (
    add_data,
    add_drive,
    add_effects,
    add_inputs,
    add_phase,
    add_report,
    add_settings,
    effects_of,
    number,
    whole_number,
)
from lostmotion.predict import clearances, predict
from lostmotion.recordings import parse_map, read_campaign, recording_files
from lostmotion.replay import read_parameters, replay, show_replay
from lostmotion.report import comparison_section, drive_section, write_report
from lostmotion.sample import read_or_sample
from lostmotion.terminal import Progress, deliver, fixed, show_table
from lostmotion.workbench.command import add_command as add_workbench

DONE, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130
"""Exit statuses."""

DEFAULT_TORQUES = 33
"""Torques of a prediction that states none: from minus to plus the rated torque."""

TORQUES_MAX = 1025
"""Torques that one evaluation of the library takes."""

TORQUE_MAX_NM = 1e6
"""Largest torque that the library takes."""

PHASE_MAX_DEG = 360.0
"""Largest tooth phase; it repeats with every tooth."""

ANGLE_MAX_DEG = 90.0
"""Teeth of one lobe lie within this of the deformation axis."""

SEED_MAX = 2**63 - 1
"""Largest seed of anything random."""

SIGNED_OPTIONS = ("--torque", "--phase-deg", "--angles-deg")
"""Options whose value may begin with a minus sign."""


class Parser(argparse.ArgumentParser):
    """A parser whose complaint is one line."""

    def error(self, message: str) -> NoReturn:
        """Print one line and leave with the status for bad usage."""
        self.exit(BAD_INPUT, f"{self.prog}: {one_line(message)}; see {self.prog} --help\n")


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command and return its exit status."""
    parser = make_parser()
    words = sys.argv[1:] if argv is None else argv
    try:
        arguments = parser.parse_args(join_signed(words))
        arguments.command_line = shlex.join(["lostmotion", *words])
        if arguments.command is None:
            parser.print_help()
            return BAD_INPUT
        check_places(arguments)
        with loudness(arguments):
            arguments.run(arguments)
        sys.stdout.flush()
    except SystemExit as stop:
        return int(stop.code or 0)
    except InputError as error:
        print(f"lostmotion: {error}", file=sys.stderr)
        return BAD_INPUT
    except LostMotionError as error:
        print(f"lostmotion: {one_line(str(error))}", file=sys.stderr)
        return FAILED
    except KeyboardInterrupt:
        print("lostmotion: interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        # Nobody reads any more; keep the interpreter from complaining about it on its way out.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILED
    except (OSError, MemoryError) as error:
        # A full disk behind standard output, a machine that is too small: no fault of the input.
        print(f"lostmotion: {one_line(reason(error))}", file=sys.stderr)
        with contextlib.suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILED
    return DONE


def join_signed(argv: Sequence[str]) -> list[str]:
    """Join options to values that begin with a minus sign, which argparse takes for options."""
    joined: list[str] = []
    for word in argv:
        if joined and joined[-1] in SIGNED_OPTIONS and word.startswith("-"):
            joined[-1] += f"={word}"
        else:
            joined.append(word)
    return joined


def make_parser() -> argparse.ArgumentParser:
    """Make the parser of all commands."""
    parser = Parser(
        prog="lostmotion",
        description="Lost motion in strain-wave gears: predict, compare, find out.",
    )
    parser.add_argument("--version", action="version", version=f"lostmotion {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", parser_class=Parser)

    def command(name: str, run: Callable[[Any], None], says: str, example: str) -> Parser:
        added = commands.add_parser(
            name,
            help=says,
            description=says,
            epilog=f"example: {example}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        added.set_defaults(run=run)
        added.add_argument(
            "--json", metavar="FILE", help="write the answer as JSON; - for standard output"
        )
        loudness = added.add_mutually_exclusive_group()
        loudness.add_argument(
            "-q", "--quiet", action="store_true", help="print errors only, and --json -"
        )
        loudness.add_argument(
            "-v", "--verbose", action="store_true", help="say what is read, done and written"
        )
        return added

    added = command(
        "predict",
        run_predict,
        "The characteristic and its five contributions.",
        "lostmotion predict drive.toml --torque -40:40:81 --json prediction.json",
    )
    add_drive(added)
    added.add_argument(
        "--torque", metavar="MIN:MAX:N", help="torques in Nm (default: +- rated torque)"
    )
    add_phase(added)
    add_report(added)

    added = command(
        "clearances",
        run_clearances,
        "Side clearances of every tooth, both ways, with contact radius and interference.",
        "lostmotion clearances drive.toml --angles-deg -10,0,10,20",
    )
    add_drive(added, "drive file with a [design]")
    add_phase(added)
    added.add_argument("--angles-deg", metavar="A,B,C", help="angles to place a tooth at")

    added = command(
        "compare",
        run_compare,
        "Model against measurement: where it fits and where it fails.",
        "lostmotion compare drive.toml recordings/ --map POSITION=lost_motion_rev",
    )
    add_inputs(added)
    added.add_argument(
        "--fit-on",
        metavar="RUN,RUN...",
        help="fit to these runs and predict the others (default: each run is held out once)",
    )
    added.add_argument("--seed", default="1", help="of the tests for chance (default: 1)")
    add_effects(added)
    add_report(added)

    add_commands(command)
    add_design_command(command)

    added = command(
        "export",
        run_export,
        "Parameters for the controller, as a C header or a binary blob.",
        "lostmotion export drive.toml -o params.h --set period_us=500",
    )
    add_drive(added)
    added.add_argument(
        "-o", "--output", metavar="FILE", required=True, help="a name that ends in .h or .bin"
    )
    added.add_argument("--name", default="joint_parameters", help="of the constant in the header")
    added.add_argument("--profile", choices=PROFILES, default="standard", help="of the controller")
    add_effects(added)
    add_settings(added)

    added = command(
        "replay",
        run_replay,
        "The controller's own code over recorded logs, bit for bit.",
        "lostmotion replay params.bin log.csv --table ticks.csv",
    )
    add_drive(added, "drive file, or a blob by export")
    add_data(added, "LOG")
    added.add_argument("--table", metavar="FILE.csv", help="write every tick")
    add_settings(added)

    add_workbench(command)

    added = command(
        "demo",
        run_demo,
        "Lost motion of a bought drive, of two designs and of a measured one, with pictures.",
        "lostmotion demo -o demo",
    )
    added.add_argument(
        "-o", "--output", metavar="DIR", default="demo", help="folder to write to (default: demo)"
    )

    added = command(
        "completion",
        run_completion,
        "A script that completes commands, options and files with TAB.",
        "lostmotion completion bash > ~/.local/share/bash-completion/completions/lostmotion",
    )
    added.add_argument("shell", metavar="SHELL", choices=SHELLS, help="one of " + ", ".join(SHELLS))
    return parser


def check_places(arguments: argparse.Namespace) -> None:
    """Refuse places that cannot be written to, or that hold an input, before any work."""
    taken = {name: f"the input '{name}'" for name in input_files(arguments)}
    for option in ("json", "report", "table", "save-evidence"):
        file = getattr(arguments, option.replace("-", "_"), None)
        if file is None or (option, file) == ("json", "-"):
            continue
        check_place(f"--{option}", file)
        place = os.path.realpath(file)
        for other, what in taken.items():
            if os.path.realpath(other) == place:
                raise InputError(f"--{option}", "", what, "a file of its own")
        taken[file] = f"the place of --{option}, '{file}'"


def input_files(arguments: argparse.Namespace) -> list[str]:
    """Files that a command line names for reading."""
    several = ("data", "evidence", "plan", "effects")
    data = [file for name in several for file in getattr(arguments, name, None) or []]
    named = [getattr(arguments, name, None) for name in ("drive", "spec")]
    return [name for name in [*named, *data] if name and "\0" not in name]


def torques(text: str | None, rated_Nm: float) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Read ``MIN:MAX:N``; without it, plus and minus the rated torque."""
    if text is None:
        return np.linspace(-rated_Nm, rated_Nm, DEFAULT_TORQUES)
    expected = f"MIN:MAX:N in Nm, MIN below MAX, N from 2 to {TORQUES_MAX}"
    parts = text.split(":")
    if len(parts) != 3:
        raise InputError("--torque", "", f"'{text}'", expected)
    low, high = (number("--torque", part, TORQUE_MAX_NM) for part in parts[:2])
    spaced = np.linspace(low, high, whole_number("--torque", parts[2], 2, TORQUES_MAX))
    if not np.all(np.diff(spaced) > 0):
        raise InputError("--torque", "", f"'{text}'", expected)
    return spaced


def run_predict(arguments: argparse.Namespace) -> None:
    """``lostmotion predict``."""
    drive = read_drive(arguments.drive)
    phase = math.radians(number("--phase-deg", arguments.phase_deg, PHASE_MAX_DEG))
    answer = predict(drive, torques(arguments.torque, drive.rated_torque_Nm), phase)
    if arguments.report is not None:
        lead = "What the drive file says that the drive will do."
        section = drive_section(drive, phase)
        write_report(
            arguments.report, "Predicted lost motion", lead, [section], arguments.command_line
        )
    deliver(answer, arguments, lambda out: show_prediction(answer, out))


def run_clearances(arguments: argparse.Namespace) -> None:
    """``lostmotion clearances``."""
    drive = read_drive(arguments.drive)
    phase = math.radians(number("--phase-deg", arguments.phase_deg, PHASE_MAX_DEG))
    angles = None
    if arguments.angles_deg is not None:
        texts = arguments.angles_deg.split(",")
        angles = np.radians([number("--angles-deg", text, ANGLE_MAX_DEG) for text in texts])
    answer = clearances(drive, phase, angles)
    deliver(answer, arguments, lambda out: show_clearances(answer, out))


def run_compare(arguments: argparse.Namespace) -> None:
    """``lostmotion compare``."""
    seed = whole_number("--seed", arguments.seed, 0, SEED_MAX)
    drive = read_drive(arguments.drive)
    mapping = {**drive.columns, **parse_map(arguments.map)}
    campaign = read_or_sample(
        arguments.data, ratio=drive.ratio, mapping=mapping, dask=arguments.dask
    )
    largest = float(np.max(np.abs(campaign.column("torque"))))
    backbone = make_backbone(drive, largest)
    fitted = drive.fit is not None or bool(drive.effects)
    with Progress("comparing", quiet=arguments.quiet) as progress:
        result = compare(
            backbone,
            campaign,
            base=make_base(drive, campaign, backbone, effects_of(arguments)) if fitted else None,
            fit_on=None if arguments.fit_on is None else arguments.fit_on.split(","),
            seed=seed,
            progress=progress,
        )
    if arguments.report is not None:
        lead = "Recordings against the model of their drive: where it fits and where it fails."
        section = comparison_section(drive, result, recording_files(arguments.data))
        write_report(
            arguments.report, "Measured lost motion", lead, [section], arguments.command_line
        )
    deliver(result.answer(), arguments, lambda out: show_comparison(result, out))


def run_export(arguments: argparse.Namespace) -> None:
    """``lostmotion export``."""
    settings = read_settings(arguments.set)
    check_place("--output", arguments.output)
    drive = read_drive(arguments.drive)
    own = {name: e for name, e in effects_of(arguments).items() if name not in library()}
    controller = make_controller(drive, settings, profile=arguments.profile, own=own)
    answer = export(controller, arguments.output, name=arguments.name, title=drive.name)
    deliver(answer, arguments, lambda out: show_export(answer, out))


def run_replay(arguments: argparse.Namespace) -> None:
    """``lostmotion replay``."""
    parameters, ratio, columns = read_parameters(arguments.drive, read_settings(arguments.set))
    mapping = {**columns, **parse_map(arguments.map)}
    campaign = read_campaign(arguments.data, ratio=ratio, mapping=mapping)
    with Progress("replaying") as progress:
        result = replay(parameters, campaign, progress)
    if arguments.table is not None:
        write_whole(arguments.table, result.table())
    deliver(result.answer(), arguments, lambda out: show_replay(result, out))


def run_demo(arguments: argparse.Namespace) -> None:
    """``lostmotion demo``."""
    with Progress("demonstrating", quiet=arguments.quiet) as progress:
        found = demonstrate(arguments.output, arguments.command_line, progress)
    deliver(found.answer(), arguments, lambda out: show_demonstration(found, out))


def run_completion(arguments: argparse.Namespace) -> None:
    """``lostmotion completion``."""
    script = completion_script(make_parser(), arguments.shell)
    answer = {"schema": "lostmotion.completion/1", "shell": arguments.shell, "script": script}
    deliver(answer, arguments, lambda out: print(script, file=out))


@contextlib.contextmanager
def loudness(arguments: argparse.Namespace) -> Iterator[None]:
    """Let ``--verbose`` show on standard error what the library logs, while a command runs."""
    if not getattr(arguments, "verbose", False):
        yield
        return
    log = logging.getLogger("lostmotion")
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(logging.Formatter("lostmotion: %(relativeCreated)6.0f ms: %(message)s"))
    level = log.level
    log.addHandler(handler)
    log.setLevel(logging.INFO)
    try:
        yield
    finally:
        log.removeHandler(handler)
        log.setLevel(level)


def show_prediction(answer: dict[str, Any], out: TextIO) -> None:
    """Print a prediction as a table."""
    print(
        f"{one_line(answer['drive'])} ({answer['kind']}): one-sided deflection in arcmin\n",
        file=out,
    )
    parts = answer["parts_arcmin"]
    head = ["torque Nm", "total", *(part.replace("_", " ") for part in parts), "teeth/lobe"]
    rows = [
        [
            fixed(torque, 2),
            fixed(answer["total_arcmin"][i]),
            *(fixed(parts[part][i]) for part in parts),
            fixed(answer["engaged_teeth_per_lobe"][i], 0),
        ]
        for i, torque in enumerate(answer["torque_Nm"])
    ]
    show_table(head, rows, out)
    print(
        f"\nreversal lost motion at +-{answer['reversal_torque_Nm']:.3g} Nm: "
        f"{answer['reversal_lost_motion_arcmin']:.3f} arcmin",
        file=out,
    )
    tolerance = answer["tolerance_um"]
    if tolerance["worst_max"] is not None:
        lost = answer["tolerance_lost_motion_arcmin"]
        for kind in ("worst", "probable"):
            print(
                f"radial gap by tolerances, {kind}: {tolerance[f'{kind}_min']:.1f} to "
                f"{tolerance[f'{kind}_max']:.1f} um, lost motion {lost[f'{kind}_min']:.3f} to "
                f"{lost[f'{kind}_max']:.3f} arcmin in one direction",
                file=out,
            )
    failed = [check for check in answer.get("checks", []) if check["margin"] < 0]
    for check in failed:
        print(
            f"check {check['name']}: {check['value']:.4g} {check['unit']}, limit "
            f"{check['limit']:.4g}, margin {check['margin']:.4g}",
            file=out,
        )
    if answer["defaults"]:
        print("\ntaken by default:", file=out)
        for key, value in answer["defaults"].items():
            shown = f"{value:.6g}" if isinstance(value, float) else value
            print(f"  {key} = {shown}", file=out)
    if answer["assumptions"]:
        print("\nassumed:", file=out)
        for line in answer["assumptions"]:
            print(f"  {line}", file=out)


def show_clearances(answer: dict[str, Any], out: TextIO) -> None:
    """Print clearances as a table."""
    name = one_line(answer["drive"])
    print(f"{name}: side clearance in arcmin, - where the teeth do not overlap\n", file=out)
    rows = [
        [
            str(answer["section"][i]),
            fixed(angle, 2),
            fixed(answer["forward_arcmin"][i]),
            fixed(answer["backward_arcmin"][i]),
            fixed(answer["contact_radius_mm"][i]),
        ]
        for i, angle in enumerate(answer["angle_deg"])
        if answer["overlap"][i]
    ]
    show_table(["section", "angle deg", "forward", "backward", "contact radius mm"], rows, out)
    apart = answer["overlap"].count(False)
    if apart:
        print(f"\n{apart} teeth without overlap are left out of this table", file=out)


def show_comparison(result: Comparison, out: TextIO) -> None:
    """Print a comparison."""
    answer = result.answer()
    unit = "arcsec" if answer["unfitted_rms_arcsec"] < 600 else "arcmin"
    scale = 1.0 if unit == "arcsec" else units.ARCSEC / units.ARCMIN

    def shown(value: float) -> str:
        return f"{value * scale:.2f} {unit}"

    print(f"drive as it stands  {shown(answer['unfitted_rms_arcsec'])}", file=out)
    print(
        f"fitted              {shown(answer['rms_arcsec'])}  "
        f"(explains {100 * answer['explained_share']:.2f} % of the variance)",
        file=out,
    )
    if answer["heldout_by"] == "runs not fitted":
        print(f"predicted           {shown(answer['heldout_rms_arcsec'])}", file=out)
    else:
        held = f"held out by {answer['heldout_by']}"
        print(f"{held:<20}{shown(answer['heldout_rms_arcsec'])}", file=out)
    print(f"noise floor         {shown(answer['noise_floor_arcsec'])}", file=out)
    place = {"inside": "inside", "both": "inside and outside"}[answer["friction"]]
    print(f"\nfriction {place} the elasticity; held out:", end="", file=out)
    for name, errors in answer["frictions"].items():
        print(f"  {name} {shown(errors['heldout_rms_arcsec'])}", end="", file=out)
    print("\n\nerror by run:", file=out)
    rows = [
        [
            str(run["run"]) + ("" if run["fitted"] else " *"),
            fixed(run["rms_arcsec"] * scale, 2),
            fixed(run["width_at_zero_arcmin"], 3),
            fixed(run["model_width_at_zero_arcmin"], 3),
            str(run["samples"]),
        ]
        for run in answer["by_run"]
    ]
    head = ["run", f"rms {unit}", "width at 0 Nm, arcmin", "of the model", "samples"]
    show_table(head, rows, out)
    if not all(run["fitted"] for run in answer["by_run"]):
        print("* predicted, not fitted", file=out)
    print("\nwhere it fails:", file=out)
    rows = [
        [failure["covariate"], f"{100 * failure['share']:.1f} %", f"{failure['p']:.4f}"]
        for failure in answer["where_it_fails"]
    ]
    show_table(["covariate", "share", "p"], rows, out)
    if answer["not_testable"]:
        print("\nnot testable with these columns:", file=out)
        for column, effects in answer["not_testable"].items():
            print(f"  without {column}: {', '.join(effects)}", file=out)
    if answer["findings"]:
        print("\nabout the data:", file=out)
        for finding in answer["findings"]:
            print(f"  {finding}", file=out)


if __name__ == "__main__":
    sys.exit(main())
