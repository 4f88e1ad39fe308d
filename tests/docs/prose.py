"""The prose of the repository: texts of pages, messages, headers and comments.

A `Passage` is one piece of it with its place: a page, a comment, a docstring, a string of at least
two words. Names between backquotes and fenced code are left out.
"""

from __future__ import annotations

import io
import json
import re
import subprocess
import sys
import tokenize
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]

ELSEWHERE = ("tests/fuzz/corpus/", "tests/data/", "lib/LICENSE")
"""Data and third-party texts."""

QUOTED = re.compile(r"```.*?```|``[^`]+``|`[^`\n]+`", re.DOTALL)
"""A name between backquotes: code, not prose."""

FENCED = re.compile(r"^(`{3,})([^\n]*)\n.*?^\1[ \t]*$", re.MULTILINE | re.DOTALL)
"""A fenced block of a page; outputs of commands are kept, programs are not."""

PRINTED = ("text", "console")
"""Languages of fenced blocks that are prose."""

BRACED = re.compile(r"\{[^{}]*\}")
"""An expression in a formatted string."""

C_PROSE = re.compile(r'/\*.*?\*/|(?<!:)//[^\n]*|"(?:\\.|[^"\\\n])*"', re.DOTALL)
HASH_PROSE = re.compile(r"(?:^|(?<=\s))#[^\n]*", re.MULTILINE)


@dataclass(frozen=True)
class Passage:
    """One piece of prose: its file, the offset of its text in it, and the text."""

    file: Path
    begin: int
    text: str
    line: int

    @property
    def place(self) -> str:
        """Return file and line in the notation of editors."""
        return f"{self.file.relative_to(ROOT)}:{self.line}"


def files() -> list[Path]:
    """Return the files of the repository that contain prose."""
    listed = subprocess.run(
        ["git", "-C", str(ROOT), "ls-files", "-z"], check=True, capture_output=True, text=True
    ).stdout.split("\0")
    kinds = {".py", ".pyi", ".md", ".c", ".h", ".js", ".css", ".ipynb", ".toml", ".sh", ".cmake"}
    return [
        ROOT / name
        for name in listed
        if name
        and not name.startswith(ELSEWHERE)
        and (Path(name).suffix in kinds or Path(name).name in ("dev", "CMakeLists.txt", "Kconfig"))
        and (ROOT / name).is_file()
    ]


def blanked(text: str, pattern: re.Pattern[str]) -> str:
    """Return the text with every match of the pattern as blanks, lines kept."""
    return pattern.sub(lambda found: re.sub(r"[^\n]", " ", found[0]), text)


def without_program(block: re.Match[str]) -> str:
    """Return a fenced block as blanks, unless it shows the output of a command."""
    if block[2].strip().startswith(PRINTED):
        return block[0].replace("`", " ")
    return re.sub(r"[^\n]", " ", block[0])


def of_python(text: str) -> Iterator[tuple[int, str]]:
    """Yield offset and text of comments, docstrings and strings of several words."""
    starts = [0]
    for line in text.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    kept = {tokenize.COMMENT, tokenize.STRING}
    kept |= {tokenize.FSTRING_MIDDLE} if sys.version_info >= (3, 12) else set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type in kept:
            begin = starts[token.start[0] - 1] + token.start[1]
            end = starts[token.end[0] - 1] + token.end[1]
            if token.type == tokenize.COMMENT or " " in token.string:
                formatted = re.match(r"[rR]?[fF]", text[begin:end])
                yield begin, blanked(text[begin:end], BRACED) if formatted else text[begin:end]


def of_notebook(text: str) -> Iterator[tuple[int, str]]:
    """Yield the Markdown cells of a notebook, each at its first line's place."""
    for cell in json.loads(text)["cells"]:
        if cell["cell_type"] == "markdown" and cell["source"]:
            yield text.find(json.dumps(cell["source"][0])[1:-1]), "".join(cell["source"])


def passages(file: Path) -> list[Passage]:
    """Return the prose of a file."""
    text = file.read_text("utf-8")
    found: Iterator[tuple[int, str]]
    if file.suffix in (".py", ".pyi"):
        found = of_python(text)
    elif file.suffix == ".md":
        found = iter([(0, FENCED.sub(without_program, text))])
    elif file.suffix == ".ipynb":
        found = of_notebook(text)
    elif file.suffix in (".c", ".h", ".js", ".css"):
        found = ((one.start(), one[0]) for one in C_PROSE.finditer(text) if " " in one[0])
    else:
        found = ((one.start(), one[0]) for one in HASH_PROSE.finditer(text))
    return [
        Passage(file, begin, blanked(piece, QUOTED), text.count("\n", 0, begin) + 1)
        for begin, piece in found
    ]
