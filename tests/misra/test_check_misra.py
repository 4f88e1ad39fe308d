"""The list of MISRA deviations is complete, and violations not listed are found."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
from check_misra import LIST, ROOT, compare, read_list

TABLE = """
| D1 | 15.5 advisory | `lib/a.c`, `lib/b/*` | One. |
| D2 | 1.2 advisory | `lib/a.c` | (by hand) Two. |
"""


def test_rows_are_numbered_in_order_and_name_files_that_exist() -> None:
    rows = read_list(LIST.read_text())
    assert [row.number for row in rows] == [f"D{i + 1}" for i in range(len(rows))]
    assert len({row.rule for row in rows}) == len(rows)
    for row in rows:
        for place in row.places:
            assert list(ROOT.glob(place)), place


def test_a_finding_that_no_row_covers_is_an_error() -> None:
    rows = read_list(TABLE)
    found = {("15.5", "lib/a.c", "1"), ("15.5", "lib/b/c.c", "2")}
    assert not compare(rows, found, same_release=True)
    assert (
        "lib/c.c:3: rule 15.5"
        in compare(rows, found | {("15.5", "lib/c.c", "3")}, same_release=True)[0]
    )
    assert "rule 8.1" in compare(rows, found | {("8.1", "lib/a.c", "3")}, same_release=True)[0]


def test_a_row_that_nothing_needs_is_an_error_with_the_lists_own_release() -> None:
    found = {("15.5", "lib/a.c", "1")}
    assert "not found in lib/b/*" in compare(read_list(TABLE), found, same_release=True)[0]
    assert not compare(read_list(TABLE), found, same_release=False)
