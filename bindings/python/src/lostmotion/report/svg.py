"""SVG drawings: the elements used in the report's figures.

Every drawing is self-contained (no style sheet, no ids), so that it can be copied from the page.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from html import escape
from itertools import takewhile

import numpy as np
import numpy.typing as npt

from lostmotion.arrays import FloatArray
from lostmotion.results.colours import INK, PAPER

FONT = "system-ui, -apple-system, 'Segoe UI', Roboto, 'Helvetica Neue', Arial, sans-serif"

TEXT_SIZE = 13.0
SMALL_SIZE = 11.5

SIMPLIFY_PX = 0.25
"""Largest deviation of a simplified curve from the samples."""


def abridged(names: Sequence[str]) -> list[str]:
    """Remove common leading and trailing words from names."""

    def shared(texts: Sequence[str]) -> int:
        pairs = zip(min(texts), max(texts), strict=False)
        start = "".join(a for a, b in takewhile(lambda pair: pair[0] == pair[1], pairs))
        return len(re.sub(r"[^\W_]+$", "", start))

    first, last = shared(names), shared([name[::-1] for name in names])
    inner = [name[first : len(name) - last] for name in names]
    if len(names) < 2 or not all(inner):
        return list(names)
    return ["…" * (first > 0) + name + "…" * (last > 0) for name in inner]


def coord(value: float) -> str:
    """Write a coordinate: a tenth of a pixel is enough."""
    return f"{value:.1f}".removesuffix(".0").replace("-0.0", "0")


def fine(value: float) -> str:
    """Write a coordinate that is part of a shape, to a hundredth."""
    text = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def signs(text: str) -> str:
    """Write hyphens that stand for a minus as true minus signs; zero has none, nor a plus."""
    text = re.sub(r"(?<![\w-])[-+](?=0(?:\.0+)?(?![\w.]))", "", text)
    return re.sub(r"(?<![\w-])-(?=[0-9.])", "−", text)


POINT_LENGTH = 1e-9
"""A chord shorter than this, in pixels, is a point, because its square would underflow."""


def simplify(points: FloatArray, slack: float = SIMPLIFY_PX) -> FloatArray:
    """Remove points of a curve that are within `slack` of the simplified line.

    Parameters
    ----------
    points : ndarray, shape (n, 2)
    slack : float
        0 keeps all points.

    Returns
    -------
    ndarray, shape (m, 2)
        Subset of the points with both ends (Douglas and Peucker).
    """
    count = len(points)
    if count < 3 or slack == 0:
        return points
    places = points[:, 0] + 1j * points[:, 1]
    kept: npt.NDArray[np.intp] = np.array([0, count - 1])
    while True:  # all parts of the line at once
        first, last = kept[:-1], kept[1:]
        part = np.repeat(np.arange(first.size), last - first)
        chord = places[last] - places[first]
        length = np.hypot(chord.real, chord.imag)
        length[length <= POINT_LENGTH] = np.inf
        inverse = chord.real / length**2 - 1j * (chord.imag / length**2)
        inner = places[:-1] - places[first][part]
        along = (inner * inverse[part]).real
        distance = np.abs(inner - np.clip(along, 0.0, 1.0) * chord[part])
        worst = np.maximum.reduceat(distance, first)
        at_worst = np.flatnonzero((distance == worst[part]) & (worst > slack)[part])
        if not at_worst.size:
            return points[kept]
        one_each = np.diff(part[at_worst], prepend=-1) > 0
        kept = np.sort(np.concatenate((kept, at_worst[one_each])))


def path_data(points: FloatArray, *, closed: bool = False) -> str:
    """Write points as path data, each relative to the previous one."""
    x, y = (np.rint(points[0] * 100) / 100).tolist()
    head, tail = f"M{fine(x)} {fine(y)}", path_moves(points)
    return head + (f"l{tail}" if tail else "h0") + ("z" if closed else "")


def path_moves(points: FloatArray) -> str:
    """Write the moves from point to point in hundredths of a pixel, without those of no length."""
    steps = np.rint(np.asarray(points, dtype=np.float64) * 100).astype(np.int64)
    moves = np.diff(steps, axis=0)
    moves = moves[np.any(moves != 0, axis=1)]
    return " ".join(f"{x:g} {y:g}" for x, y in (moves / 100).tolist())


def rich(text: str) -> str:
    """Escape a text for SVG; ``_{N}`` becomes a subscript."""
    parts = re.split(r"_\{([^}]*)\}", text)
    out = [escape(parts[0], quote=False)]
    for sub, rest in zip(parts[1::2], parts[2::2], strict=True):
        out.append(f'<tspan dy=".25em" font-size="75%">{escape(sub, quote=False)}</tspan>')
        # The shift of a tspan persists, so the text after it is shifted back.
        after = escape(rest, quote=False)
        out.append(f'<tspan dy="-.19em">{after or "&#8203;"}</tspan>')
    return "".join(out)


class Drawing:
    """A picture of a fixed size in user units, drawn from back to front.

    Parameters
    ----------
    width, height : float
        Size; the page scales the figure to the available width.
    title : str
        Text alternative of the figure.
    """

    def __init__(self, width: float, height: float, title: str) -> None:
        self.width = width
        self.height = height
        self.title = title
        self.elements: list[str] = []

    def add(self, element: str) -> None:
        """Add an element unchanged."""
        self.elements.append(element)

    def open_window(self, x: float, y: float, width: float, height: float) -> None:
        """Clip everything up to `close_window` to a rectangle; coordinates are unchanged."""
        box = " ".join(coord(v) for v in (x, y, width, height))
        self.add(
            f'<svg x="{coord(x)}" y="{coord(y)}" width="{coord(width)}" '
            f'height="{coord(height)}" viewBox="{box}">'
        )

    def close_window(self) -> None:
        """End a clipped part."""
        self.add("</svg>")

    def line(
        self,
        ends: Sequence[float],
        stroke: str = INK,
        width: float = 1.0,
        dash: str = "",
    ) -> None:
        """Draw a straight line from ``ends[:2]`` to ``ends[2:]``."""
        x1, y1, x2, y2 = (coord(v) for v in ends)
        self.add(
            f'<path d="M{x1} {y1}L{x2} {y2}" stroke="{stroke}" stroke-width="{fine(width)}"'
            f"{_dash(dash)}/>"
        )

    def curve(
        self,
        points: FloatArray,
        stroke: str = INK,
        width: float = 1.5,
        dash: str = "",
        opacity: float = 1.0,
        slack: float = SIMPLIFY_PX,
    ) -> None:
        """Draw a curve through points, shape (n, 2); breaks where they are not finite."""
        data = "".join(path_data(simplify(piece, slack)) for piece in pieces(points))
        if data:
            self.add(
                f'<path d="{data}" fill="none" stroke="{stroke}" stroke-width="{fine(width)}" '
                f'stroke-linejoin="round"{_dash(dash)}{_opacity(opacity)}/>'
            )

    def area(
        self,
        points: FloatArray,
        fill: str,
        stroke: str = "none",
        width: float = 1.0,
        opacity: float = 1.0,
        slack: float = SIMPLIFY_PX,
    ) -> None:
        """Fill the area within points, shape (n, 2)."""
        data = path_data(simplify(points, slack), closed=True)
        edge = "" if stroke == "none" else f' stroke="{stroke}" stroke-width="{fine(width)}"'
        self.add(
            f'<path d="{data}" fill="{fill}"{edge} stroke-linejoin="round"{_opacity(opacity)}/>'
        )

    def edge(
        self,
        points: FloatArray,
        rest: FloatArray,
        fill: str,
        stroke: str,
        width: float,
        opacity: float = 1.0,
    ) -> None:
        """Draw the edge of an area and fill the area, whose outline continues through `rest`."""
        data = path_data(points)
        steps = path_moves(np.concatenate((points[-1:], rest)))
        self.add(
            f'<path d="{data} {steps}z" fill="{fill}" stroke-linejoin="round"{_opacity(opacity)}/>'
        )
        self.add(
            f'<path d="{data}" fill="none" stroke="{stroke}" stroke-width="{fine(width)}" '
            'stroke-linejoin="round"/>'
        )

    def rectangle(
        self,
        x: float,
        y: float,
        width: float,
        height: float,
        fill: str,
        stroke: str = "none",
        opacity: float = 1.0,
    ) -> None:
        """Draw a rectangle."""
        edge = "" if stroke == "none" else f' stroke="{stroke}"'
        self.add(
            f'<rect x="{coord(x)}" y="{coord(y)}" width="{coord(width)}" '
            f'height="{coord(height)}" fill="{fill}"{edge}{_opacity(opacity)}/>'
        )

    def dots(
        self,
        points: Iterable[Sequence[float]],
        radius: float,
        fill: str,
        stroke: str = "none",
        width: float = 1.2,
    ) -> None:
        """Draw round marks."""
        edge = "" if stroke == "none" else f' stroke="{stroke}" stroke-width="{fine(width)}"'
        r = fine(radius)
        marks = "".join(f'<circle cx="{coord(x)}" cy="{coord(y)}" r="{r}"/>' for x, y in points)
        if marks:
            self.add(f'<g fill="{fill}"{edge}>{marks}</g>')

    def text(
        self,
        x: float,
        y: float,
        text: str,
        *,
        anchor: str = "start",
        size: float = TEXT_SIZE,
        fill: str = INK,
        weight: str = "",
        halo: bool = False,
    ) -> None:
        """Write a text with its base line at `y`; ``_{N}`` is a subscript.

        Parameters
        ----------
        anchor : {"start", "middle", "end"}
        weight : str
            ``"600"`` for bold.
        halo : bool
            Whether to draw a halo against the background.
        """
        extra = "" if anchor == "start" else f' text-anchor="{anchor}"'
        extra += "" if size == TEXT_SIZE else f' font-size="{fine(size)}"'
        extra += "" if fill == INK else f' fill="{fill}"'
        extra += f' font-weight="{weight}"' if weight else ""
        if halo:
            extra += f' paint-order="stroke" stroke="{PAPER}" stroke-width="3.5"'
        self.add(f'<text x="{coord(x)}" y="{coord(y)}"{extra}>{rich(text)}</text>')

    def render(self) -> str:
        """Return the SVG element."""
        size = f"{coord(self.width)} {coord(self.height)}"
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size}" '
            f'width="{coord(self.width)}" height="{coord(self.height)}" role="img" '
            f'font-family="{FONT}" font-size="{fine(TEXT_SIZE)}" fill="{INK}">'
            f"<title>{escape(self.title, quote=False)}</title>" + "".join(self.elements) + "</svg>"
        )


def pieces(points: FloatArray) -> list[FloatArray]:
    """Cut a curve where its points are not finite."""
    good = np.all(np.isfinite(points), axis=1)
    change = np.flatnonzero(np.diff(good)) + 1
    parts = np.split(points, change)
    return [part for part in parts if len(part) > 1 and np.all(np.isfinite(part[0]))]


def _dash(dash: str) -> str:
    return f' stroke-dasharray="{dash}"' if dash else ""


def _opacity(opacity: float) -> str:
    return "" if opacity == 1.0 else f' opacity="{fine(opacity)}"'
