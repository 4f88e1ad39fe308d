"""Names and arguments of all commands.

Functions of commands are named here and imported on use, so that help and usage errors appear at
once.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any, NoReturn

from lostmotion.errors import one_line
from lostmotion.friction import FORMS

BAD_INPUT = 2
"""Exit status of bad input and bad usage."""

PROFILES = ("standard", "full", "gap")
JOINS = ("nearest", "linear")
SHELLS = ("bash", "zsh", "tcsh", "fish", "powershell")
PROGRESS = ("bar", "json", "none")
SIDES = ("output", "input")

Command = Callable[[str, str, str, str], argparse.ArgumentParser]
"""Adds a command: name, MODULE:FUNCTION, purpose, example."""


class Version(argparse._VersionAction):
    """The option that prints the version, which is determined only on use."""

    def __call__(self, *called: Any) -> NoReturn:
        """Print the version and exit."""
        from lostmotion import __version__

        self.version = f"lostmotion {__version__}"
        super().__call__(*called)
        raise AssertionError("printing the version leaves")


class Parser(argparse.ArgumentParser):
    """A parser whose error message is one line."""

    def error(self, message: str) -> NoReturn:
        """Print one line and exit with the status for bad usage."""
        self.exit(BAD_INPUT, f"{self.prog}: {one_line(message)}; see {self.prog} --help\n")


def make_parser() -> argparse.ArgumentParser:
    """Make the parser of all commands."""
    parser = Parser(
        prog="lostmotion",
        description="Predict, measure and diagnose lost motion in strain-wave gears.",
    )
    parser.add_argument("--version", action=Version)
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", parser_class=Parser)

    def command(name: str, run: str, says: str, example: str) -> Parser:
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
            "-q",
            "--quiet",
            action="store_true",
            help="print only errors and the output of --json -",
        )
        loudness.add_argument(
            "-v",
            "--verbose",
            action="store_true",
            help="report the files read, the steps done and the files written",
        )
        return added

    add_prediction(command)
    add_drawings(command)
    add_comparison(command)
    add_discovery(command)
    add_design(command)
    add_controller(command)
    add_workbench(command)
    add_others(command)
    return parser


def add_prediction(command: Command) -> None:
    """Add the commands for a drive file alone."""
    added = command(
        "new",
        "lostmotion.commands.new:run_new",
        "A drive file of textbook proportions, every key with its range and meaning.",
        "lostmotion new size-20 ratio-100 discs -o drive.toml",
    )
    added.add_argument(
        "words",
        metavar="WORD",
        nargs="*",
        help="size-N (default: 20), ratio-N (default: 100), wave generator (default: discs) and a "
        "name, each once and in any order",
    )
    added.add_argument("-o", "--output", metavar="FILE", help="a new file (default: NAME.toml)")

    added = command(
        "predict",
        "lostmotion.commands.predict:run_predict",
        "The torsion curve and its five contributions.",
        "lostmotion predict drive.toml --torque -40:40:81 --json prediction.json",
    )
    add_drive(added, "drive file, or several for one table", nargs="+")
    added.add_argument(
        "--torque", metavar="MIN:MAX:N", help="torques in Nm (default: +- rated torque)"
    )
    added.add_argument(
        "--target",
        metavar="ARCMIN",
        help="the cheapest tolerance grades whose reversal lost motion stays below it",
    )
    added.add_argument(
        "--target-level",
        choices=("probable", "worst"),
        default="probable",
        help="limits of the radial gap for --target (default: probable)",
    )
    added.add_argument(
        "--table",
        metavar="FILE.csv",
        help="write one row of results per drive, or per value of --sweep",
    )
    added.add_argument(
        "--sweep",
        metavar="KEY=FROM:TO:N",
        help="the same drive with N values of one key, such as teeth.face_width_mm=8:12:5",
    )
    added.add_argument(
        "--sensitivity",
        action="store_true",
        help="lost motion, stiffness and stress for one unit of each dimension",
    )
    add_phase(added)
    add_report(added)


def add_drawings(command: Command) -> None:
    """Add the commands for a drive file with a drawing."""
    added = command(
        "calibrate",
        "lostmotion.commands.calibrate:run_calibrate",
        "Support constants that give a drawing the torsion curve of a data sheet or a fit.",
        "lostmotion calibrate drive.toml sheet.toml -o calibrated.toml",
    )
    add_drive(added, "drive file with a [design]: the drawing")
    added.add_argument(
        "source",
        metavar="SHEET_OR_FITTED",
        help="drive file of the same drive with a [catalogue], or written by lostmotion fit",
    )
    added.add_argument("-o", "--output", metavar="FILE", required=True, help="a new file")
    added.add_argument(
        "--constants",
        metavar="A,B",
        help="of ring_factor (default), tooth_compliance_mm_per_N, foundation_N_per_mm2",
    )

    added = command(
        "drawing",
        "lostmotion.commands.drawing:run_drawing",
        "Tooth profiles with root fillets as CSV and DXF in mm, and the gear data table of a "
        "drawing.",
        "lostmotion drawing drive.toml -o drawing",
    )
    add_drive(added, "drive file with a [design]")
    added.add_argument("-o", "--output", metavar="FOLDER", required=True, help="a new folder")
    added.add_argument(
        "--csv-only", action="store_true", help="do not write DXF, which needs ezdxf"
    )

    added = command(
        "clearances",
        "lostmotion.commands.predict:run_clearances",
        "Side clearances of every tooth in both directions, with contact radius and interference.",
        "lostmotion clearances drive.toml --angles-deg -10,0,10,20",
    )
    add_drive(added, "drive file with a [design]")
    add_phase(added)
    added.add_argument("--angles-deg", metavar="A,B,C", help="angles at which to place a tooth")


def add_comparison(command: Command) -> None:
    """Add the commands for recordings except those of the diagnosis."""
    added = command(
        "compare",
        "lostmotion.commands.compare:run_compare",
        "Model against measurement: where it fits and where it fails.",
        "lostmotion compare drive.toml recordings/ --map POSITION=lost_motion_rev",
    )
    add_inputs(added)
    add_friction(added)
    added.add_argument(
        "--fit-on",
        metavar="RUN,RUN...",
        help="fit to these runs and predict the others (default: each run is left out once)",
    )
    added.add_argument(
        "--seed", metavar="N", default="1", help="random seed of the permutation tests (default: 1)"
    )
    add_effects(added)
    add_report(added)

    added = command(
        "characterize",
        "lostmotion.commands.characterize:run_characterize",
        "A drive file and the standard figures from recordings alone, without a data sheet.",
        "lostmotion characterize recordings/ --ratio 100 --rated-torque-Nm 67 -o drive.toml",
    )
    add_data(added, what="recordings, or folders of them; a drive file (.toml) to compare with")
    add_ratio(added)
    added.add_argument(
        "--rated-torque-Nm",
        dest="rated_torque",
        metavar="T",
        help="rated torque; lost motion is given at 3 and 4 %% of it (default: that of the drive "
        "file, or the "
        "largest torque of the loops)",
    )
    added.add_argument("-o", "--output", metavar="DRIVE.toml", help="drive file to write")
    add_dask(added)
    add_report(added)


def add_controller(command: Command) -> None:
    """Add the commands for the controller."""
    added = command(
        "export",
        "lostmotion.commands.export:run_export",
        "Parameters for the controller, as a C header or a binary blob; the drive as an FMU.",
        "lostmotion export drive.toml -o params.h --set period_us=500",
    )
    add_drive(added)
    added.add_argument(
        "-o", "--output", metavar="FILE", required=True, help="a name that ends in .h, .bin or .fmu"
    )
    added.add_argument(
        "--fmu",
        choices=("torque", "angles", "compensator"),
        help="interface of the FMU: torque in and output angle out (default), both angles in and "
        "torque "
        "out, or the controller's compensator",
    )
    added.add_argument("--fmi", choices=("2", "3"), help="version of FMI (default: 2)")
    added.add_argument(
        "--force", action="store_true", help="export even if a value of an effect is at its bound"
    )
    added.add_argument(
        "--name",
        default="joint_parameters",
        help="name of the constant in the header (default: joint_parameters)",
    )
    added.add_argument(
        "--profile",
        choices=PROFILES,
        help="build of the controller's code (default: standard; for an FMU: full)",
    )
    add_effects(added)
    add_settings(added)

    added = command(
        "replay",
        "lostmotion.commands.replay:run_replay",
        "Run the controller's code over recorded logs, bit for bit.",
        "lostmotion replay params.bin log.csv --table ticks.csv",
    )
    add_drive(added, "drive file, or a blob written by export")
    add_data(added, "LOG")
    added.add_argument("--table", metavar="FILE.csv", help="write one row per tick")
    add_effects(added, "your own effects in C: a shared object compiled with LM_REAL_BITS=32")
    add_settings(added)


def add_others(command: Command) -> None:
    """Add the demo and the completion of a shell."""
    added = command(
        "demo",
        "lostmotion.commands.demo:run_demo",
        "One joint from its recordings to an emulated controller, and three design searches.",
        "lostmotion demo -o demo",
    )
    added.add_argument(
        "-o", "--output", metavar="DIR", default="demo", help="folder to write to (default: demo)"
    )

    added = command(
        "completion",
        "lostmotion.commands.completion:run_completion",
        "A script that completes commands, options and files with TAB.",
        "lostmotion completion bash > ~/.local/share/bash-completion/completions/lostmotion",
    )
    added.add_argument("shell", metavar="SHELL", choices=SHELLS, help="one of " + ", ".join(SHELLS))


def add_discovery(command: Command) -> None:
    """Add the commands of discovery."""
    added = command(
        "diagnose",
        "lostmotion.commands.discover:run_diagnose",
        "Which physical effect is missing.",
        "lostmotion diagnose drive.toml recordings/ --json diagnosis.json",
    )
    add_inputs(added)
    add_friction(added)
    add_effects(added)
    add_report(added)
    added.add_argument(
        "--save-evidence", metavar="FILE.npz", help="write what `lostmotion merge` combines"
    )

    added = command(
        "merge",
        "lostmotion.commands.discover:run_merge",
        "Combine saved evidence of several campaigns, without their recordings.",
        "lostmotion merge january.npz february.npz --json -",
    )
    added.add_argument(
        "evidence", metavar="EVIDENCE", nargs="+", help="evidence written by --save-evidence"
    )
    add_effects(added)

    added = command(
        "fit",
        "lostmotion.commands.discover:run_fit",
        "Refit with effects added; prints how the error falls.",
        "lostmotion fit drive.toml recordings/ --add thermal_gap -o fitted.toml",
    )
    add_inputs(added)
    added.add_argument(
        "--add",
        action="append",
        default=[],
        metavar="EFFECT",
        help="effect to add; repeat the option for several",
    )
    add_friction(added)
    added.add_argument("-o", "--output", metavar="FITTED.toml", required=True, help="drive file")
    add_effects(added)
    add_report(added)

    added = command(
        "effects",
        "lostmotion.commands.discover:run_effects",
        "The library of effects, one of them, or a template of your own (effects new NAME).",
        "lostmotion effects thermal_gap",
    )
    added.add_argument("name", metavar="NAME", nargs="*", help="an effect; or: new NAME")
    added.add_argument("--c", action="store_true", help="the template in C")
    add_effects(added)

    added = command(
        "check",
        "lostmotion.commands.discover:run_check",
        "Whether the recordings are sound, and which effects this plan can separate.",
        "lostmotion check recordings/",
    )
    add_data(added)
    add_ratio(added)

    added = command(
        "forecast",
        "lostmotion.commands.discover:run_forecast",
        "Before measuring: which effects a plan would find, and which it could not separate.",
        "lostmotion forecast drive.toml plan.csv",
    )
    add_drive(added)
    add_data(added, "PLAN", "planned runs, as recordings")
    add_effects(added)

    added = command(
        "next",
        "lostmotion.commands.discover:run_next",
        "Which run to do next to decide between the effects that are still open.",
        "lostmotion next drive.toml recordings/ --plan options.csv",
    )
    add_inputs(added)
    added.add_argument(
        "--plan",
        action="append",
        required=True,
        metavar="OPTIONS",
        help="runs that could be made, as recordings",
    )
    add_effects(added)


def add_design(command: Command) -> None:
    """Add the design search."""
    added = command(
        "design",
        "lostmotion.commands.design:run_design",
        "Search for a design with little lost motion.",
        "lostmotion design joint.toml -o joint",
    )
    added.add_argument(
        "spec", metavar="SPEC.toml", help="search spec: variables, limits and objectives"
    )
    added.add_argument(
        "-o", "--output", metavar="RUN", required=True, help="folder for the search and its results"
    )
    added.add_argument("--resume", action="store_true", help="continue the search in the folder")
    added.add_argument("--workers", metavar="N", help="threads (default: as in the spec, or all)")
    added.add_argument("--dask", metavar="tcp://HOST:PORT", help="run on a Dask cluster")
    added.add_argument(
        "--progress",
        choices=PROGRESS,
        help="a bar (default on a terminal), JSON lines on standard output, or none",
    )


def add_workbench(command: Command) -> None:
    """Add the workbench."""
    added = command(
        "workbench",
        "lostmotion.commands.workbench:run_workbench",
        "The same functions in a local web page.",
        "lostmotion workbench drive.toml recordings/",
    )
    added.add_argument("drive", metavar="DRIVE", nargs="?", help="drive file")
    added.add_argument("data", metavar="DATA", nargs="*", help="recordings, or folders of them")
    added.add_argument("--port", metavar="N", help="port of the page (default: a free one)")
    added.add_argument("--no-browser", action="store_true", help="print the address only")
    added.add_argument(
        "--root",
        action="append",
        default=[],
        metavar="FOLDER",
        help="folder that design searches may write to; repeat the option for several (default: "
        "this folder)",
    )
    add_map(added)
    add_join(added)
    add_effects(added)


def add_drive(
    parser: argparse.ArgumentParser, what: str = "drive file", nargs: str | None = None
) -> None:
    """Add the drive file."""
    parser.add_argument("drive", metavar="DRIVE", help=what, nargs=nargs)


def add_data(
    parser: argparse.ArgumentParser,
    metavar: str = "DATA",
    what: str = "recordings, or folders of them",
) -> None:
    """Add recordings and the options for reading them."""
    parser.add_argument("data", metavar=metavar, nargs="+", help=what)
    add_map(parser)
    add_join(parser)
    add_protocol(parser)


def add_join(parser: argparse.ArgumentParser) -> None:
    """Add the option that joins columns of different clocks."""
    parser.add_argument(
        "--join",
        choices=JOINS,
        help="ROS 2 bags: resample topics of different rates at the times of the slowest of torque "
        "and angles (default: an error)",
    )


def add_inputs(parser: argparse.ArgumentParser) -> None:
    """Add drive and recordings, which may be large."""
    add_drive(parser)
    add_data(parser)
    add_dask(parser)


def add_dask(parser: argparse.ArgumentParser) -> None:
    """Add the option that reads large recordings through Dask."""
    parser.add_argument(
        "--dask",
        nargs="?",
        const="local",
        metavar="ADDRESS",
        help="read large Parquet recordings with Dask, locally or on the cluster at tcp://...",
    )


def add_effects(
    parser: argparse.ArgumentParser,
    what: str = "your own effects: a Python file or a shared object from C; its code is run",
) -> None:
    """Add the option for the user's own effects."""
    parser.add_argument(
        "--effects",
        action="append",
        default=[],
        metavar="FILE",
        help=what,
    )


