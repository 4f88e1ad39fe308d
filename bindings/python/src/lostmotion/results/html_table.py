"""HTML tables of results, for notebooks."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence


def html_table(head: Sequence[str], rows: Iterable[Sequence[str]], lead: str = "") -> str:
    """Return texts as an HTML table, with a sentence before it."""

    def row(cells: Sequence[str], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in cells) + "</tr>"

    before = f"<p>{html.escape(lead)}</p>" if lead else ""
    body = "".join(row(cells, "td") for cells in rows)
    return f"{before}<table><thead>{row(head, 'th')}</thead><tbody>{body}</tbody></table>"
