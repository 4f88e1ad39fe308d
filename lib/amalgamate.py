#!/usr/bin/env python3
"""Write the run-time code as two files: lostmotion.h and lostmotion.c.

    python lib/amalgamate.py OUTPUT_FOLDER
    python lib/amalgamate.py --arduino OUTPUT_FOLDER

For projects that would rather add two files than a folder; the second form makes a library for
Arduino of them, which compiles src/ and nothing else. The header holds every public header of
the run-time code, the source every file of lib/runtime/ and lib/status.c. Names that are static in
more than one file get the file's name as a prefix; nothing else is changed.
"""

from __future__ import annotations

import re
import shutil
import sys
from pathlib import Path

LIB = Path(__file__).resolve().parent
INCLUDE = LIB / "include"
FIRST = "lostmotion/runtime.h"

LOCAL_INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]+"((?:lostmotion|runtime)/[^"]+)".*\n', re.M)
SYSTEM_INCLUDE = re.compile(r"^[ \t]*#[ \t]*include[ \t]+(<[^>]+>).*\n", re.M)
TOKEN = re.compile(r'/\*.*?\*/|"(?:\\.|[^"\\])*"|(?:\.|->)\s*\w+|\w+', re.S)

FUNCTION = re.compile(r"^(?:\w+ )*?static (?:inline )?[\w ]+?[ *](\w+)\(", re.M)
OBJECT = re.compile(r"^static const [\w ]+?[ *](\w+)(?:\[\w*\])? = ", re.M)
ENUMERATION = re.compile(r"^enum \{([^}]*)\};", re.M)
TYPE = re.compile(r"^typedef struct (\w+) \{", re.M)
MACRO = re.compile(r"^[ \t]*#[ \t]*define[ \t]+(\w+)", re.M)


def sources() -> list[Path]:
    """Every file that a controller compiles."""
    runtime = LIB / "runtime"
    return [LIB / "status.c", *sorted(runtime.glob("*.c")), *sorted(runtime.glob("effects/*.c"))]


def inline(name: str, seen: set[str], systems: set[str]) -> str:
    """Text of a header with the headers that it includes put in their places, each once."""
    if name in seen:
        return ""
    seen.add(name)
    file = INCLUDE / name if name.startswith("lostmotion/") else LIB / name
    return expand(file.read_text(encoding="utf-8"), seen, systems)


def expand(text: str, seen: set[str], systems: set[str]) -> str:
    """Put headers in their places; standard headers are gathered."""
    systems.update(SYSTEM_INCLUDE.findall(text))
    text = SYSTEM_INCLUDE.sub("", text)
    return LOCAL_INCLUDE.sub(lambda match: inline(match[1], seen, systems), text)


def local_names(text: str) -> set[str]:
    """Names that are the file's own: functions, tables, enumerators and types."""
    names = {*FUNCTION.findall(text), *OBJECT.findall(text), *TYPE.findall(text)}
    for body in ENUMERATION.findall(text):
        names.update(re.findall(r"\w+", body))
    return names


def rename(text: str, names: dict[str, str]) -> str:
    """Replace names, but not in comments and strings, and not the members of structs."""
    return TOKEN.sub(lambda match: names.get(match[0], match[0]), text)


def prefixed(name: str, stem: str) -> str:
    """A name with its file's name before it, in the same case."""
    return f"{stem.upper() if name.isupper() else stem}_{name}"


def licence() -> str:
    """The licence as a comment."""
    lines = (LIB / "LICENSE").read_text(encoding="utf-8").strip().splitlines()
    return "/*\n" + "\n".join(f" * {line}".rstrip() for line in lines) + "\n */\n"


def make_header(seen: set[str]) -> str:
    """Text of lostmotion.h."""
    systems: set[str] = set()
    body = inline(FIRST, seen, systems)
    # The default precision is above everything that requires it.
    top = "#ifndef LM_REAL_BITS\n#define LM_REAL_BITS 32\n#endif\n"
    includes = "".join(f"#include {name}\n" for name in sorted(systems))
    guard = "LOSTMOTION_H"
    return (
        f"{licence()}/* Made by lib/amalgamate.py from the public headers of lib/runtime. */\n"
        f"#ifndef {guard}\n#define {guard}\n\n{includes}\n{top}\n{body}\n#endif\n"
    )


def make_source(seen: set[str]) -> str:
    """Text of lostmotion.c."""
    texts = {file: file.read_text(encoding="utf-8") for file in sources()}
    owners: dict[str, int] = {}
    for text in texts.values():
        for name in local_names(text):
            owners[name] = owners.get(name, 0) + 1
    systems: set[str] = set()
    parts = []
    for file, text in texts.items():
        twins = {name for name in local_names(text) if owners[name] > 1}
        text = rename(text, {name: prefixed(name, file.stem) for name in twins})
        undefined = "".join(f"#undef {name}\n" for name in sorted(set(MACRO.findall(text))))
        place = file.relative_to(LIB).as_posix()
        parts.append(f"/* --- {place} --- */\n{expand(text, seen, systems)}{undefined}")
    includes = "".join(f"#include {name}\n" for name in sorted(systems))
    head = "/* Made by lib/amalgamate.py from lib/runtime and lib/status.c. */\n"
    own = '#include "lostmotion.h"\n'
    return f"{licence()}{head}{own}\n{includes}\n" + "\n".join(parts)


def main() -> int:
    """Write the files."""
    arguments = sys.argv[1:]
    arduino = "--arduino" in arguments
    places = [argument for argument in arguments if argument != "--arduino"]
    if len(places) != 1 or places[0].startswith("-"):
        print("usage: amalgamate.py [--arduino] OUTPUT_FOLDER", file=sys.stderr)
        return 2
    folder = Path(places[0])
    place = folder / "src" if arduino else folder
    place.mkdir(parents=True, exist_ok=True)
    seen: set[str] = set()
    (place / "lostmotion.h").write_text(make_header(seen), encoding="utf-8")
    (place / "lostmotion.c").write_text(make_source(seen), encoding="utf-8")
    if arduino:
        # The name under which every other package has it.
        (place / "lostmotion").mkdir(exist_ok=True)
        (place / "lostmotion" / "runtime.h").write_text('#include "../lostmotion.h"\n')
        for name in ("library.properties", "LICENSE"):
            shutil.copy(LIB / name, folder / name)
    return 0


if __name__ == "__main__":
    sys.exit(main())
