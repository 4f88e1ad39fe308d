"""The code blocks of the documentation: run in the order of a page, outputs compared.

A page is Markdown. The language of a fenced block determines its use:

* ``python``: executed; the blocks of a page share their names;
* ``sh``: run by a POSIX shell in the page's folder, with ``LOSTMOTION`` naming the checkout;
* ``c``: compiled with all warnings, and run where it has a ``main``;
* any language with a caption: written to a file of that name first;
* ``text`` directly after a block that runs: its required output. A line of dots represents any
lines; a number may differ by one in its last digit.

``python tests/docs/blocks.py PAGE`` writes what the blocks print into the page.
"""

from __future__ import annotations

import atexit
import contextlib
import functools
import io
import os
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "bindings" / "python" / "docs"
LIB = ROOT / "lib"

RUN = ("python", "sh", "c")
"""Languages that are run."""

C_FLAGS = (
    "-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-ffp-contract=off", "-O1",
    f"-I{LIB / 'include'}", f"-I{LIB}", "-I.",
)  # fmt: skip

BLOCK = re.compile(
    r"^(?P<fence>`{3,})(?P<head>[^\n`]*)\n(?P<body>.*?)^(?P=fence)[ \t]*$", re.MULTILINE | re.DOTALL
)

NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?![\w.]*\w)")

KERNELS = "Haswell"
"""Kernels of OpenBLAS for the commands. Those for AVX-512 round otherwise; fits of drives with a
large form error then end at another point (page on real drives)."""


@dataclass
class Block:
    """One fenced block of a page."""

    page: Path
    line: int
    language: str
    caption: str
    code: str
    begin: int
    end: int
    expected: Block | None = None

    @property
    def name(self) -> str:
        """Place of the block, for messages."""
        return f"{self.page.name}:{self.line}"


def pages() -> list[Path]:
    """All pages of the documentation."""
    found = {p for p in DOCS.rglob("*.md") if not {"generated", "_build"} & set(p.parts)}
    return sorted(found | {DOCS.parent / "README.md"})


def read_blocks(page: Path) -> list[Block]:
    """Read the fenced blocks of a page, each with its expected output."""
    text = page.read_text(encoding="utf-8")
    found: list[Block] = []
    for match in BLOCK.finditer(text):
        head, body = match["head"].strip(), match["body"]
        caption = ""
        directive = re.fullmatch(r"\{code-block\}\s*(\w+)", head)
        if directive:
            head = directive[1]
            options = re.match(r"((?::\w+:.*\n)*)\n?", body)
            assert options is not None
            caption_line = re.search(r":caption:\s*(\S+)", options[1])
            caption = caption_line[1] if caption_line else ""
            body = body[options.end() :]
        line = text.count("\n", 0, match.start()) + 1
        block = Block(page, line, head, caption, body, match.start(), match.end())
        before = found[-1] if found else None
        between = text[before.end : match.start()].strip() if before else "x"
        if head == "text" and not between and before is not None and before.language in RUN:
            before.expected = block
        else:
            found.append(block)
    return found


