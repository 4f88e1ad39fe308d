"""The page: sections, figures and tables as one self-contained HTML file."""

from __future__ import annotations

import base64
import datetime
import gzip
import platform
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache
from html import escape
from urllib.parse import quote

import numpy as np

from lostmotion import __version__
from lostmotion.report.charts import Chart, chart_html, drawing_script
from lostmotion.report.figure_data import Columns, numbers_csv

WIDE, NARROW = 940.0, 360.0
"""Widths for which each figure is drawn: page or screen, and phone."""

BREAK_PX = 720
"""Below this width of the window the narrow pictures are shown."""

PACKED_FROM = 200_000
"""Characters from which the numbers behind a figure are compressed: a page of 44 200 samples would
be 2 MB larger otherwise."""

LONG, SLIM = 16, 4
"""A table with more rows and no more columns than this is shown in two halves side by side."""


@dataclass(frozen=True)
class Figure:
    """A drawing to scale, with its data.

    Attributes
    ----------
    name : str
        Of its files, without suffix.
    title, caption : str
        Content and reading instructions, plain text.
    draw : callable
        Returns the SVG for a width.
    columns : mapping
        The numbers behind it.
    """

    name: str
    title: str
    caption: str
    draw: Callable[[float], str]
    columns: Columns


@dataclass(frozen=True)
class PageTable:
    """A table on the page.

    Attributes
    ----------
    head : sequence of str
    rows : sequence of sequence of str
        Plain text; a cell that begins with ``!`` is marked as a failure.
    numbers : sequence of int
        Columns that are aligned to the right.
    folded : bool
        Whether it is folded at first, because few readers need it.
    """

    title: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    numbers: Sequence[int] = ()
    caption: str = ""
    folded: bool = False


@dataclass(frozen=True)
class Notes:
    """A list of sentences; folded if it is long."""

    title: str
    lines: Sequence[str]
    folded: bool = False


@dataclass(frozen=True)
class Raw:
    """A part of the page with its own script and HTML."""

    html: str


Block = Figure | PageTable | Notes | Raw | Chart
"""Elements of a section."""


@dataclass
class Section:
    """Section on one drive or one comparison.

    Attributes
    ----------
    facts : list of (str, str)
        Main results and their names.
    sources : list of (str, str)
        Input files and their fingerprints.
    """

    title: str
    lead: str
    facts: list[tuple[str, str]] = field(default_factory=list)
    blocks: list[Block] = field(default_factory=list)
    sources: list[tuple[str, str]] = field(default_factory=list)


def render(title: str, lead: str, sections: Sequence[Section], command: str) -> str:
    """Return the whole page.

    Parameters
    ----------
    title, lead : str
    sections : sequence of Section
    command : str
        The command line that made the page.
    """
    out = [
        "<!DOCTYPE html>",
        '<html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>{escape(title)}</title>",
        '<link rel="icon" href="data:,">',
        f"<style>{STYLE}</style></head><body>",
        f"<header><h1>{escape(title)}</h1><p>{escape(lead)}</p>",
    ]
    if len(sections) > 1:
        out.append("<nav><ol>")
        for i, section in enumerate(sections, 1):
            out.append(f'<li><a href="#s{i}">{escape(section.title)}</a></li>')
        out.append("</ol></nav>")
    out.append("</header><main>")
    figures = charts = 0
    for i, section in enumerate(sections, 1):
        numbered = f'<span class="n">{i}</span> ' if len(sections) > 1 else ""
        out.append(f'<section id="s{i}"><h2>{numbered}{escape(section.title)}</h2>')
        out.append(f"<p>{escape(section.lead)}</p>")
        out.append(facts_html(section.facts))
        for block in section.blocks:
            if isinstance(block, Figure):
                figures += 1
                out.append(_figure(block, figures))
            elif isinstance(block, Chart):
                figures += 1
                charts += 1
                place = f"{block.name}_{charts}"
                number = f"Figure {figures}. "
                out.append(
                    chart_html(block, place, number, numbers_link(block.name, block.columns))
                )
            else:
                out.append(markup(block))
        out.append("</section>")
    out.append("</main>")
    if any('class="chart"' in part for part in out):
        out.append(drawing_script())
    out.append(_provenance(sections, command))
    out.append("</body></html>")
    return "\n".join(out) + "\n"


def markup(block: PageTable | Notes | Raw) -> str:
    """Write a block that is no figure."""
    if isinstance(block, PageTable):
        return rows_html(block)
    return block.html if isinstance(block, Raw) else notes_html(block)


def facts_html(facts: Sequence[tuple[str, str]]) -> str:
    """Write the main results with their names; empty if there are none."""
    each = [
        f"<div><dt>{_joined(name)}</dt><dd>{_joined(value)}</dd></div>" for name, value in facts
    ]
    return f'<dl class="facts">{"".join(each)}</dl>' if each else ""


def _joined(text: str) -> str:
    """Escape a text and keep numbers and their units on one line."""
    return re.sub(r"(?<=[0-9.³]) (?=(?:N·m|arcmin|arcsec|µm|mm|MPa|%))", "&nbsp;", escape(text))


