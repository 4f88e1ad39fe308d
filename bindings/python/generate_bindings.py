"""Write the cffi module for one precision from the public headers of the C library.

The C preprocessor makes the declarations that cffi needs from the headers, so only the headers
define the interface. Two things are changed: the C library's own headers are replaced by empty ones
(cffi has their types), and the headers are read as by a compiler without assembler labels, which
cffi does not parse.
"""

from __future__ import annotations

import argparse
import ast
import re
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

from cffi import FFI

HIDDEN_HEADERS = (
    "stddef.h",
    "stdint.h",
    "stdbool.h",
    "string.h",
    "math.h",
    "limits.h",
    "float.h",
    "stdio.h",
)
"""Headers whose types cffi has."""

PROFILE = "LM_PROFILE=LM_PROFILE_FULL"
"""Largest sizes of the runtime's structs: Python reads the parameters of any controller."""


HOOK = 'extern "Python" void lm_hook(void *);'
"""Function that the search calls from time to time; Python defines it."""


def preprocess(compiler: str, include: Sequence[Path], bits: int, source: str) -> str:
    """Run the C preprocessor on `source` with the headers in `include`."""
    with tempfile.TemporaryDirectory() as folder:
        for header in HIDDEN_HEADERS:
            (Path(folder) / header).touch()
        unit = Path(folder) / "headers.c"
        unit.write_text(source)
        windows = Path(compiler).stem.lower() == "cl"
        flags = ["/nologo", "/EP", "/X"] if windows else ["-E", "-P", "-nostdinc", "-std=c99"]
        result = subprocess.run(
            [
                compiler,
                *flags,
                f"-I{folder}",
                *(f"-I{path}" for path in include),
                f"-DLM_REAL_BITS={bits}",
                "-U__GNUC__",
                f"-D{PROFILE}",
                str(unit),
            ],
            capture_output=True,
            text=True,
            check=False,
        )
    if result.returncode != 0:
        raise SystemExit(f"{compiler} could not preprocess the headers:\n{result.stderr}")
    return result.stdout


def constant(expression: str) -> int | float | None:
    """Value of a C expression of number literals, or None for any other expression."""
    text = re.sub(r"\b(0[xX][0-9a-fA-F]+|\d+)[uUlL]+\b", r"\1", expression)
    text = re.sub(
        r"\((?:u?int(?:8|16|32|64)_t|unsigned|int|size_t|lm_real|float|double)\)", "", text
    )
    if not re.search(r"[.eE]", text.replace("0x", "")):
        text = text.replace("/", "//")
    allowed = (ast.Expression, ast.BinOp, ast.UnaryOp, ast.Constant, ast.operator, ast.unaryop)
    try:
        tree = ast.parse(text.strip(), mode="eval")
        if not all(isinstance(node, allowed) for node in ast.walk(tree)):
            return None
        value = eval(compile(tree, "<macro>", "eval"), {"__builtins__": {}})
    except (SyntaxError, TypeError, ZeroDivisionError):
        return None
    if not isinstance(value, (int, float)):
        return None
    return float(value) if "lm_real" in expression else value


def constants(
    compiler: str, include: Sequence[Path], bits: int, includes: str, headers: Sequence[Path]
) -> list[str]:
    """Declare the object-like LM_ macros of `headers` that are numbers."""
    names = set()
    for header in headers:
        names.update(re.findall(r"^#\s*define\s+(LM_\w+)[ \t]+\S", header.read_text(), re.M))
    # Inside a string literal a macro's own name is not replaced.
    probe = includes + "".join(f'\nlm_probe "{name}" {name};' for name in sorted(names))
    expanded = preprocess(compiler, include, bits, probe)
    lines = []
    for name, text in re.findall(r'^lm_probe "(\w+)" (.*);$', expanded, re.M):
        value = constant(text)
        if isinstance(value, int):
            lines.append(f"#define {name} ...\n")
        elif isinstance(value, float):
            lines.append(f"static const double {name};\n")
    return lines


def declarations(compiler: str, include: Sequence[Path], bits: int, includes: str) -> str:
    """Return the declarations of the headers, with every macro expanded."""
    text = preprocess(compiler, include, bits, includes)
    return re.sub(r"_Static_assert\s*\(.*?\)\s*;", "", text, flags=re.S)


def main() -> None:
    """Write the C source of one extension module."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--compiler", required=True)
    parser.add_argument("--include", type=Path, required=True, help="folder of lostmotion/")
    parser.add_argument("--optimizer", type=Path, help="its folder: bind the search instead")
    parser.add_argument("--bits", type=int, choices=(32, 64), required=True)
    parser.add_argument("--module", required=True)
    parser.add_argument("--output", type=Path, required=True)
    arguments = parser.parse_args()

    if arguments.optimizer is None:
        headers = sorted((arguments.include / "lostmotion").glob("*.h"))
        names = [f"lostmotion/{header.name}" for header in headers]
        folders = [arguments.include]
    else:
        names = ["spec.h", "run.h", "run_task.h", "output.h", "pool.h"]
        headers = sorted(arguments.optimizer.glob("*.h"))
        folders = [arguments.include, arguments.optimizer]
    includes = "\n".join(f'#include "{name}"' for name in names)
    where = (arguments.compiler, folders, arguments.bits, includes)
    ffi = FFI()
    ffi.cdef(declarations(*where))
    ffi.cdef("".join(constants(*where, headers)))
    if arguments.optimizer is not None:
        ffi.cdef(HOOK)
    ffi.set_source(arguments.module, includes)
    ffi.emit_c_code(str(arguments.output))


if __name__ == "__main__":
    main()