@functools.cache
def library(bits: int) -> Path:
    """Compile the library once: all of it in float64, what a controller links in float32."""
    folder = Path(tempfile.mkdtemp(prefix="lostmotion-docs-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    parts = sorted((LIB if bits == 64 else LIB / "runtime").rglob("*.c"))
    compile_c([*{*parts, LIB / "status.c"}, f"-DLM_REAL_BITS={bits}", "-c"], folder)
    archive = folder / "liblostmotion.a"
    run(["ar", "rcs", archive, *sorted(folder.glob("*.o"))], folder)
    return archive


def compile_c(words: list[Any], folder: Path) -> None:
    """Run the C compiler."""
    run([os.environ.get("CC", "cc"), *C_FLAGS, *words], folder)


def run(words: list[Any], folder: Path, **options: Any) -> str:
    """Run a program; returns the output of both streams."""
    done = subprocess.run(
        [str(word) for word in words],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
        **options,
    )
    if done.returncode != 0:
        raise AssertionError(f"{words[0]} ended with {done.returncode}:\n{done.stdout}")
    return done.stdout


class Runner:
    """Runs the blocks of one page in one folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.names: dict[str, Any] = {"__name__": "__main__"}
        self.environment = {
            **os.environ,
            "LOSTMOTION": str(ROOT),
            "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
            "NO_COLOR": "1",
            "OPENBLAS_CORETYPE": KERNELS,
        }

    def run(self, block: Block) -> str:
        """Run a block; returns its output."""
        if block.caption:
            target = self.folder / block.caption
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(block.code, encoding="utf-8")
        if block.language == "python":
            return self.run_python(block)
        if block.language == "sh":
            return run(["sh", "-eu", "-c", block.code], self.folder, env=self.environment)
        if block.language == "c":
            return self.run_c(block)
        return ""

    def run_python(self, block: Block) -> str:
        """Execute Python in this process."""
        out = io.StringIO()
        code = compile("\n" * block.line + block.code, str(block.page), "exec")
        here = os.getcwd()
        os.chdir(self.folder)
        try:
            with contextlib.redirect_stdout(out):
                exec(code, self.names)
        finally:
            os.chdir(here)
        return out.getvalue()

    def run_c(self, block: Block) -> str:
        """Compile C, and run it if it is a program."""
        source = self.folder / (block.caption or f"block{block.line}.c")
        source.write_text(block.code, encoding="utf-8")
        if " main(" not in block.code:
            compile_c(["-fsyntax-only", "-Wno-unused-function", source], self.folder)
            return ""
        program = source.with_suffix("")
        bits = 32 if "lostmotion/runtime.h" in block.code else 64
        words = [source, f"-DLM_REAL_BITS={bits}", library(bits), "-lm", "-o", program]
        compile_c(words, self.folder)
        return run([program], self.folder)


def same_line(printed: str, expected: str) -> bool:
    """Whether two lines are equal, except for one in the last digit of a number."""
    if " ".join(NUMBER.sub("#", printed).split()) != " ".join(NUMBER.sub("#", expected).split()):
        return False
    for one, two in zip(NUMBER.findall(printed), NUMBER.findall(expected), strict=True):
        mantissa, _, power = two.lower().partition("e")
        digit = 10.0 ** (int(power or 0) - len(mantissa.partition(".")[2]))
        if abs(float(one) - float(two)) > 1.001 * digit * ("." in mantissa or bool(power)):
            return False
    return True


def differs(printed: str, expected: str) -> str:
    """Describe the first difference between the output of a block and the expected one."""
    lines = [line.rstrip() for line in printed.strip("\n").splitlines()]
    wanted = [line.rstrip() for line in expected.strip("\n").splitlines()]
    place = 0
    skipping = False
    for line in wanted:
        if line.strip() == "...":
            skipping = True
            continue
        begin = place
        while skipping and place < len(lines) and not same_line(lines[place], line):
            place += 1
        if place >= len(lines) or not same_line(lines[place], line):
            found = lines[begin] if begin < len(lines) else "the end"
            return f"expected {line!r}, found {found!r} in:\n{printed}"
        place += 1
        skipping = False
    if not skipping and place != len(lines):
        return f"more than expected: {lines[place]!r} in:\n{printed}"
    return ""


def rewrite(page: Path) -> None:
    """Run a page and write the outputs of its blocks into it; lines of dots are kept."""
    text = page.read_text(encoding="utf-8")
    changes: list[tuple[Block, str]] = []
    with tempfile.TemporaryDirectory() as folder:
        runner = Runner(Path(folder))
        for block in read_blocks(page):
            printed = runner.run(block)
            if block.expected is not None and differs(printed, block.expected.code):
                changes.append((block.expected, printed))
            elif block.expected is None and printed.strip():
                print(f"{block.name} prints:\n{printed}")
    for block, printed in reversed(changes):
        lines = [line.rstrip() for line in printed.strip("\n").splitlines()]
        fence = "```text\n" + "\n".join(lines) + "\n```"
        text = text[: block.begin] + fence + text[block.end :]
    page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    for name in sys.argv[1:]:
        rewrite(Path(name).resolve())
