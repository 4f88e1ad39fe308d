"""Names and arguments of all commands.

Functions of commands are named here and imported on use, so that help and usage errors appear at
once.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import dataclass
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

FOLDER = "FOLDER"
"""Displayed name of an argument that is a folder."""


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


Argument = tuple[tuple[str, ...], Mapping[str, Any]]
"""Names and options of ``ArgumentParser.add_argument``."""


def argument(*names: str, **options: Any) -> Argument:
    """State an argument like ``ArgumentParser.add_argument``."""
    return names, options


def repeated(name: str, **options: Any) -> Argument:
    """State an option that may be given several times."""
    return argument(name, action="append", **{"default": [], **options})


def drive(what: str = "drive file", nargs: str | None = None) -> Argument:
    """State the drive file."""
    return argument("drive", metavar="DRIVE", help=what, nargs=nargs)


def data(
    metavar: str = "DATA", what: str = "recordings, or folders of them"
) -> tuple[Argument, ...]:
    """State recordings and the options for reading them."""
    return (argument("data", metavar=metavar, nargs="+", help=what), MAP, JOIN, *PROTOCOL)


def output(metavar: str, what: str, *, required: bool = True) -> Argument:
    """State the file or folder to write."""
    return argument("-o", "--output", metavar=metavar, required=required, help=what)


def effects(
    what: str = "your own effects: a Python file or a shared object from C; its code is run",
) -> Argument:
    """State the user's own effects."""
    return repeated("--effects", metavar="FILE", help=what)


MAP = repeated(
    "--map",
    metavar="COLUMN=NAME_UNIT",
    help="quantity and unit of a column with another name; -NAME_UNIT reverses its sign, "
    "NAME_UNIT/NUMBER divides it (counts: input_angle_rev/4096); it applies to the files "
    "that have the column",
)

JOIN = argument(
    "--join",
    choices=JOINS,
    help="channels of different rates, in a ROS 2 bag, in files or in rows of their own: resample "
    "them at the times of the slowest of torque and angles (default: an error)",
)

PROTOCOL = (
    argument(
        "--locked",
        choices=SIDES,
        help="side that was locked and whose angle was not recorded; with a locked output, "
        "motor_torque_Nm or motor_current_A may replace the torque",
    ),
    argument(
        "--torque-constant-Nm-per-A",
        dest="torque_constant",
        metavar="K",
        help="torque of the motor for one ampere, with --locked output",
    ),
)

DASK = argument(
    "--dask",
    nargs="?",
    const="local",
    metavar="ADDRESS",
    help="read large Parquet recordings with Dask, locally or on the cluster at tcp://...",
)

INPUTS = (drive(), *data(), DASK)
"""Drive and recordings, which may be large."""

FRICTION = argument(
    "--friction",
    choices=FORMS,
    help="in parallel with the spring (inside), in series (outside) or both, of constant width "
    "or growing with the load; default: inside, unless the runs confirm a larger form",
)

RATIO = argument(
    "--ratio",
    help="input turns for one output turn, signed, where only the two angles were recorded",
)

PHASE = argument(
    "--phase-deg",
    metavar="DEG",
    default="0",
    help="tooth phase of the wave generator (default: 0)",
)

REPORT = argument(
    "--report", metavar="FILE.html", help="write a page with pictures and the numbers behind them"
)

SETTINGS = (
    repeated(
        "--set",
        metavar="KEY_UNIT=NUMBER",
        help="period, torque_limit, torque_noise, vibration, a limit of the correction or of the "
        "watch",
    ),
    argument(
        "--resonance-Hz",
        action="append",
        dest="set",
        type="resonance_Hz={}".format,
        metavar="HZ",
        help="lowest resonance of the joint with its load; it limits the speed of the correction "
        "(default: 25)",
    ),
)
"""Controller settings that a drive file does not contain."""


@dataclass(frozen=True)
class Command:
    """A command.

    Attributes
    ----------
    name, module : str
        The function is ``run_NAME`` in this module of `lostmotion.commands`.
    purpose : str
    example : str
        What follows its name on the command line.
    arguments : sequence of Argument
    """

    name: str
    module: str
    purpose: str
    example: str
    arguments: tuple[Argument, ...]

    @property
    def writes_folder(self) -> bool:
        """Whether its output is a folder, not one file."""
        return any("--output" in names and o["metavar"] == FOLDER for names, o in self.arguments)


