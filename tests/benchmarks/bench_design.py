"""Time of one complete design evaluation: the library against NumPy, plain and tuned.

One evaluation is the side clearances of both flanks at 8 tooth phases, the contributions at 33
torques and all checks. All three run in turn in the same process, on one thread; medians of the
processor time are compared, so that other work on the machine has little influence. The numbers of
the library and of plain_numpy agree to 2e-4 arcmin (test_plain_numpy.py).
"""

from __future__ import annotations

import argparse
import os
import platform
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import plain_numpy
import scipy
import tuned_numpy
from same_drive import library_drive, plain_design, tuned_design

from lostmotion import __version__
from lostmotion.core import Core, core

ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""NumPy reads them when it is loaded."""

DRIVES = ("reference_a", "external_ring")
PHASES = plain_numpy.PHASES
TORQUES = 33
BAR, AIM = 500, 1000
BATCH = 20


class Library:
    """One evaluation in C, piece by piece, in memory that is allocated once."""

    def __init__(self, c: Core, drive: Any, sections: int = 1) -> None:
        self.c, self.drive = c, drive
        drive.axial_sections = sections
        self.torque = c.array(
            np.linspace(-2 * drive.rated_torque_Nm, 2 * drive.rated_torque_Nm, TORQUES)
        )
        self.torque_pointer = c.pointer(self.torque)
        new = c.ffi.new
        self.workspace = new("lm_design_workspace *")
        self.capacity = 2 * (drive.teeth.flexspline_teeth * PHASES // 4) + 1
        self.swept = [new("lm_clearance[]", self.capacity) for _ in range(sections)]
        self.swept_pointers = new("lm_clearance *[]", self.swept)
        self.count = new("int *")
        self.smallest = new("lm_smallest_gap *")
        self.contributions = new("lm_contributions[]", TORQUES)
        self.state = new("lm_mesh_state *")
        self.checks = new("lm_check[]", c.lib.LM_CHECK_COUNT)
        self.fault = c.fault()

    def _done(self, status: int) -> None:
        self.c.check(status, self.fault)

    def meshes(self) -> None:
        """Make geometry and neutral lines."""
        lib = self.c.lib
        nodes = lib.LM_NEUTRAL_LINE_NODES
        self._done(lib.lm_prepare_meshes(self.drive, nodes, self.workspace, self.fault))

    def clearances(self) -> None:
        """Compute both flanks of every tooth and section at all phases."""
        lib, ffi = self.c.lib, self.c.ffi
        for section, swept in enumerate(self.swept):
            mesh = ffi.addressof(self.workspace.meshes, section)
            self._done(
                lib.lm_sweep_clearances(mesh, PHASES, swept, self.capacity, self.count, self.fault)
            )

    def smallest_gap(self) -> None:
        """Find the smallest gap among them and between the phases."""
        self._done(
            self.c.lib.lm_refine_smallest_gap(
                self.workspace.meshes,
                len(self.swept),
                self.swept_pointers,
                self.count[0],
                PHASES,
                self.smallest,
                self.fault,
            )
        )

    def characteristic(self) -> None:
        """Compute the loaded mesh at all torques."""
        self._done(
            self.c.lib.lm_evaluate_torsion_curve(
                self.drive,
                0.0,
                self.torque_pointer,
                TORQUES,
                self.contributions,
                self.state,
                self.workspace,
                self.fault,
            )
        )

    def check(self) -> None:
        """Check the design."""
        self._done(
            self.c.lib.lm_check_design(
                self.drive,
                self.workspace.meshes,
                self.drive.axial_sections,
                self.smallest,
                self.checks,
                self.fault,
            )
        )

    def pieces(self) -> dict[str, Callable[[], None]]:
        """Return the parts of an evaluation by name."""
        return {
            "geometry and neutral line": self.meshes,
            f"clearances at {PHASES} phases": self.clearances,
            "smallest gap": self.smallest_gap,
            f"contributions at {TORQUES} torques": self.characteristic,
            "checks": self.check,
        }

    def evaluate(self) -> None:
        """Do all of it."""
        for piece in self.pieces().values():
            piece()


def spent(call: Callable[[], object], times: int = 1) -> float:
    """Processor time of one call, s, over a batch."""
    start = time.process_time()
    for _ in range(times):
        call()
    return (time.process_time() - start) / times


def interleaved(
    calls: dict[str, tuple[Callable[[], object], int]], rounds: int
) -> dict[str, float]:
    """Median time of each call, s; each round runs every call once (in batches)."""
    taken: dict[str, list[float]] = {name: [] for name in calls}
    for call, _ in calls.values():
        call()
    for _ in range(rounds):
        for name, (call, batch) in calls.items():
            taken[name].append(spent(call, batch))
    return {name: float(np.median(times)) for name, times in taken.items()}


def machine() -> str:
    """Name the processor."""
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def show(head: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table; the first column to the left."""
    widths = [max(len(row[i]) for row in (head, *rows)) for i in range(len(head))]
    for row in (head, *rows):
        cells = [row[0].ljust(widths[0])]
        cells += [cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True)]
        print("  ".join(cells))


