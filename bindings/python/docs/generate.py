"""Pages of the reference that come from the sources: headers, commands and keys of drive files."""

from __future__ import annotations

import argparse
import re
import textwrap
from pathlib import Path

from lostmotion import cli, drives, structs
from lostmotion.combined_tolerances import COMBINED_KEYS
from lostmotion.effects.library import library
from lostmotion.keys import Key
from lostmotion.recordings import QUANTITIES
from lostmotion.units import dimension_name

GROUPS = {
    "For everybody": ("real", "status", "version"),
    "Design model: geometry to torsion curve": (
        *("drive", "design_keys", "shape", "involute", "mesh", "takeup", "radial_gap"),
        *(
            "radial_chain",
            "torsion_chain",
            "tooth_bending",
            "tolerance",
            "checks",
            "torsion_curve",
        ),
    ),
    "Runtime: what a motor controller links": (
        *("runtime", "compensator", "state", "model", "parameters", "curve", "play", "effects"),
        *("torque", "elementary", "profile"),
    ),
}
"""Headers in the order of reading."""

COMMENT = re.compile(r"/\*(.*?)\*/", re.DOTALL)


def write_pages(checkout: Path, folder: Path) -> None:
    """Write all generated pages; unchanged pages keep their time stamps."""
    folder.mkdir(parents=True, exist_ok=True)
    pages = {
        "commands.md": commands_page(),
        "drive_file.md": drive_file_page(),
        "recordings.md": recordings_page(),
        "headers.md": headers_page(checkout),
    }
    for name in sorted({name for group in GROUPS.values() for name in group}):
        header = checkout / "lib" / "include" / "lostmotion" / f"{name}.h"
        pages[f"{name}_h.md"] = header_page(header)
    for name, text in pages.items():
        target = folder / name
        if not target.exists() or target.read_text(encoding="utf-8") != text:
            target.write_text(text, encoding="utf-8")
    for stale in folder.glob("*.md"):
        if stale.name not in pages:
            stale.unlink()


# --- headers -------------------------------------------------------------------------------------


def headers_page(checkout: Path) -> str:
    """List the headers with the first sentence of each."""
    lines = ["# The C library", ""]
    for group, names in GROUPS.items():
        lines += [f"## {group}", ""]
        for name in names:
            text = (checkout / "lib" / "include" / "lostmotion" / f"{name}.h").read_text()
            first = plain(COMMENT.search(text)[1]).split("\n\n")[0]  # type: ignore[index]
            sentence = re.split(r"(?<=[.:])\s", " ".join(first.split()))[0].rstrip(":")
            lines.append(f"- [`{name}.h`]({name}_h.md): {escape(sentence)}")
        lines.append("")
    lines += ["```{toctree}", ":hidden:", ""]
    lines += [f"{name}_h" for names in GROUPS.values() for name in names]
    return "\n".join([*lines, "```", ""])


def header_page(header: Path) -> str:
    """Turn a header into a page: its comments as text, its declarations as code."""
    text = header.read_text(encoding="utf-8")
    head = COMMENT.match(text)
    assert head is not None, header
    lines = [f"# {header.name}", "", prose(head[1]), ""]
    body = text[head.end() :]
    body = re.sub(r"^#(?:ifndef|define) LOSTMOTION_\w+_H$", "", body, flags=re.MULTILINE)
    body = re.sub(r"^(?:LM_BEGIN_DECLS|LM_END_DECLS)$", "", body, flags=re.MULTILINE)
    for comment, code in pieces(body):
        name = title(code)
        if name:
            lines += [f"## {name}", ""]
        if comment:
            lines += [prose(comment), ""]
        if code:
            lines += ["```c", code, "```", ""]
    return "\n".join(lines)