def add_report(parser: argparse.ArgumentParser) -> None:
    """Add the option that writes a report."""
    parser.add_argument(
        "--report",
        metavar="FILE.html",
        help="write a page with pictures and the numbers behind them",
    )


def add_map(parser: argparse.ArgumentParser) -> None:
    """Add the option that maps column names."""
    parser.add_argument(
        "--map",
        action="append",
        default=[],
        metavar="COLUMN=NAME_UNIT",
        help="quantity and unit of a column with another name; -NAME_UNIT reverses its sign, "
        "NAME_UNIT/NUMBER divides it (counts: input_angle_rev/4096); it applies to the files "
        "that have the column",
    )


def add_protocol(parser: argparse.ArgumentParser) -> None:
    """Add the options for the locked side and the torque constant of the motor."""
    parser.add_argument(
        "--locked",
        choices=SIDES,
        help="side that was locked and whose angle was not recorded; with a locked output, "
        "motor_torque_Nm or motor_current_A may replace the torque",
    )
    parser.add_argument(
        "--torque-constant-Nm-per-A",
        dest="torque_constant",
        metavar="K",
        help="torque of the motor for one ampere, with --locked output",
    )


def add_ratio(parser: argparse.ArgumentParser) -> None:
    """Add the option for the ratio if there is no drive file."""
    parser.add_argument(
        "--ratio",
        help="input turns for one output turn, signed, where only the two angles were recorded",
    )


def add_phase(parser: argparse.ArgumentParser) -> None:
    """Add the tooth phase."""
    parser.add_argument(
        "--phase-deg",
        metavar="DEG",
        default="0",
        help="tooth phase of the wave generator (default: 0)",
    )


def add_settings(parser: argparse.ArgumentParser) -> None:
    """Add the option for controller settings that a drive file does not contain."""
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY_UNIT=NUMBER",
        help="period, torque_limit, torque_noise, a limit of the correction or of the watch",
    )
    parser.add_argument(
        "--resonance-Hz",
        action="append",
        dest="set",
        type="resonance_Hz={}".format,
        metavar="HZ",
        help="lowest resonance of the joint with its load; it limits the speed of the correction "
        "(default: 25)",
    )


def add_friction(parser: argparse.ArgumentParser) -> None:
    """Add the option for the form of the hysteresis."""
    parser.add_argument(
        "--friction",
        choices=FORMS,
        help="in parallel with the spring (inside), in series (outside) or both, of constant width "
        "or growing with the load; default: inside, unless the runs confirm a larger form",
    )
