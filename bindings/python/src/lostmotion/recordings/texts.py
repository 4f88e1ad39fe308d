"""Texts: text files as tables, split and read by Arrow.

Lines that do not fit are left out first: torn lines, messages of a logger, NULs of a removed memory
card. Arrow reads a valid text at once, on all processors; only if it stops are the lines examined
one by one.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from lostmotion.arrays import WholeArray
from lostmotion.errors import InputError, one_line, shorten
from lostmotion.files import read_bytes
from lostmotion.recordings.cells import MISSING_SPELLINGS, is_value
from lostmotion.recordings.compressed import GZIP, inflate
from lostmotion.recordings.encodings import as_utf8
from lostmotion.recordings.findings import Finding
from lostmotion.recordings.layout import Layout, column_numbers, find_layout
from lostmotion.recordings.separators import Separator
from lostmotion.recordings.tables import CELLS_SHOWN, Header, Rows

HEAD_BYTES = 1 << 20
"""Size of the beginning of a text in which its table must start."""

LINES_SHARE = 0.5
"""Largest share of lines that may not fit: if most do not, the layout was not recognised."""

BLOCK_BYTES = 1 << 20
"""Least amount of text that Arrow reads at a time; a line must fit into it."""

WRAPPED_LINES = 8
"""Number of lines at the beginning that show whether every line is wrapped."""

QUOTED_LINE = re.compile(rb'"(?:[^"]|"")*[,;\t|](?:[^"]|"")*"')
"""A row in quotes: a table that was saved as a table of a single column."""

STAMPED_LINE = re.compile(rb"(?m)^\[?[0-9]{1,2}:[0-9]{2}:[0-9]{2}(?:[.,][0-9]+)?\]? ?-> ?")
"""A time of day and an arrow, as monitors of serial lines put them before every line."""

LISTED_LINE = re.compile(rb"(?m)^[ \t]*[\[({]([^\[\](){}\n]*)[\])}][,;]?[ \t]*$")
"""A list in brackets, as Python and MATLAB print a row."""

LABEL = re.compile(rb'(?:^|[,;\t ])[ \t]*("[^"\n]*"|[A-Za-z_][^,;:=\t \n]*)[ \t]*[:=]')
"""A name before a value."""

LABELLED_LINE = re.compile(
    rb'(?:[,; \t]*(?:"[^"\n]*"|[A-Za-z_][^,;:=\t \n]*)[ \t]*[:=][ \t]*[^,;:=\t ]*){2,}[,; \t]*'
)
"""Values with names before them, as programs that plot a serial line read them, and as JSON writes
records."""

OPENED = re.compile(rb'(?:^|[,;\t|])[ \t]*"(?:[^"]|"")*$')
"""A line that ends within a field in quotes, as in a name with its unit on a line below it."""

NAMES_UP_TO = 64
"""Number of lines at the beginning in which such names are looked for."""

TABLE_LEAST = 20
"""Least number of consecutive lines of numbers that are another table: of lines of three columns,
torn at random, 20 have one width once in 3^19, a billion. A summary below a table is shorter."""

COLUMNS_LEAST = 2
"""Least number of columns of a table: torque and lost motion."""

LINES_KEPT = 1000
"""Largest number of lines that do not fit whose text is kept; further ones are not examined."""

NUL_CELL = "NUL"
"""Replacement of a cell with NULs."""

JOINED_MAX = 8
"""Largest number of lines of a quoted field."""


class TextTable:
    """A text with separators."""

    def __init__(self, file: str, text: bytes, layout: Layout) -> None:
        self.file, self.layout = file, layout
        self.body = text[line_start(text, layout.last_line) :]
        self.lines: WholeArray | None = None
        self.findings = noted_before(file, layout)
        self.header = header_from(file, layout, text)
        self.cleaned = False
        self.blank = b"\n\n" in self.body.rstrip(b"\n")

    @classmethod
    def of_file(cls, file: Path, wanted: Collection[str]) -> TextTable:
        """Open a file."""
        raw = read_bytes(file, "a text with separators")
        if raw.startswith(GZIP) or file.name.lower().endswith(".gz"):
            raw = inflate(file, raw)
        text, labels = bare_lines(names_on_one_line(as_utf8(file, raw, wanted)))
        return cls(str(file), text, layout_of(file, text, wanted, labels))

    @classmethod
    def header_of_file(cls, file: Path, wanted: Collection[str]) -> Header:
        """Read only the header of a file."""
        raw = read_bytes(file, "a text with separators")
        if raw.startswith(GZIP) or file.name.lower().endswith(".gz"):
            raw = inflate(file, raw, HEAD_BYTES)
        text, labels = bare_lines(names_on_one_line(as_utf8(file, raw, wanted)))
        return header_from(str(file), layout_of(file, text, wanted, labels), text)

    @property
    def width(self) -> int:
        """Fields of a row."""
        return len(self.layout.names)

    def read(self, columns: Collection[int], as_text: bool = False) -> Rows:
        """Read columns, with types detected by Arrow, or as text."""
        table = None
        if not self.cleaned:
            table = self.arrow(columns, as_text)
            if table is None:
                self.clean()
        if table is None:
            table = self.arrow(columns, as_text)
        if table is None:
            table = self.arrow(columns, True)
        if table is None:
            raise InputError(
                self.file, "", "lines that cannot be split into fields", "lines of numbers"
            )
        found = {i: table.column(str(i)) for i in columns}
        return Rows(found, table.num_rows, self.place, list(self.findings), self.blocks())

    def arrow(self, columns: Collection[int], as_text: bool) -> Any:
        """Read the body with Arrow; None if a line does not fit or a column changes its type."""
        import pyarrow
        import pyarrow.csv

        if not self.cleaned and not fits_arrow(self.body):
            return None
        torn = False

        def handle(_: Any) -> str:
            nonlocal torn
            torn = True
            return "error"

        names = [str(i) for i in range(self.width)]
        text = self.layout.separator.tabled(self.body) if not self.cleaned else self.body
        if not text.strip(b"\n"):
            kind = pyarrow.float64()
            return pyarrow.table({str(i): pyarrow.array([], kind) for i in columns})
        try:
            table = pyarrow.csv.read_csv(
                native_bytes(text),
                read_options=pyarrow.csv.ReadOptions(
                    column_names=names, block_size=max(BLOCK_BYTES, 2 * longest_line(text))
                ),
                parse_options=pyarrow.csv.ParseOptions(
                    delimiter=self.layout.separator.read_as,
                    newlines_in_values=self.cleaned and b'"' in text,
                    invalid_row_handler=handle,
                ),
                convert_options=pyarrow.csv.ConvertOptions(
                    include_columns=[str(i) for i in columns],
                    column_types={str(i): pyarrow.string() for i in columns} if as_text else {},
                    null_values=MISSING_SPELLINGS,
                    strings_can_be_null=False,
                    true_values=[],
                    false_values=[],
                ),
            )
        except pyarrow.ArrowException:
            return None
        return None if torn else table

    def blocks(self) -> tuple[int, ...]:
        """Rows after a blank line."""
        if not self.blank:
            return ()
        self.place(0)
        assert self.lines is not None
        apart = np.flatnonzero(np.diff(self.lines) > 1) + 1
        return tuple(map(int, apart)) if apart.size < self.lines.size // 2 else ()

    def place(self, row: int) -> str:
        """Describe the location of a row."""
        if self.lines is None:
            body = np.frombuffer(self.body, dtype=np.uint8)
            ends = np.flatnonzero(body == ord("\n"))
            starts = np.concatenate(([0], ends + 1))
            full = np.concatenate((ends, [body.size])) > starts
            self.lines = np.flatnonzero(full) + self.layout.last_line + 1
        return f"line {self.lines[row]}" if row < self.lines.size else f"row {row + 1}"

    def clean(self) -> None:
        """Leave out the lines that do not fit, and count them."""
        self.cleaned = True
        separator = self.layout.separator
        named = max((i + 1 for i, name in enumerate(self.layout.names) if name), default=0)
        kept: list[bytes] = []
        numbers: list[int] = []
        torn: list[tuple[int, str]] = []
        lines = self.body.split(b"\n")
        at = 0
        sign, count = separator.read_as.encode(), 0
        while at < len(lines):
            number, line = self.layout.last_line + at + 1, lines[at]
            at += 1
            plain = b'"' not in line and b"\0" not in line and separator.sign != " "
            if plain and line.count(sign) == self.width - 1:
                if line.strip():
                    kept.append(line)
                    numbers.append(number)
                continue
            if not line.strip():
                continue
            torn_off = separator.sign != " " and line.count(sign) + 1 < named
            fields = [] if torn_off else fields_of(separator, line)
            if line.count(b'"') % 2 and count < LINES_KEPT:
                at, fields, line = self.over_lines(lines, at, fields)
            fields = without_nuls(fitted(fields, named, self.width), line)
            if not fields or line.count(b'"') % 2:
                count += 1
                if count <= LINES_KEPT:
                    torn.append((number, line.decode("utf-8", "backslashreplace")))
                most = LINES_SHARE * (count + len(kept) + len(lines) - at) if kept else 0
                if count > max(LINES_KEPT, most):
                    break
                continue
            kept.append(arrow_row(fields, separator.read_as))
            numbers.append(number)
        if count > LINES_SHARE * (count + len(kept)):
            number, first = torn[0]
            wide = len(fields_of(separator, first.encode()))
            where = self.layout.header_line
            expected = f", as in the header (line {where})" if where else ", as in most lines"
            found = f"{wide} field{'s' if wide != 1 else ''} in line {number}"
            if wide == self.width:
                found, expected = f"a single quotation mark in line {number}", " fields without it"
            raise InputError(self.file, "", found, f"{self.width}{expected}")
        if torn:
            self.refuse_other_table(torn)
            self.findings.append(set_aside(self.file, torn, count))
        self.body, self.lines = b"\n".join(kept), np.array(numbers, dtype=np.int64)

    def refuse_other_table(self, torn: Sequence[tuple[int, str]]) -> None:
        """Refuse consecutive lines of numbers with another number of columns.

        They are no damage: the logger restarted with another list of channels.
        """
        widths = [width_of_numbers(self.layout.separator, line) for _, line in torn]
        at = 0
        for at_next in range(1, len(torn) + 1):
            if (
                at_next < len(torn)
                and widths[at_next] == widths[at]
                and torn[at_next][0] == torn[at_next - 1][0] + 1
            ):
                continue
            if at_next - at >= TABLE_LEAST and widths[at] >= COLUMNS_LEAST:
                found = f"{widths[at]} columns of numbers from line {torn[at][0]} on"
                expected = f"{self.width} as above; split the file there"
                raise InputError(self.file, "", found, expected)
            at = at_next

    def over_lines(
        self, lines: Sequence[bytes], at: int, fields: list[str]
    ) -> tuple[int, list[str], bytes]:
        """Join a line with unclosed quotes to the following ones, if that makes a row."""
        line = lines[at - 1]
        for more in range(1, min(JOINED_MAX, len(lines) - at) + 1):
            joined = b"\n".join(lines[at - 1 : at + more])
            if joined.count(b'"') % 2 == 0:
                over = fields_of(self.layout.separator, joined)
                if len(over) == self.width:
                    return at + more, over, joined.replace(b"\n", b" ")
                break
        return at, fields, line


def names_on_one_line(text: bytes) -> bytes:
    """Put names in quotes over several lines on one line; blank lines keep the line numbers."""
    if b'"' not in text[:HEAD_BYTES]:
        return text
    *lines, rest = text.split(b"\n", NAMES_UP_TO)
    at = 0
    while at < len(lines):
        line, end = lines[at], at + 1
        while OPENED.search(line) and end < min(len(lines), at + JOINED_MAX):
            line, end = line + b" " + lines[end], end + 1
        cells = re.split(rb"[,;\t|]", line)
        if not OPENED.search(line) and not any(is_value(cell.decode()) for cell in cells):
            lines[at:end] = [line, *[b""] * (end - at - 1)]
        at = end
    return b"\n".join([*lines, rest])


def bare_lines(text: bytes) -> tuple[bytes, tuple[str, ...]]:
    """Remove what a program added to every line, and return the names among it.

    These are quotes, brackets of a list, a time of day and an arrow, or a name before every value.
    """
    head = [line for line in text[:HEAD_BYTES].split(b"\n", WRAPPED_LINES)[:WRAPPED_LINES] if line]
    if len(head) > 1 and all(QUOTED_LINE.fullmatch(line) for line in head):
        return re.sub(rb'(?m)^"(.*)"$', rb"\1", text).replace(b'""', b'"'), ()
    if len(head) > 1 and all(STAMPED_LINE.match(line) for line in head):
        text, head = STAMPED_LINE.sub(b"", text), [STAMPED_LINE.sub(b"", line) for line in head]
    if len(head) > 1 and all(LISTED_LINE.fullmatch(line) for line in head):
        text = LISTED_LINE.sub(rb"\1", text).replace(b"'", b'"')
        head = [LISTED_LINE.sub(rb"\1", line).replace(b"'", b'"') for line in head]
    labels = labels_of(head)
    if labels:
        value = rb"[ \t]*([^,;\t ]*)"
        cells = rb"[,;\t ]+".join(re.escape(label) + rb"[ \t]*[:=]" + value for label in labels)
        row = b",".join(rb"\%d" % (place + 1) for place in range(len(labels)))
        text = re.sub(rb"(?m)^[ \t]*" + cells + rb"[,; \t]*$", row, text)
    return text, tuple(label.strip(b'"').decode("utf-8", "backslashreplace") for label in labels)


def labels_of(head: Sequence[bytes]) -> list[bytes]:
    """Return the names before the values of every line; empty if there are none."""
    labels = [LABEL.findall(line) for line in head if LABELLED_LINE.fullmatch(line)]
    same = len(labels) == len(head) > 1 and all(each == labels[0] for each in labels)
    return labels[0] if same and len(set(labels[0])) == len(labels[0]) else []


def layout_of(
    file: Path, text: bytes, wanted: Collection[str], labels: Sequence[str] = ()
) -> Layout:
    """Find the layout of a text from its beginning; its `labels` are the names of its columns."""
    head = text[:HEAD_BYTES]
    if len(text) > HEAD_BYTES and b"\n" not in head:
        head = text[: text.find(b"\n") + 1] or text
    whole = len(head) == len(text)
    layout = find_layout(file, head.decode("utf-8", "backslashreplace"), whole, wanted)
    named = layout.header_line is None and len(labels) == len(layout.names)
    return replace(layout, names=tuple(labels)) if named else layout


def header_from(file: str, layout: Layout, text: bytes) -> Header:
    """Make the header of a table from its layout."""
    lines = text[line_start(text, layout.last_line) :][:HEAD_BYTES].split(b"\n", CELLS_SHOWN + 1)
    rows = [fields_of(layout.separator, line) for line in lines[:CELLS_SHOWN] if line.strip()]

    def cells(column: int) -> Sequence[str]:
        return [row[column].strip() for row in rows if column < len(row)]

    place = f"line {layout.header_line}" if (layout.header_line or 1) > 1 else ""
    if layout.header_line is None:
        numbered = layout.names == column_numbers(len(layout.names))
        place = "none found, columns are numbered" if numbered else "before every value"
    return Header(file, layout.names, layout.units, place, cells)


def noted_before(file: str, layout: Layout) -> list[Finding]:
    """Note the rows above the header."""
    if not layout.before:
        return []
    action = f"rows above the header in line {layout.header_line}; left out"
    return [Finding("set_aside", file, "all columns", None, len(layout.before), action)]


def set_aside(file: str, torn: Sequence[tuple[int, str]], count: int) -> Finding:
    """Report lines that are left out, with the first few."""
    number, line = torn[0]
    shown = one_line(shorten(line.replace("\0", "").strip() or "NUL bytes"))[:60]
    others = ", ".join(str(n) for n, _ in torn[1:4]) + (" ..." if count > 4 else "")
    more = f", and line{'s' if len(torn) > 2 else ''} {others}" if len(torn) > 1 else ""
    action = f"line {number} ('{shown}'){more} does not fit the header; left out"
    return Finding("set_aside", file, "all columns", None, count, action)


def width_of_numbers(separator: Separator, line: str) -> int:
    """Count the fields of a line; 0 if most of them are no numbers."""
    fields = fields_of(separator, line.encode())
    return len(fields) if 2 * sum(map(is_value, fields)) > len(fields) else 0


def fields_of(separator: Separator, line: bytes) -> list[str]:
    """Split a line; an unsplittable line is one field."""
    text = line.decode("utf-8", "backslashreplace")
    try:
        return separator.fields(text)
    except csv.Error:
        return [text]


def fitted(fields: list[str], named: int, width: int) -> list[str]:
    """Return the fields of a row, padded or cut at its end; none if it is torn."""
    while len(fields) > width and not fields[-1].strip():
        fields = fields[:-1]
    if named <= len(fields) < width:
        fields = fields + [""] * (width - len(fields))
    return fields if len(fields) == width else []


def without_nuls(fields: list[str], line: bytes) -> list[str]:
    """Mark the cell of a row with NULs; with several such cells the row is invalid."""
    if b"\0" not in line:
        return fields
    holding = [i for i, field in enumerate(fields) if "\0" in field]
    if len(holding) != 1:
        return []
    return [NUL_CELL if i == holding[0] else field for i, field in enumerate(fields)]


def arrow_row(fields: Sequence[str], sign: str) -> bytes:
    """Write a row for Arrow."""
    quoted = (
        '"' + field.replace('"', '""') + '"' if sign in field or '"' in field else field
        for field in fields
    )
    return sign.join(quoted).encode("utf-8", "backslashreplace")


def line_start(text: bytes, lines: int) -> int:
    """Offset after a number of lines."""
    place = 0
    for _ in range(lines):
        found = text.find(b"\n", place)
        if found < 0:
            return len(text)
        place = found + 1
    return place


def longest_line(text: bytes) -> int:
    """Length of the longest line."""
    ends = np.flatnonzero(np.frombuffer(text, dtype=np.uint8) == ord("\n"))
    return int(np.max(np.diff(ends, prepend=-1, append=len(text))))


def fits_arrow(text: bytes) -> bool:
    """Whether there are no NULs, and quotes are closed within their line."""
    if b"\0" in text:
        return False
    if b'"' not in text:
        return True
    body = np.frombuffer(text, dtype=np.uint8)
    ends = np.flatnonzero(body == ord("\n"))
    quotes = np.searchsorted(np.flatnonzero(body == ord('"')), np.append(ends, body.size))
    return not bool(np.any(np.diff(quotes, prepend=0) % 2))


def native_bytes(text: bytes) -> Any:
    """Copy text to memory owned by Arrow, for its readers.

    Their threads may release it at any time, also at interpreter exit; with a Python object this
    would abort a command that has already answered.
    """
    import pyarrow

    memory = pyarrow.allocate_buffer(len(text))
    np.frombuffer(memory, dtype=np.uint8)[:] = np.frombuffer(text, dtype=np.uint8)
    return pyarrow.BufferReader(memory)