def pieces(body: str) -> list[tuple[str, str]]:
    """Split the text of a header into comments and the code that follows each."""
    found: list[tuple[str, str]] = []
    for paragraph in re.split(r"\n\s*\n", body):
        chunk = paragraph.strip("\n")
        if not chunk.strip() or chunk.strip() == "#endif" or chunk.startswith("#include"):
            continue
        comment = ""
        match = re.match(r"\s*/\*(.*?)\*/", chunk, re.DOTALL)
        if match:
            comment, chunk = match[1], chunk[match.end() :].strip("\n")
        if found and not comment and depth(found[-1][1]) > 0:
            found[-1] = (found[-1][0], f"{found[-1][1]}\n\n{chunk}")
        else:
            found.append((comment, chunk))
    return found


def depth(code: str) -> int:
    """Braces and preprocessor conditions that are still open."""
    bare = COMMENT.sub("", code)
    conditions = len(re.findall(r"^#\s*if", bare, re.MULTILINE))
    return bare.count("{") - bare.count("}") + conditions - bare.count("#endif")


def title(code: str) -> str:
    """Name what a piece of code declares; several functions name the first."""
    bare = COMMENT.sub("", code)
    for pattern in (
        r"^\}\s*(lm_\w+);",
        r"\b(lm_\w+)\(",
        r"^#\s*define\s+(LM_\w+)",
        r"\b(lm_\w+)\[",
    ):
        match = re.search(pattern, bare, re.MULTILINE)
        if match:
            return match[1]
    return ""


def plain(comment: str) -> str:
    """Remove the stars of a comment."""
    lines = [
        re.sub(r"^\s*\*? ?", "", line) if i else line for i, line in enumerate(comment.split("\n"))
    ]
    return "\n".join(line.rstrip() for line in lines).strip()


def prose(comment: str) -> str:
    """Turn a comment into Markdown: indented lines, which are formulas and tables, are kept."""
    out: list[str] = []
    for paragraph in re.split(r"\n\s*\n", plain(comment)):
        block: list[str] = []
        kind = False
        for line in paragraph.split("\n"):
            indented = line.startswith("  ")
            if block and indented != kind:
                out.append(show(block, kind))
                block = []
            kind = indented
            block.append(line)
        out.append(show(block, kind))
    return "\n\n".join(out)


def show(lines: list[str], code: bool) -> str:
    """Format lines of a comment."""
    if code:
        return "```none\n" + textwrap.dedent("\n".join(lines)) + "\n```"
    heading = re.fullmatch(r"-{2,} (.*?) -{2,}", " ".join(lines))
    return f"**{escape(heading[1])}**" if heading else escape("\n".join(lines))


def escape(text: str) -> str:
    """Escape characters that Markdown would interpret."""
    return re.sub(r"([\\`*_{}\[\]<>#|$~])", r"\\\1", text)


# --- commands ------------------------------------------------------------------------------------


def commands_page() -> str:
    """Show the help of every command."""
    parser = cli.make_parser()
    lines = [
        "# Commands",
        "",
        "Exit status: 0 done; 1 the work failed; 2 bad input or usage; 130 interrupted. For bad "
        "input, one line on standard error states the file, key or column, what was found and what "
        "was expected, and nothing is written. Output files are written completely or not at all.",
        "",
    ]
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for name, command in action.choices.items():
                lines += [f"## lostmotion {name}", "", "```none"]
                lines += [command.format_help().rstrip(), "```", ""]
    return "\n".join(lines)


# --- files ---------------------------------------------------------------------------------------


def table(head: list[str], rows: list[list[str]]) -> list[str]:
    """Format a table."""
    lines = [head, ["---"] * len(head), *rows]
    return ["| " + " | ".join(line) + " |" for line in lines] + [""]


def key_rows(keys: tuple[Key, ...]) -> list[list[str]]:
    """Rows of a table of keys."""
    rows = []
    for key in keys:
        if key.kind == "choice":
            value = "one of " + ", ".join(f"`{choice}`" for choice in key.choices)
        else:
            value = {"switch": "`true` or `false`", "text": "text"}.get(
                key.kind, "an integer" if key.kind == "integer" else "a number"
            )
        rows.append([f"`{key.written}`", value, "yes" if key.required else ""])
    return rows


