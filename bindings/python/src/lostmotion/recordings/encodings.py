"""Encodings: convert a text file to UTF-8 with line feeds."""

from __future__ import annotations

import codecs
import re
from collections.abc import Collection
from functools import partial
from pathlib import Path

from lostmotion.errors import InputError

MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF32_LE, "utf-32-le"),
    (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)
"""Byte order marks; that of UTF-32 begins with that of UTF-16 and is therefore tried first."""

LOOKED_AT = 4096
"""Bytes at the beginning that identify UTF-16 without a mark; even, so that pairs are complete."""

NUL_SHARE = 0.7
"""Share of one byte of every pair that is NUL where text of mostly ASCII is UTF-16."""

OTHER_KINDS = (
    (b"PAR1", "a Parquet file", "the name to end in .parquet"),
    (b"PK\x03\x04", "a ZIP archive or a spreadsheet", "the table saved as CSV"),
    (b"\xd0\xcf\x11\xe0", "a spreadsheet of an old kind", "the table saved as CSV"),
    (b"\x89HDF", "an HDF5 file", "the table saved as CSV or Parquet"),
    (b"TDSm", "a TDMS file", "the table saved as CSV"),
    (b"MDF     ", "an MDF file", "the table saved as CSV"),
    (b"SQLite format 3", "an SQLite file", "the table saved as CSV"),
    (b"\x93NUMPY", "a NumPy file", "the table saved as CSV"),
    (b"%PDF", "a PDF", "the table saved as CSV"),
    (b"MATLAB 5.0 MAT-file", "a MAT file", "the table saved as CSV or Parquet"),
    (b"MATLAB 7.3 MAT-file", "a MAT file", "the table saved as CSV or Parquet"),
    (b"ARROW1", "an Arrow file", "the table saved as Parquet or CSV"),
    (b"FEA1", "a Feather file", "the table saved as Parquet or CSV"),
    (b"BZh", "a bzip2 archive", "the file unpacked, or packed by gzip"),
    (b"\xfd7zXZ\0", "an xz archive", "the file unpacked, or packed by gzip"),
    (b"\x28\xb5\x2f\xfd", "a Zstandard archive", "the file unpacked, or packed by gzip"),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive", "the file unpacked, or packed by gzip"),
    (b"Rar!", "a RAR archive", "the file unpacked, or packed by gzip"),
)
"""First bytes of other kinds of files, and the remedy."""

CONTROL = bytes({*range(1, 32)} - {*b"\t\n\v\f\r\x1a\x1b"})
"""Control characters that no text contains, with the exception of damaged cells. NULs fill the end
of a damaged file, 1A ends a DOS file, and 1B switches Japanese encodings."""

CONTROL_SHARE = 0.02
"""Least share of these in the beginning that identifies a file that is no text. In compressed data
and binary numbers every tenth byte is one; a damaged cell is shorter."""


def encoding_of(raw: bytes) -> tuple[str, int]:
    """Find the encoding of a text from its beginning, and the length of its byte order mark.

    Text without a mark that is not UTF-16 counts as UTF-8; `decoded` handles other cases.
    """
    for mark, name in MARKS:
        if raw.startswith(mark):
            return name, len(mark)
    head = raw[:LOOKED_AT]
    pairs = max(len(head) // 2, 1)
    even, odd = head[0::2].count(0) / pairs, head[1::2].count(0) / pairs
    if len(head) >= 2 and odd > NUL_SHARE and even < 1 - NUL_SHARE:
        return "utf-16-le", 0
    if len(head) >= 2 and even > NUL_SHARE and odd < 1 - NUL_SHARE:
        return "utf-16-be", 0
    return "utf-8", 0


NATIONAL = ("cp1252", "gb18030", "shift_jis", "euc_kr", "big5", "cp1251", "cp1250", "cp1253")
"""Encodings of text that is not Unicode: Western, Chinese, Japanese, Korean, Cyrillic, Central
European, Greek. The first is used unless the names of a map are found only in another one, or no
letter beyond ASCII stands alone."""

ALONE = re.compile(rb"(?<![\x80-\xff])[\x80-\xff](?![\x80-\xff])")
"""A letter beyond ASCII without another one beside it: Chinese characters are pairs."""


def as_utf8(file: str | Path, raw: bytes, wanted: Collection[str] = ()) -> bytes:
    """Return the text of a file as UTF-8, its lines ended by line feeds.

    UTF-16 and UTF-32 are recognised by their mark, UTF-16 also by its NULs. Bytes that are not
    UTF-8 are read as Windows-1252, which includes Latin-1, or in the encoding in which they have
    the names of a map, unless the text before them has letters in UTF-8, and most are: then they
    are damage, and remain visible as escapes.

    Parameters
    ----------
    file : str or Path
        For messages.
    raw : bytes
    wanted : collection of str
        Names of columns in a map.

    Raises
    ------
    InputError
        For files that begin like another kind, or are not text.
    """
    for begin, kind, expected in OTHER_KINDS:
        if raw.startswith(begin):
            raise InputError(file, "", f"{kind} with the file name of a text file", expected)
    name, mark = encoding_of(raw)
    head = raw[:LOOKED_AT]
    if name == "utf-8" and len(head) - len(head.translate(None, CONTROL)) > CONTROL_SHARE * len(
        head
    ):
        raise InputError(file, "", "binary data, no text", "the table saved as CSV or Parquet")
    if name != "utf-8":
        whole = len(raw) - (len(raw) - mark) % (4 if "32" in name else 2)
        raw = raw[mark:whole].decode(name, "backslashreplace").encode("utf-8", "backslashreplace")
    else:
        raw = raw[mark:]
        if not raw.isascii():
            raw = decoded(raw, wanted).encode("utf-8", "backslashreplace")
    if b"\r" in raw:
        raw = raw.replace(b"\r\r\n", b"\n").replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return raw


def decoded(raw: bytes, wanted: Collection[str] = ()) -> str:
    """Decode text that is UTF-8, or nearly, or in a national encoding."""
    try:
        return raw.decode()
    except UnicodeDecodeError as error:
        damaged = not raw[: error.start].isascii() and mostly_utf8(raw)
        likely = ["utf-8", *NATIONAL] if damaged else list(NATIONAL)
        if likely[0] != "utf-8" and not ALONE.search(raw[:LOOKED_AT]):
            likely.sort(key=lambda name: name != "gb18030")
    return raw.decode(max(likely, key=partial(names_in, raw, wanted)), "backslashreplace")


def mostly_utf8(raw: bytes) -> bool:
    """Whether at least as many letters beyond ASCII are UTF-8 as are not: some pairs are both."""
    letters = [letter for letter in raw.decode("utf-8", "replace") if not letter.isascii()]
    return 2 * letters.count("\ufffd") <= len(letters)


def names_in(raw: bytes, wanted: Collection[str], encoding: str) -> int:
    """Count the names that a text has in an encoding."""
    names = (name.encode(encoding, "ignore") for name in wanted if not name.isascii())
    return sum(bool(name) and name in raw for name in names)