def verdict(ratio: float) -> str:
    """Describe whether a ratio reaches the bar and the aim."""
    if ratio >= AIM:
        return f"reaches the aim of {AIM}x"
    if ratio >= BAR:
        return f"reaches the bar of {BAR}x, not the aim of {AIM}x"
    return f"does NOT reach the bar of {BAR}x"


def whole_evaluation(name: str, rounds: int) -> dict[str, float]:
    """Time the three implementations on one drive."""
    c = core(64)
    library = Library(c, library_drive(name, c))
    single = Library(core(32), library_drive(name, core(32)))
    plain = plain_design(library.drive, c)
    tuned = tuned_design(library.drive, c)
    times = interleaved(
        {
            "C, float64": (library.evaluate, BATCH),
            "C, float32": (single.evaluate, BATCH),
            "NumPy, plain": (lambda: plain_numpy.evaluate(plain, library.torque), 1),
            "NumPy, tuned": (lambda: tuned_numpy.evaluate(tuned), 2),
        },
        rounds,
    )
    base = times["C, float64"]
    print(f"\n{name}: one whole evaluation ({library.state.pairs} candidate pairs)")
    show(
        ("", "ms", "times C"),
        [(what, f"{1e3 * t:.3f}", f"{t / base:.1f}") for what, t in times.items()],
    )
    return {what: t / base for what, t in times.items()}


def costs(name: str, rounds: int) -> None:
    """Print where the library's time goes, and what a tooth and a section cost."""
    c = core(64)
    library = Library(c, library_drive(name, c))
    library.evaluate()
    pieces = interleaved({n: (p, BATCH) for n, p in library.pieces().items()}, rounds)
    total = sum(pieces.values())
    print(f"\n{name}: where the time goes (C, float64)")
    show(
        ("", "us", "share"),
        [(n, f"{1e6 * t:.1f}", f"{100 * t / total:.0f} %") for n, t in pieces.items()],
    )
    per_tooth = pieces[f"clearances at {PHASES} phases"] / library.count[0]
    print(f"a tooth, both flanks: {1e9 * per_tooth:.0f} ns")
    sections = [1, 3, 5, 7]
    models = {n: Library(c, library_drive(name, c), n) for n in sections}
    spatial = interleaved(
        {f"{n}": (model.evaluate, BATCH // 2) for n, model in models.items()}, rounds
    )
    show(
        ("axial sections", *spatial),
        [("us", *(f"{1e6 * t:.0f}" for t in spatial.values()))],
    )
    slope = (spatial["7"] - spatial["1"]) / 6
    print(f"a further axial section: {1e6 * slope:.0f} us")


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=15, help="turns of all versions")
    rounds = parser.parse_args().rounds
    print(
        f"{machine()}; lostmotion {__version__}, Python {platform.python_version()}, "
        f"NumPy {np.__version__}, SciPy {scipy.__version__}"
    )
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0
    print(f"medians of {rounds} turns, processor time of one thread; load of machine {load:.1f}")
    ratios = {name: whole_evaluation(name, rounds) for name in DRIVES}
    costs(DRIVES[0], rounds)
    print()
    for kind in ("plain", "tuned"):
        least = min(ratio[f"NumPy, {kind}"] for ratio in ratios.values())
        print(f"against {kind} NumPy: {least:.0f}x at least: {verdict(least)}")


if __name__ == "__main__":
    if any(os.environ.get(name) != value for name, value in ONE_THREAD.items()):
        os.execve(sys.executable, [sys.executable, *sys.argv], {**os.environ, **ONE_THREAD})
    main()