def numbers_link(name: str, columns: Columns | None) -> str:
    """Link to the numbers behind a figure, which it contains."""
    if columns is None:
        return ""
    text = numbers_csv(columns)
    if len(text) > PACKED_FROM:
        packed = base64.b64encode(gzip.compress(text.encode(), mtime=0)).decode()
        return (
            f'<a download="{name}.csv.gz" href="data:application/gzip;base64,{packed}">'
            "numbers (CSV, gzip)</a>"
        )
    numbers = "data:text/csv;charset=utf-8," + quoted(text, UNSAFE_IN_CSV)
    return f'<a download="{name}.csv" href="{escape(numbers)}">numbers (CSV)</a>'


UNSAFE_IN_CSV = re.compile(r"[^\w,.:/~-]+", re.ASCII)
UNSAFE_IN_SVG = re.compile(r"[^\w,.:/~ =;()'-]+", re.ASCII)
"""Characters that are not in an address as they are."""


def quoted(text: str, unsafe: re.Pattern[str]) -> str:
    """Quote the unsafe parts of a text for an address.

    They are short, few and mostly the same; `quote` alone examines every character.
    """
    known = cache(quote)
    return unsafe.sub(lambda part: known(part[0], ""), text)


def _figure(figure: Figure, number: int) -> str:
    wide, narrow = figure.draw(WIDE), figure.draw(NARROW)
    picture = "data:image/svg+xml;charset=utf-8," + quoted(wide, UNSAFE_IN_SVG)
    return (
        f'<figure><div class="wide">{wide}</div><div class="narrow">{narrow}</div>'
        f"<figcaption><b>Figure {number}. {escape(figure.title)}.</b> {escape(figure.caption)}"
        f'<span class="files">{numbers_link(figure.name, figure.columns)}'
        f'<a download="{figure.name}.svg" href="{escape(picture)}">picture (SVG)</a></span>'
        "</figcaption></figure>"
    )


