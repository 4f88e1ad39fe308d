"""Compares what cppcheck's MISRA addon finds in the runtime with its list of deviations.

    check_misra.py CPPCHECK

Every finding must be covered by a numbered row of lib/runtime/MISRA.md: a rule, and the files where
it is deviated from. A row that nothing is found for any more is reported too, where this is the
release of cppcheck that the list was made with. Exit status 1 when the two differ.
"""

from __future__ import annotations

import fnmatch
import re
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LIST = ROOT / "lib" / "runtime" / "MISRA.md"
SOURCES = [
    "lib/status.c",
    *sorted(str(file.relative_to(ROOT)) for file in (ROOT / "lib/runtime").rglob("*.c")),
]
PROFILES = ("GAP", "STANDARD", "FULL")
DEFINED = ["LM_REAL_BITS=32", "LM_EFFECT_CARDS=0"]
# ISO C as a compiler without extensions sees it.
UNDEFINED = [
    "LM_REAL_HEADER",
    "__cplusplus",
    "__FAST_MATH__",
    "__ASSOCIATIVE_MATH__",
    "__RECIPROCAL_MATH__",
    "__FINITE_MATH_ONLY__",
    "__GNUC__",
    "__clang__",
    "_MSC_VER",
    "__OPTIMIZE_SIZE__",
    "__arm__",
    "__riscv",
]


@dataclass
class Deviation:
    """A row of the list."""

    number: str
    rule: str
    places: list[str]
    by_hand: bool
    seen: set[str] = field(default_factory=set)


def read_list(text: str) -> list[Deviation]:
    """Rows of the table: number, rule, files, reason."""
    rows = re.findall(r"^\| (D\d+) \| ([\d.]+) \w+ \| ([^|]+) \| (.+) \|$", text, re.MULTILINE)
    return [
        Deviation(number, rule, re.findall(r"`([^`]+)`", places), reason.startswith("(by hand)"))
        for number, rule, places, reason in rows
    ]


def find(cppcheck: str, profile: str) -> set[tuple[str, str, str]]:
    """Rule, file and line of every finding."""
    command = [cppcheck, "--addon=misra", "--enable=style", "--std=c99", "--quiet"]
    command += ["--suppress=missingIncludeSystem", "--template={file}:{line} {id}", "-j2"]
    command += [f"-D{name}" for name in (*DEFINED, f"LM_PROFILE=LM_PROFILE_{profile}")]
    command += [f"-U{name}" for name in UNDEFINED]
    with tempfile.TemporaryDirectory() as folder:  # else what the addon reads lies by the sources
        command += [f"--cppcheck-build-dir={folder}", "-Ilib/include", "-Ilib", *SOURCES]
        done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)
    if done.returncode != 0:
        raise SystemExit(done.stdout + done.stderr)
    pattern = r"^(\S+):(\d+) misra-c2012-([\d.]+)$"
    found = re.findall(pattern, done.stdout + done.stderr, re.MULTILINE)
    return {(rule, file, line) for file, line, rule in found}


def compare(
    listed: list[Deviation], found: set[tuple[str, str, str]], *, same_release: bool
) -> list[str]:
    """What the list does not cover, and what it covers without need."""
    wrong = []
    for rule, file, line in sorted(found):
        rows = [
            row
            for row in listed
            if row.rule == rule and any(fnmatch.fnmatch(file, place) for place in row.places)
        ]
        for row in rows:
            row.seen.update(p for p in row.places if fnmatch.fnmatch(file, p))
        if not rows:
            wrong.append(f"{file}:{line}: rule {rule}, not among the deviations of {LIST.name}")
    for row in listed:
        for place in row.places:
            if same_release and not row.by_hand and place not in row.seen:
                wrong.append(f"{LIST.name}: {row.number}, rule {row.rule}: not found in {place}")
    return wrong


def main() -> int:
    """Run the tool over every profile and compare."""
    cppcheck = sys.argv[1]
    text = LIST.read_text(encoding="utf-8")
    release = subprocess.run([cppcheck, "--version"], capture_output=True, text=True, check=True)
    name = " ".join(release.stdout.split()[:2])
    same = name in text
    found = set().union(*(find(cppcheck, profile) for profile in PROFILES))
    listed = read_list(text)
    wrong = compare(listed, found, same_release=same)
    print(f"{name}: {len(found)} findings, {len(listed)} deviations")
    if not same:
        print("another release than the list's: rows that are not needed are not looked for")
    print("\n".join(wrong))
    return 1 if wrong or not listed else 0


if __name__ == "__main__":
    sys.exit(main())
