"""The same joint with three tooth profiles: the specs of docs/profiles.md with a larger budget.

    python tests/benchmarks/bench_flanks.py [--evaluations N] [--write]

Prints the table of the page, and the evaluations of each search per second of processor time:
start designs, pruning and the check of the answer belong to it, the report does not. `--write` puts
the table into the page and draws the picture of the page.
"""

from __future__ import annotations

import argparse
import re
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import lostmotion as lm
from lostmotion.design import running
from lostmotion.design.spec import read_spec
from lostmotion.drives import Drive, read_drive
from lostmotion.model import DesignModel
from lostmotion.report.mesh import first_touches, make_mesh
from lostmotion.report.svg import Drawing
from lostmotion.report.teeth import View, draw_view

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "docs"))
import blocks  # noqa: E402

PAGE = ROOT / "bindings/python/docs/profiles.md"
PICTURE = PAGE.parent / "pictures/flanks.svg"
PROFILES = {"involute": "involute", "double_arc": "double arc", "s_tooth": "S tooth"}
SEEDS = (1, 2)
PANEL_PX = (300.0, 230.0)
PITCHES = 3.2
"""Width of a panel of the picture."""


class TimedRun(running._Run):
    """A search with the processor time of its tasks."""

    seconds = 0.0

    def work_here(self, workers: int, stop: threading.Event | None) -> int:
        began = time.process_time()
        status = super().work_here(workers, stop)
        self.seconds = time.process_time() - began
        return status


def search(flank: str, evaluations: int, folder: Path) -> Drive:
    """Return the best drive of all seeds."""
    files = {block.caption: block.code for block in blocks.read_blocks(PAGE)}
    spec = files["joint.toml"] + files[f"{flank}.part"]
    spec = re.sub(r"^evaluations = .*", f"evaluations = {evaluations}", spec, flags=re.MULTILINE)
    found, seconds = [], 0.0
    for seed in SEEDS:
        text = re.sub(r"^seed = .*", f"seed = {seed}", spec, flags=re.MULTILINE)
        path = folder / f"{flank}_{seed}.toml"
        path.write_text(text, encoding="utf-8")
        with TimedRun(read_spec(path), folder / f"{flank}_{seed}", False, None) as run:
            run.work(1, None, None, None)
        seconds += run.seconds
        found.append(read_drive(folder / f"{flank}_{seed}" / "best.toml"))
    rate = len(SEEDS) * evaluations / seconds
    print(f"{PROFILES[flank]}: {rate:.0f} evaluations per second of processor time", flush=True)
    return min(found, key=lambda drive: float(at_rated(drive)["reversal_lost_motion_arcmin"]))


def at_rated(drive: Drive) -> dict[str, Any]:
    """Predict one torque, the rated one."""
    return lm.predict(drive, [drive.rated_torque_Nm])


def row(flank: str, drive: Drive) -> str:
    """One line of the table."""
    told = at_rated(drive)
    safety = next(c["value"] for c in told["checks"] if c["name"] == "safety_factor")
    cells = (
        PROFILES[flank],
        f"{told['reversal_lost_motion_arcmin']:.3f}",
        f"{told['stiffness_Nm_per_rad'][0]:.0f}",
        f"{2 * told['engaged_teeth_per_lobe'][0]}",
        f"{safety:.2f}",
    )
    return f"| {' | '.join(cells)} |"


def draw(drives: dict[str, Drive]) -> str:
    """Draw the teeth of each drive at the deformation axis."""
    width, height = PANEL_PX
    picture = Drawing(
        len(drives) * (width + 14) + 14, height + 50, "Teeth of three profiles in mesh, to scale"
    )
    for i, (flank, drive) in enumerate(drives.items()):
        model = DesignModel(drive.design)
        mesh = make_mesh(model)
        geometry = mesh.geometry
        middle = (geometry.flexspline_tip_mm + geometry.neutral_mm) / 2 + 0.6 * geometry.module_mm
        scale = width / (PITCHES * 3.1416 * geometry.module_mm)
        view = View((14 + i * (width + 14), 36.0, width, height), scale, 0.0, middle)
        draw_view(picture, mesh, first_touches(model, []), view, PROFILES[flank])
    return picture.render()


def main() -> None:
    """Search, print, and write the page on request."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--evaluations", type=int, default=3_000)
    parser.add_argument("--write", action="store_true", help="write the page and the picture")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        drives = {f: search(f, arguments.evaluations, Path(folder)) for f in PROFILES}
    head = (
        "| flank | reversal lost motion at ±1.6 Nm, arcmin | tangent stiffness at 40 Nm, Nm/rad "
        "| pairs that carry at 40 Nm | safety factor |"
    )
    table = "\n".join([head, "|---|---|---|---|---|", *(row(f, d) for f, d in drives.items())])
    print(table)
    if arguments.write:
        text = PAGE.read_text(encoding="utf-8")
        marked = re.compile(r"(<!-- bench_flanks -->\n).*?(<!-- /bench_flanks -->)", re.DOTALL)
        PAGE.write_text(marked.sub(rf"\g<1>\n{table}\n\n\g<2>", text), encoding="utf-8")
        PICTURE.write_text(draw(drives), encoding="utf-8")


if __name__ == "__main__":
    main()