def design_rows(keys: tuple[structs.DesignKey, ...]) -> list[list[str]]:
    """Rows of a table of keys of a design, with their ranges and meanings."""
    rows = []
    for key, (written, value, required) in zip(keys, key_rows(keys), strict=True):
        if key.kind in ("real", "integer"):
            value = key.range
        if key.default is not None:
            shown = f"{key.default:.4g}" if key.kind == "real" else str(int(key.default))
            if key.kind == "choice":
                shown = f"`{key.choices[int(key.default)]}`"
            elif key.kind == "switch":
                shown = "`true`" if key.default else "`false`"
            required = f"no: {shown}"
        rows.append([written, value, required, escape(key.meaning)])
    return rows


def drive_file_page() -> str:
    """List the keys of a drive file from the tables that read it."""
    head = ["key", "value", "required"]
    lines = [
        "# Drive files",
        "",
        "A drive file is TOML with `[drive]` and exactly one of `[catalogue]` (a bought drive) and "
        "`[design]` (a drive that is being designed). The unit is a suffix of the key; any unit of "
        "the same dimension is accepted, for example `rated_torque_mNm` for `rated_torque_Nm`. An "
        "unknown key, a wrong unit, a wrong type or an impossible value is refused. Omitted keys "
        "of a design have defaults in proportion to its size, which `lostmotion predict` lists. "
        "Ranges are in the unit of the key unless another is stated.",
        "",
        "## [drive]",
        "",
        *table(head, key_rows(drives.DRIVE_KEYS)),
        "## [catalogue]",
        "",
        *table(head, key_rows(drives.CATALOGUE_KEYS)),
    ]
    for section, keys in structs.FIELDS.items():
        lines += [f"## [design.{section}]" if section else "## [design]", ""]
        lines += table([*head, "meaning"], design_rows(keys))
    for chain, kinds in drives.CHAINS.items():
        lines += [f"## [[design.{chain}]]", ""]
        lines += ["Each entry has a `kind`, optionally a `name`, and these keys:", ""]
        combined = COMBINED_KEYS if chain == "tolerance" else {}
        for kind, keys in {**kinds, **combined}.items():
            lines += [f'`kind = "{kind}"`', "", *table(head, key_rows(keys))]
    lines += [
        "## [columns]",
        "",
        "A map from the columns of recordings to `NAME_UNIT`. `-NAME_UNIT` inverts the sign, "
        "`NAME_UNIT/NUMBER` divides (`input_angle_rev/4096`: encoder counts). It applies to the "
        "files that have the column; a column that is in no file is an error.",
        "",
        "## [recordings]",
        "",
        "The protocol of the recordings of this drive. Options of a command take precedence.",
        "",
        *table(head, key_rows(drives.RECORDING_KEYS)),
        "## [fit] and [[effect]]",
        "",
        "The results of a fit, and the active effects with their parameters. Names of effects: "
        + ", ".join(f"`{name}`" for name in library())
        + ".",
        "",
    ]
    return "\n".join(lines)


def recordings_page() -> str:
    """List the columns of a recording from the table that reads them."""
    rows = [
        [
            f"`{q.column}`",
            dimension_name(q.dimension) if q.unit else "no unit",
            f"{q.low:g} to {q.high:g}",
        ]
        for q in QUANTITIES.values()
        if q.name != "run"
    ]
    lines = [
        "# Recordings",
        "",
        "Recordings are CSV (`.csv`, `.csv.gz`) or Parquet files with one row per sample. Several "
        "files or folders make one campaign. `run` (integer or text) numbers the uninterrupted "
        "recordings of a file; without it a file is one run. Time, torque, and either the lost "
        "motion or both angles are required. If one side was locked (`--locked output`, "
        "`--locked input`), its angle may be omitted. With the output locked, `motor_torque_Nm`, "
        "or `motor_current_A` with a torque constant, can replace the torque. `order`, a running "
        "number, can replace the time. `--map COLUMN=NAME_UNIT` gives a unit to a column without "
        "one. Unknown columns are listed and ignored.",
        "",
        *table(["column", "any unit of", "range in the unit of the name"], rows),
    ]
    return "\n".join(lines)
