"""Whether two checkouts give the same answers to the last digit.

    python tests/benchmarks/same_answers.py BEFORE AFTER [--rig FOLDER] [--own N] [--no-designs]

Each of the two is a checkout with its `.venv`, or a folder into which an earlier call wrote the
answers (`--keep`). Every command runs on the same recordings, under the same file names, and every
file that it writes and every line that it prints is compared byte by byte. The recordings are
campaigns of the own rig (tests/rig), and those in `--rig`: NAME.toml with NAME.csv.gz. Besides, the
drives of tests/data/drives are predicted, drawn and exported, and each spec of tests/data/specs is
searched with few evaluations. Exit status 1 states that something differs; the first differing line
of each file is printed.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

TESTS = Path(__file__).resolve().parents[1]

EVALUATIONS = 500
"""Evaluations of the search of a spec: every stage is reached."""

OWN: list[tuple[str, list[str], int, int, str]] = [
    ("own_clean", [], 901, 0, "third"),
    ("own_thermal_gap", ["thermal_gap"], 902, 1, "third"),
    ("own_creep", ["creep"], 903, 2, "third"),
    ("own_lobe_eccentricity", ["lobe_eccentricity"], 904, 3, "standard"),
    ("own_stribeck_friction", ["stribeck_friction"], 905, 4, "third"),
    ("own_pair", ["kinematic_error", "wear"], 906, 5, "standard"),
    ("own_aliased", ["thermal_gap"], 907, 6, "aliased"),
    ("own_input_coupling_play", ["input_coupling_play"], 908, 7, "third"),
    ("own_sensor_lag", ["sensor_lag"], 909, 0, "third"),
    ("own_thermal_friction", ["thermal_friction"], 910, 1, "third"),
    ("own_short", ["torque_offset"], 911, 2, "short"),
    ("own_wear", ["wear"], 912, 3, "standard"),
    ("own_load_dependent_friction", ["load_dependent_friction"], 913, 4, "third"),
    ("own_output_eccentricity", ["output_eccentricity"], 914, 5, "third"),
    ("own_stiffness_modulation", ["stiffness_modulation"], 915, 6, "third"),
    ("own_asymmetric_stiffness", ["asymmetric_stiffness"], 916, 7, "third"),
    ("own_inertia", ["inertia"], 917, 0, "standard"),
    ("own_viscous_friction", ["viscous_friction"], 918, 1, "third"),
    ("own_output_tilt", ["output_tilt"], 919, 2, "third"),
    ("own_thermal_stiffness", ["thermal_stiffness"], 920, 3, "third"),
]
"""Name, hidden effects, seed, drive and plan of a campaign of the rig."""

MERGED: list[tuple[str, int, int]] = [("thermal_gap", 931, 2), ("kinematic_error", 933, 1)]
"""Hidden effects, first seed and drive of two campaigns whose evidence is merged."""

OTHERWISE = "creep"
"""Effect that is fitted if the diagnosis names none."""


@dataclass
class Case:
    """Files, and the commands that read them. Attributes
    ----------
    kind : str
        Of the commands: `single`, `merge`, `drive` or `spec`.
    """

    name: str
    drive: Path
    data: list[Path] = field(default_factory=list)
    kind: str = "single"


def own_cases(folder: Path, count: int) -> Iterator[Case]:
    """Campaigns of the own rig, written into a folder."""
    sys.path.insert(0, str(TESTS))
    from rig.campaign import make_campaign

    def written(name: str, effects: list[str], seed: int, drive: int, plan: str) -> Path:
        sizes = dict.fromkeys(effects, 0.7)
        make_campaign(seed, drive, sizes, plan).write(folder, name, None)
        return folder / f"{name}.csv.gz"

    for name, effects, seed, drive, plan in OWN[:count]:
        data = written(name, effects, seed, drive, plan)
        yield Case(name, folder / f"{name}.toml", [data])
    for effect, seed, drive in MERGED[: max(1, count // 10)] if count else []:
        data = [written(f"merged_{effect}_{k}", [effect], seed + k, drive, "third") for k in (0, 1)]
        drive_file = folder / f"merged_{effect}_0.toml"
        yield Case(f"merged_{effect}", drive_file, data, "merge")


def rig_cases(folder: Path) -> Iterator[Case]:
    """Campaigns in a folder."""
    for drive in sorted(folder.glob("*.toml")):
        yield Case(f"rig_{drive.stem}", drive, [drive.with_suffix(".csv.gz")])


def design_cases(folder: Path) -> Iterator[Case]:
    """Drives that are designed, and searches of few evaluations."""
    for drive in sorted((TESTS / "data" / "drives").glob("*.toml")):
        yield Case(f"drive_{drive.stem}", drive, kind="drive")
    for spec in sorted((TESTS / "data" / "specs").glob("*.toml")):
        short, times = re.subn(
            r"(?m)^evaluations = .*", f"evaluations = {EVALUATIONS}", spec.read_text()
        )
        assert times == 1
        (folder / spec.name).write_text(short)
        yield Case(f"spec_{spec.stem}", folder / spec.name, kind="spec")


def answer(case: Case, program: Path, folder: Path) -> None:
    """Run every command of a case in a folder, which keeps what they write and print."""
    folder.mkdir(parents=True)
    shutil.copy(case.drive, folder / "drive.toml")
    files = [f"data{k}.csv.gz" for k in range(len(case.data))]
    for name, source in zip(files, case.data, strict=True):
        shutil.copy(source, folder / name)

    def run(what: str, *arguments: str, json_file: bool = True) -> None:
        words = [str(program), *arguments, *(["--json", f"{what}.json"] if json_file else [])]
        found = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
        said = f"{found.stdout}{found.stderr}exit status {found.returncode}\n"
        (folder / f"{what}.txt").write_text(said)

    if case.kind == "spec":
        run("design", "design", "drive.toml", "-o", "run", "--workers", "1", "--progress", "none")
    elif case.kind == "drive":
        run("predict", "predict", "drive.toml", "--report", "report.html")
        run("sensitivity", "predict", "drive.toml", "--sensitivity")
        run("clearances", "clearances", "drive.toml")
        run("drawing", "drawing", "drive.toml", "-o", "drawn", "--csv-only")  # DXF has the time
        run("export", "export", "drive.toml", "-o", "params.h", "--set", "period_us=500")
        run("export_blob", "export", "drive.toml", "-o", "params.bin", "--set", "period_us=500")
    elif case.kind == "merge":
        for k, name in enumerate(files):
            run(f"diagnose{k}", "diagnose", "drive.toml", name, "--save-evidence", f"e{k}.npz")
        run("merge", "merge", *(f"e{k}.npz" for k in range(len(files))))
    else:
        run("check", "check", *files)
        run("compare", "compare", "drive.toml", *files)
        run("diagnose", "diagnose", "drive.toml", *files)
        run("fit", "fit", "drive.toml", *files, "-o", "base.toml")
        named = json.loads((folder / "diagnose.json").read_text())["effects"] or [OTHERWISE]
        added = [word for name in named[:2] for word in ("--add", name)]
        run("fit_added", "fit", "drive.toml", *files, *added, "-o", "fitted.toml")
        run("compare_fitted", "compare", "fitted.toml", *files)
        run("export", "export", "fitted.toml", "-o", "params.h", "--set", "period_us=500")
        run("export_blob", "export", "base.toml", "-o", "params.bin", "--set", "period_us=500")
        run("forecast", "forecast", "drive.toml", *files)
        run("next", "next", "drive.toml", *files, "--plan", *files)
    for name in ["drive.toml", *files]:
        (folder / name).unlink()
    for evidence in folder.glob("*.npz"):  # its bytes contain times; `merge` shows the rest
        evidence.unlink()


def answers_of(source: Path, cases: list[Case], folder: Path) -> Path:
    """Folder with the answers of a checkout; a folder that has answers is used unchanged."""
    program = (source / ".venv" / "bin" / "lostmotion").absolute()
    if not program.exists():
        return source
    for case in cases:
        if not (folder / case.name).exists():
            answer(case, program, folder / case.name)
            print(f"{source}: {case.name}", flush=True)
    return folder


def differences(before: Path, after: Path, cases: list[Case]) -> list[str]:
    """Files that differ, each with its first differing line."""
    found = []
    for case in cases:
        a, b = before / case.name, after / case.name
        names = {
            str(file.relative_to(side))
            for side in (a, b)
            for file in side.rglob("*")
            if file.is_file()
        }
        if not names:
            found.append(f"{case.name}: no answers")
        for name in sorted(names):
            one, other = ((side / name) for side in (a, b))
            if not (one.exists() and other.exists()):
                found.append(f"{case.name}/{name}: only in one")
            elif one.read_bytes() != other.read_bytes():
                found.append(f"{case.name}/{name}: {first_difference(one, other)}")
    return found


def first_difference(one: Path, other: Path) -> str:
    """Describe the first difference of two files."""
    if one.suffix == ".json":
        where = different_key(json.loads(one.read_text()), json.loads(other.read_text()))
        return where or "the order of its keys"
    texts = [file.read_bytes().decode(errors="replace").splitlines() for file in (one, other)]
    for number, (a, b) in enumerate(zip(*texts, strict=False), start=1):
        if a != b:
            return f"line {number}: {a[:120]!r} / {b[:120]!r}"
    return f"{len(texts[0])} / {len(texts[1])} lines"


def different_key(a: Any, b: Any, at: str = "") -> str:
    """Path of the first value that differs, with both values; keys that only one has are last."""
    lacking = ""
    if isinstance(a, dict) and isinstance(b, dict):
        parts = [(f"{at}.{key}", a[key], b[key]) for key in a if key in b]
        alone = sorted(a.keys() ^ b.keys())
        lacking = f"{at}: {', '.join(alone)} in one alone" if alone else ""
    elif isinstance(a, list) and isinstance(b, list) and len(a) == len(b):
        parts = [(f"{at}[{k}]", x, y) for k, (x, y) in enumerate(zip(a, b, strict=True))]
    else:
        return "" if a == b else f"{at}: {str(a)[:100]} / {str(b)[:100]}"
    found = [said for where, x, y in parts if (said := different_key(x, y, where))]
    values = [said for said in found if not said.endswith("in one alone")]
    return next(iter(values or [*found, lacking]))


def main() -> int:
    """Compare; 1 where anything differs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("before", type=Path, help="a checkout, or a folder of its answers")
    parser.add_argument("after", type=Path, help="the same")
    parser.add_argument("--rig", type=Path, help="folder with campaigns, NAME.toml and NAME.csv.gz")
    parser.add_argument("--own", type=int, default=len(OWN), help="campaigns of the own rig (all)")
    parser.add_argument("--no-designs", action="store_true", help="recordings alone")
    parser.add_argument("--keep", type=Path, help="folder that keeps the answers of AFTER")
    parser.add_argument("--only", nargs="*", help="names of cases")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        recordings = Path(scratch, "recordings")
        recordings.mkdir()
        cases = list(own_cases(recordings, arguments.own))
        cases += rig_cases(arguments.rig) if arguments.rig is not None else []
        cases += [] if arguments.no_designs else design_cases(recordings)
        if arguments.only:
            cases = [case for case in cases if case.name in arguments.only]
        before = answers_of(arguments.before, cases, Path(scratch, "before"))
        after = answers_of(arguments.after, cases, arguments.keep or Path(scratch, "after"))
        found = differences(before, after, cases)
    print("\n".join(found) or f"{len(cases)} cases: the same answers")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