COMMANDS = (
    Command(
        "new",
        "new",
        "Write a drive file of textbook proportions, every key with its range and meaning.",
        "size-20 ratio-100 discs -o drive.toml",
        (
            argument(
                "words",
                metavar="WORD",
                nargs="*",
                help="size-N (default: 20), ratio-N (default: 100), torque-N (rated torque in "
                "N m, default: the usual one), wave generator (default: discs) and a name, each "
                "once and in any order",
            ),
            output("FILE", "a new file (default: NAME.toml)", required=False),
        ),
    ),
    Command(
        "predict",
        "predict",
        "Predict the torsion curve and its five contributions.",
        "drive.toml --torque -40:40:81 --json prediction.json",
        (
            drive("drive file, or several for one table", nargs="+"),
            argument(
                "--torque", metavar="MIN:MAX:N", help="torques in Nm (default: +- rated torque)"
            ),
            argument(
                "--target",
                metavar="ARCMIN",
                help="the cheapest tolerance grades whose reversal lost motion stays below it",
            ),
            argument(
                "--target-level",
                choices=("probable", "worst"),
                default="probable",
                help="limits of the radial gap for --target (default: probable)",
            ),
            argument(
                "--table",
                metavar="FILE.csv",
                help="write one row of results per drive, or per value of --sweep",
            ),
            argument(
                "--sweep",
                metavar="KEY=FROM:TO:N",
                help="the same drive with N values of one key, such as teeth.face_width_mm=8:12:5",
            ),
            argument(
                "--sensitivity",
                action="store_true",
                help="lost motion, stiffness and stress for one unit of each dimension",
            ),
            PHASE,
            REPORT,
        ),
    ),
    Command(
        "calibrate",
        "calibrate",
        "Find support constants that give a drawing the torsion curve of a data sheet or a fit.",
        "drive.toml sheet.toml -o calibrated.toml",
        (
            drive("drive file with a [design]: the drawing"),
            argument(
                "source",
                metavar="SHEET_OR_FITTED",
                help="drive file of the same drive with a [catalogue], or written by lostmotion "
                "fit",
            ),
            output("FILE", "a new file"),
            argument(
                "--constants",
                metavar="A,B",
                help="of ring_factor (default), tooth_compliance_mm_per_N, foundation_N_per_mm2",
            ),
        ),
    ),
    Command(
        "drawing",
        "drawing",
        "Write tooth profiles with root fillets as CSV and DXF in mm, and the gear data table of "
        "a drawing.",
        "drive.toml -o drawing",
        (
            drive("drive file with a [design]"),
            output(FOLDER, "a new folder"),
            argument("--csv-only", action="store_true", help="do not write DXF, which needs ezdxf"),
        ),
    ),
    Command(
        "clearances",
        "predict",
        "List side clearances of every tooth in both directions, with contact radius and "
        "interference.",
        "drive.toml --angles-deg -10,0,10,20",
        (
            drive("drive file with a [design]"),
            PHASE,
            argument("--angles-deg", metavar="A,B,C", help="angles at which to place a tooth"),
        ),
    ),
    Command(
        "compare",
        "compare",
        "Compare the model with recordings: where it fits and where it fails.",
        "drive.toml recordings/ --map POSITION=lost_motion_rev",
        (
            *INPUTS,
            FRICTION,
            argument(
                "--fit-on",
                metavar="RUN,RUN...",
                help="fit to these runs and predict the others (default: each run is left out "
                "once)",
            ),
            argument(
                "--seed",
                metavar="N",
                default="1",
                help="random seed of the permutation tests (default: 1)",
            ),
            effects(),
            REPORT,
        ),
    ),
    Command(
        "characterize",
        "characterize",
        "Find the standard figures and a drive file from recordings alone, without a data sheet.",
        "recordings/ --ratio 100 --rated-torque-Nm 67 -o drive.toml",
        (
            *data(what="recordings, or folders of them; a drive file (.toml) to compare with"),
            RATIO,
            argument(
                "--rated-torque-Nm",
                dest="rated_torque",
                metavar="T",
                help="rated torque; lost motion is given at 3 and 4 %% of it (default: that of the "
                "drive file, or the largest torque of the loops)",
            ),
            output("DRIVE.toml", "drive file to write", required=False),
            DASK,
            REPORT,
        ),
    ),
    Command(
        "diagnose",
        "discover",
        "Identify the missing physical effect.",
        "drive.toml recordings/ --json diagnosis.json",
        (
            *INPUTS,
            FRICTION,
            effects(),
            REPORT,
            argument(
                "--save-evidence", metavar="FILE.npz", help="write what `lostmotion merge` combines"
            ),
        ),
    ),
    Command(
        "merge",
        "discover",
        "Combine saved evidence of several campaigns, without their recordings.",
        "january.npz february.npz --json -",
        (
            argument(
                "evidence",
                metavar="EVIDENCE",
                nargs="+",
                help="evidence written by --save-evidence",
            ),
            effects(),
        ),
    ),
    Command(
        "fit",
        "discover",
        "Refit with effects added; print how the error falls.",
        "drive.toml recordings/ --add thermal_gap -o fitted.toml",
        (
            *INPUTS,
            repeated(
                "--add",
                metavar="EFFECT",
                help="effect to add; repeat the option for several",
            ),
            FRICTION,
            output("FITTED.toml", "drive file to write"),
            effects(),
            REPORT,
        ),
    ),
    Command(
        "effects",
        "discover",
        "List the library of effects, describe one, or write a template of your own (new NAME).",
        "thermal_gap",
        (
            argument("name", metavar="NAME", nargs="*", help="an effect; or: new NAME"),
            argument("--c", action="store_true", help="the template in C"),
            effects(),
        ),
    ),
    Command(
        "check",
        "discover",
        "Check whether recordings are sound, and list the effects that these runs can separate.",
        "recordings/",
        (*data(), RATIO),
    ),
    Command(
        "forecast",
        "discover",
        "Forecast which effects a planned campaign would find, and which it could not separate.",
        "drive.toml plan.csv",
        (drive(), *data("PLAN", "planned runs, as recordings"), effects()),
    ),
    Command(
        "next",
        "discover",
        "Select the run to record next to decide between the effects that are still open.",
        "drive.toml recordings/ --plan options.csv",
        (
            *INPUTS,
            repeated(
                "--plan",
                default=None,
                required=True,
                metavar="OPTIONS",
                help="runs that could be made, as recordings",
            ),
            effects(),
        ),
    ),
    Command(
        "design",
        "design",
        "Search for a design with little lost motion.",
        "joint.toml -o joint",
        (
            argument(
                "spec", metavar="SPEC.toml", help="search spec: variables, limits and objectives"
            ),
            output(FOLDER, "folder for the search and its results"),
            argument("--resume", action="store_true", help="continue the search in the folder"),
            argument("--workers", metavar="N", help="threads (default: as in the spec, or all)"),
            argument("--dask", metavar="tcp://HOST:PORT", help="run on a Dask cluster"),
            argument(
                "--progress",
                choices=PROGRESS,
                help="a bar (default on a terminal), JSON lines on standard output, or none",
            ),
        ),
    ),
    Command(
        "export",
        "export",
        "Write parameters for the controller, as a C header or a binary blob; or the drive as an "
        "FMU.",
        "drive.toml -o params.h --set period_us=500",
        (
            drive(),
            output("FILE", "a name that ends in .h, .bin or .fmu"),
            argument(
                "--fmu",
                choices=("torque", "angles", "compensator"),
                help="interface of the FMU: torque in and output angle out (default), both angles "
                "in and torque out, or the controller's compensator",
            ),
            argument("--fmi", choices=("2", "3"), help="version of FMI (default: 2)"),
            argument(
                "--force",
                action="store_true",
                help="export even if a value of an effect is at its bound",
            ),
            argument(
                "--name",
                default="joint_parameters",
                help="name of the constant in the header (default: joint_parameters)",
            ),
            argument(
                "--profile",
                choices=PROFILES,
                help="build of the controller's code (default: standard; for an FMU: full)",
            ),
            effects(),
            *SETTINGS,
        ),
    ),
    Command(
        "replay",
        "replay",
        "Run the controller's code over recorded logs, bit for bit.",
        "params.bin log.csv --table ticks.csv",
        (
            drive("drive file, or a blob written by export"),
            *data("LOG"),
            argument("--table", metavar="FILE.csv", help="write one row per tick"),
            effects("your own effects in C: a shared object compiled with LM_REAL_BITS=32"),
            *SETTINGS,
        ),
    ),
    Command(
        "workbench",
        "workbench",
        "Open the same functions in a local web page.",
        "drive.toml recordings/",
        (
            argument("drive", metavar="DRIVE", nargs="?", help="drive file"),
            argument("data", metavar="DATA", nargs="*", help="recordings, or folders of them"),
            argument("--port", metavar="N", help="port of the page (default: a free one)"),
            argument("--no-browser", action="store_true", help="print the address only"),
            repeated(
                "--root",
                metavar=FOLDER,
                help="folder that design searches may write to; repeat the option for several "
                "(default: this folder)",
            ),
            MAP,
            JOIN,
            effects(),
        ),
    ),
    Command(
        "demo",
        "demo",
        "Take one joint from its recordings to an emulated controller; run three design searches.",
        "-o demo",
        (
            argument(
                "-o",
                "--output",
                metavar=FOLDER,
                default="demo",
                help="folder to write to (default: demo)",
            ),
        ),
    ),
    Command(
        "completion",
        "completion",
        "Print a script that completes commands, options and files with TAB.",
        "bash > ~/.local/share/bash-completion/completions/lostmotion",
        (argument("shell", metavar="SHELL", choices=SHELLS, help="one of " + ", ".join(SHELLS)),),
    ),
)
"""Every command, in the order of the help."""


def make_parser() -> argparse.ArgumentParser:
    """Make the parser of all commands."""
    parser = Parser(
        prog="lostmotion",
        description="Predict, measure and diagnose lost motion in strain-wave gears.",
    )
    parser.add_argument("--version", action=Version)
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", parser_class=Parser)
    for command in COMMANDS:
        added = commands.add_parser(
            command.name,
            help=command.purpose,
            description=command.purpose,
            epilog=f"example: lostmotion {command.name} {command.example}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        added.set_defaults(
            run=f"lostmotion.commands.{command.module}:run_{command.name}",
            writes_folder=command.writes_folder,
        )
        added.add_argument(
            "--json", metavar="FILE", help="write the answer as JSON; - for standard output"
        )
        loudness = added.add_mutually_exclusive_group()
        for short, name, what in (
            ("-q", "--quiet", "print only errors and the output of --json -"),
            ("-v", "--verbose", "report the files read, the steps done and the files written"),
        ):
            loudness.add_argument(short, name, action="store_true", help=what)
        for names, options in command.arguments:
            added.add_argument(*names, **options)
    return parser