def rows_html(rows: PageTable) -> str:
    """Write a table."""

    def cells(row: Sequence[str], tag: str) -> str:
        out = []
        for i, cell in enumerate(row):
            names = ["r"] if i in rows.numbers else []
            if cell.startswith("!"):
                cell = cell[1:]
                names.append("bad")
            mark = f' class="{" ".join(names)}"' if names else ""
            scope = ' scope="col"' if tag == "th" else ""
            out.append(f"<{tag}{scope}{mark}>{escape(cell)}</{tag}>")
        return "<tr>" + "".join(out) + "</tr>"

    def table(some: Sequence[Sequence[str]]) -> str:
        head = f"<thead>{cells(rows.head, 'th')}</thead>" if any(rows.head) else ""
        body = "".join(cells(row, "td") for row in some)
        return f'<div class="scroll" tabindex="0"><table>{head}<tbody>{body}</tbody></table></div>'

    beside = len(rows.rows) > LONG and len(rows.head) <= SLIM
    half = -(-len(rows.rows) // 2) if beside else len(rows.rows)
    tables = "".join(table(rows.rows[i : i + half]) for i in range(0, len(rows.rows), half or 1))
    if beside:
        tables = f'<div class="beside">{tables}</div>'
    caption = f'<p class="note">{escape(rows.caption)}</p>' if rows.caption else ""
    title = escape(rows.title)
    if rows.folded:
        return f"<details><summary>{title}</summary>{tables}{caption}</details>"
    return f"<h3>{title}</h3>{tables}{caption}"


def notes_html(notes: Notes) -> str:
    """Write a list of sentences."""
    lines = "".join(f"<li>{escape(line)}</li>" for line in notes.lines)
    if notes.folded:
        return f"<details><summary>{escape(notes.title)}</summary><ul>{lines}</ul></details>"
    return f"<h3>{escape(notes.title)}</h3><ul>{lines}</ul>"


def _provenance(sections: Sequence[Section], command: str) -> str:
    out = ["<footer><h2>How this report was made</h2><dl>"]
    out.append(f"<dt>command</dt><dd><code>{escape(command)}</code></dd>")
    today = datetime.datetime.now(datetime.timezone.utc).date().isoformat()
    out.append(f"<dt>date</dt><dd>{today}</dd>")
    out.append(
        f"<dt>versions</dt><dd>lostmotion {escape(__version__)} (library in double precision), "
        f"Python {platform.python_version()}, NumPy {np.__version__}</dd>"
    )
    seen: set[tuple[str, str]] = set()
    for section in sections:
        for source in section.sources:
            if source not in seen:
                seen.add(source)
                out.append(f"<dt>{escape(source[0])}</dt><dd><code>{escape(source[1])}</code></dd>")
    out.append("</dl></footer>")
    return "".join(out)


STYLE = f"""
:root {{ color-scheme: light; }}
* {{ box-sizing: border-box; }}
body {{ margin: 0 auto; padding: 2.2rem 1.25rem 3rem; max-width: 62rem; color: #1b1b1f;
  background: #fff; font: 1rem/1.5 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue",
  Arial, sans-serif; font-variant-numeric: tabular-nums; overflow-wrap: break-word; }}
h1 {{ font-size: 1.9rem; line-height: 1.2; margin: 0 0 .5rem; font-weight: 650; }}
h2 {{ font-size: 1.4rem; line-height: 1.25; margin: 3rem 0 .5rem; padding-top: 1rem;
  border-top: 2px solid #1b1b1f; font-weight: 650; }}
h3 {{ font-size: 1.05rem; margin: 2rem 0 .4rem; font-weight: 650; }}
p {{ margin: .4rem 0 1rem; max-width: 46rem; }}
a {{ color: #005a8d; }}
nav ol {{ margin: 0; padding-left: 1.4rem; }}
.n {{ color: #5f6368; margin-right: .3rem; }}
.facts {{ display: grid; grid-template-columns: repeat(auto-fill, minmax(13.5rem, 1fr));
  gap: .2rem 1.6rem; margin: 1rem 0 1.6rem; }}
.facts div {{ border-top: 1px solid #d5d8dc; padding: .35rem 0 .45rem; }}
.facts dt {{ color: #5f6368; font-size: .85rem; line-height: 1.3; }}
.facts dd {{ margin: 0; font-size: 1.12rem; font-weight: 600; }}
figure {{ margin: 1.8rem 0 2.4rem; break-inside: avoid; }}
figure svg {{ display: block; width: 100%; height: auto; }}
figure svg svg {{ display: inline; }}
.charts {{ display: grid; gap: .5rem 1rem; grid-template-columns: minmax(0, 1fr); }}
.beside2 {{ grid-template-columns: repeat(auto-fit, minmax(min(100%, 24rem), 1fr)); }}
.beside3 {{ grid-template-columns: repeat(auto-fit, minmax(min(100%, 17rem), 1fr)); }}
.chart {{ min-width: 0; }}
.files button {{ border: 0; padding: 0; background: none; color: #005a8d; font: inherit;
  text-decoration: underline; cursor: pointer; }}
figure.plot svg {{ display: inline; width: auto; }}
.narrow {{ display: none; }}
figcaption {{ margin-top: .7rem; font-size: .9rem; line-height: 1.45; color: #3c4043;
  max-width: 52rem; }}
figcaption b {{ color: #1b1b1f; }}
.files {{ display: block; margin-top: .25rem; }}
.files a, .files button {{ margin-right: 1.2rem; }}
.scroll {{ overflow-x: auto; background:
  linear-gradient(to left, #fff 1rem, #fff0) right / 2rem 100% no-repeat local,
  linear-gradient(to left, #0003, #0000) right / .6rem 100% no-repeat; }}
.beside {{ display: flex; flex-wrap: wrap; gap: 0 3rem; align-items: flex-start; }}
.beside .scroll {{ max-width: 100%; }}
table {{ border-collapse: collapse; font-size: .92rem; }}
th, td {{ text-align: left; padding: .28rem 1.1rem .28rem 0; border-bottom: 1px solid #e4e6e9;
  vertical-align: baseline; white-space: nowrap; }}
th {{ white-space: normal; vertical-align: bottom; border-bottom: 1px solid #1b1b1f;
  font-weight: 600; }}
th.r, td.r {{ text-align: right; }}
td:last-child:not(.r) {{ white-space: normal; }}
td.bad {{ color: #a3260b; font-weight: 650; }}
.note {{ font-size: .9rem; color: #3c4043; margin-top: .5rem; }}
ul {{ margin: .3rem 0 1rem; padding-left: 1.2rem; max-width: 50rem; }}
details {{ margin: 1rem 0; }}
summary {{ cursor: pointer; font-weight: 600; }}
footer {{ font-size: .88rem; color: #3c4043; }}
footer dt {{ font-weight: 600; margin-top: .5rem; }}
footer dd {{ margin: 0; overflow-wrap: anywhere; }}
code {{ font: .92em/1.4 ui-monospace, "SF Mono", Menlo, Consolas, monospace; }}
@media (max-width: {BREAK_PX}px) {{
  body {{ padding: 1.2rem .75rem 3rem; }}
  .wide {{ display: none; }}
  .narrow {{ display: block; }}
  h1 {{ font-size: 1.5rem; }}
  table {{ font-size: .8rem; overflow-wrap: normal; }}
  th, td {{ padding-right: .55rem; }}
  td {{ white-space: normal; }} td.r {{ white-space: nowrap; }}
}}
@media print {{
  @page {{ margin: 16mm 14mm; }}
  html {{ font-size: 9.5pt; }}
  body {{ padding: 0; max-width: none; }}
  h1 {{ font-size: 1.9rem; }}
  .scroll {{ overflow: visible; }}
  td {{ white-space: normal; }} td.r {{ white-space: nowrap; }}
  .wide {{ display: block; }}
  .narrow, .files, nav {{ display: none; }}
  h2, h3 {{ break-after: avoid; }}
  tr {{ break-inside: avoid; }}
  details::details-content {{ content-visibility: visible; display: block; }}
}}
""".strip()
