"""Command line of the rig: `python -m rig` from the folder tests."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from .bench import TooSmallError
from .campaign import Conditions, make_campaign
from .hidden import HIDDEN
from .plans import PLANS
from .suites import KINDS, TOGETHER, twins_of, write_suite


def _conditions(arguments: argparse.Namespace) -> Conditions:
    return Conditions(
        noise=arguments.noise,
        scatter=arguments.scatter,
        sheet_error=arguments.sheet_error,
        sheet_bias=arguments.sheet_bias,
        outliers=arguments.outliers,
        dropped_counts=arguments.dropped_counts,
        remount_arcsec=arguments.remount_arcsec,
        temperature_lag_s=arguments.temperature_lag_s,
        extra_columns=tuple(arguments.with_column),
        dropped_columns=tuple(arguments.without_column),
    )


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("python -m rig", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    how = argparse.ArgumentParser(add_help=False)
    how.add_argument("-o", "--output", type=Path, required=True, help="folder to write into")
    how.add_argument("--sigma", type=float, default=0.5, help="residual, in noise sigma (0.5)")
    how.add_argument("--plan", choices=PLANS)
    how.add_argument("--noise", type=float, default=1.0, help="factor of the angle noise")
    how.add_argument("--scatter", type=float, default=1.0, help="factor of the run scatter")
    how.add_argument("--sheet-error", type=float, default=0.03, help="rms of the sheet (0.03)")
    how.add_argument("--sheet-bias", type=float, default=0.0, help="common error of the sheet")
    how.add_argument("--outliers", type=float, default=0.0, help="share of samples")
    how.add_argument("--dropped-counts", type=int, default=0, help="counts lost at one moment")
    how.add_argument("--remount-arcsec", type=float, default=0.0, help="rms zero shift of runs")
    how.add_argument("--temperature-lag-s", type=float, default=0.0)
    how.add_argument("--with-column", action="append", default=[], metavar="COLUMN")
    how.add_argument("--without-column", action="append", default=[], metavar="COLUMN")

    write = commands.add_parser("write", parents=[how], help="write one campaign")
    write.add_argument("--effect", action="append", default=[], choices=sorted(HIDDEN))
    write.add_argument("--magnitude", type=float, help="instead of --sigma, in the natural unit")
    write.add_argument("--seed", type=int, required=True)
    write.add_argument("--drive", type=int, default=0, help="0 to 7")
    write.add_argument("--name", help="of the files; the effects' names and the seed if left out")
    write.add_argument("--confounded", action="store_true", help="name what is confounded with it")

    suite = commands.add_parser("suite", parents=[how], help="write many campaigns")
    suite.add_argument("--kind", choices=KINDS, required=True)
    suite.add_argument("--count", type=int, required=True)
    suite.add_argument("--seeds", choices=("develop", "judge"), required=True)
    suite.add_argument("--skip", type=int, default=0, help="seeds that others have seen")
    suite.add_argument("--effect", action="append", default=[], choices=sorted(HIDDEN))
    suite.add_argument("--every", type=int, default=1, help="take every so many seeds only")
    suite.add_argument(
        "--no-confounded",
        action="store_true",
        help="faster: skip the search for confounded effects",
    )

    show = commands.add_parser("show", help="what each effect needs to leave a residual")
    show.add_argument("--sigma", type=float, default=0.5)
    show.add_argument("--seed", type=int, default=0)
    show.add_argument("--drive", type=int, default=2)
    show.add_argument("--plan", choices=PLANS, default="standard")
    show.add_argument("--confounded", action="store_true", help="also what is confounded with it")
    commands.add_parser("effects", help="what can be hidden")
    return parser


def _write(arguments: argparse.Namespace) -> None:
    effects = arguments.effect
    if arguments.magnitude is not None and len(effects) != 1:
        raise ValueError("--magnitude needs exactly one --effect")
    given = {effects[0]: arguments.magnitude} if arguments.magnitude is not None else {}
    campaign = make_campaign(
        arguments.seed,
        arguments.drive,
        {name: arguments.sigma for name in effects if name not in given},
        arguments.plan or "standard",
        _conditions(arguments),
        given,
        kind="pair" if len(effects) > 1 else "single" if effects else "clean",
    )
    name = arguments.name or f"{'_and_'.join(effects) or 'clean'}_{arguments.seed}"
    campaign.write(arguments.output, name, twins_of(campaign) if arguments.confounded else None)
    print(arguments.output / f"{name}.csv.gz")


def _show(arguments: argparse.Namespace) -> None:
    print(f"{'effect':30} {'magnitude':>10} {'left/sigma':>10} {'ideal z':>8}  unit")
    for name, hidden in HIDDEN.items():
        try:
            campaign = make_campaign(
                arguments.seed,
                arguments.drive,
                {name: arguments.sigma},
                arguments.plan,
                Conditions(extra_columns=("tilt_moment_Nm", "axial_force_N")),
            )
        except TooSmallError:
            print(f"{name:30} {'-':>10} {'-':>10} {'-':>8}  not shown by this plan")
            continue
        (effect,) = campaign.truth()["hidden"]
        line = (
            f"{name:30} {effect['magnitude']:10.3g} {effect['residual_sigma']:10.2f} "
            f"{effect['ideal_z']:8.1f}  {hidden.unit}"
        )
        if arguments.confounded:
            near = sorted(twins_of(campaign, 0.8).items(), key=lambda item: -item[1])
            line += "; " + ", ".join(
                f"{'=' if cosine > TOGETHER else '~'}{twin} {cosine:.2f}" for twin, cosine in near
            )
        print(line, flush=True)


def main() -> int:
    """Run a command; 2 where it cannot be done."""
    arguments = _parser().parse_args()
    try:
        if arguments.command == "write":
            _write(arguments)
        elif arguments.command == "suite":
            write_suite(
                arguments.kind,
                arguments.count,
                arguments.seeds,
                arguments.output,
                arguments.sigma,
                arguments.plan,
                _conditions(arguments),
                not arguments.no_confounded,
                skip=arguments.skip,
                every=arguments.every,
                only=tuple(arguments.effect),
            )
        elif arguments.command == "show":
            _show(arguments)
        else:
            for name, hidden in HIDDEN.items():
                print(f"{name} [{hidden.unit}]: {hidden.about}")
    except ValueError as error:
        print(f"rig: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
