"""The files of a drawing: CSV, DXF and the table."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path

from lostmotion.arrays import FloatArray
from lostmotion.drawing.contours import rim_contours
from lostmotion.drawing.measures import Row, drawing_table, shown
from lostmotion.errors import LostMotionError
from lostmotion.files import write_whole
from lostmotion.model import DesignModel
from lostmotion.report.gear_profiles import gear_profiles
from lostmotion.report.page import Block, PageTable, Section, render

NO_EZDXF = "DXF needs the package ezdxf: pip install 'lostmotion[dxf]'; --csv-only leaves it out"

LAYERS = {"flexspline": 5, "rigid": 8, "generator_seat": 1, "neutral_line_deformed": 3, "cam": 6}
"""AutoCAD colour index by layer."""


def curves_of(model: DesignModel) -> dict[str, FloatArray]:
    """Closed curves in mm by their name."""
    flexspline, rigid = gear_profiles(model)
    return {
        "flexspline": flexspline.outline(),
        "rigid": rigid.outline(),
        **rim_contours(model),
    }


def write_drawing(
    model: DesignModel, name: str, folder: Path, command: str, csv_only: bool = False
) -> list[Path]:
    """Write all files of a drawing to a new folder.

    Returns
    -------
    list of Path
        In the order in which they were written.
    """
    curves, table = curves_of(model), drawing_table(model)
    texts = {f"{curve}.csv": csv_of(points) for curve, points in curves.items()}
    texts["table.csv"] = csv_table(table)
    blocks: list[Block] = [page_table(table), deviation_table(model)]
    section = Section("Both gears", "Dimensions in mm.", blocks=blocks)
    lead = (
        "Undeformed, 20 degrees C. Measurements of the flexspline are in the free state, "
        "without wave generator."
    )
    texts["table.html"] = render(f"Drawing of {name}", lead, [section], command)
    drawing = None if csv_only else dxf_of(curves)
    folder.mkdir(parents=True)
    files = []
    for file, text in texts.items():
        write_whole(folder / file, text)
        files.append(folder / file)
    if drawing is not None:
        write_whole(folder / "profiles.dxf", drawing)
        files.append(folder / "profiles.dxf")
    return files


def csv_of(points: FloatArray) -> str:
    """Points of a closed curve, the first one not repeated."""
    return "x_mm,y_mm\n" + "".join(f"{x:.7f},{y:.7f}\n" for x, y in points)


def csv_table(table: list[Row]) -> str:
    """The drawing table as CSV."""
    lines = [
        f"{r.key},{r.meaning},{r.unit},{shown(r.flexspline, r.digits)},{shown(r.rigid, r.digits)}\n"
        for r in table
    ]
    return "symbol,quantity,unit,flexspline,rigid\n" + "".join(lines)


def page_table(table: list[Row]) -> PageTable:
    """The drawing table of a page."""
    return PageTable(
        "Gear data",
        ["symbol", "quantity", "unit", "flexspline", "rigid gear"],
        [
            [r.key, r.meaning, r.unit, shown(r.flexspline, r.digits), shown(r.rigid, r.digits)]
            for r in table
        ],
    )


def deviation_table(model: DesignModel) -> PageTable:
    """The toleranced features, with their deviations."""
    return PageTable(
        "Tolerances",
        ["feature", "zone", "lower um", "upper um"],
        [
            [str(t["name"]), str(t["zone"]), f"{t['lower_um']:.1f}", f"{t['upper_um']:.1f}"]
            for t in model.tolerance_budget()
        ],
    )


def dxf_of(curves: Mapping[str, FloatArray]) -> str:
    """A DXF of closed polylines in mm, one layer each.

    Raises
    ------
    LostMotionError
        Without ezdxf.
    """
    try:
        import ezdxf.document
        from ezdxf import units as drawing_units
    except ImportError:
        raise LostMotionError(NO_EZDXF) from None
    document = ezdxf.document.Drawing.new("AC1024")
    document.units = drawing_units.MM
    space = document.modelspace()
    for name, points in curves.items():
        document.layers.add(name, color=LAYERS[name])
        space.add_lwpolyline(points.tolist(), close=True, dxfattribs={"layer": name})
    stream = io.StringIO()
    document.write(stream)
    return stream.getvalue()
