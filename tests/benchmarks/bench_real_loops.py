"""Real loops: fitted at one amplitude, the other amplitudes predicted, compared with plain models.

    python tests/benchmarks/bench_real_loops.py [CYCLOIDAL.csv ...]

The recordings are those of `tests/data` with loops of more than one amplitude, and further ones of
the printed cycloidal reducer in the same format. `lostmotion compare --fit-on` is compared with
three models of seven or eight numbers, each the best of several starts of
`scipy.optimize.least_squares`, and with a table of the mean curve by direction. None of them uses
the library. All errors are without the mean of each run. Last, the effects that `lostmotion
diagnose` finds missing on the whole recording, if any, are added, and the same runs predicted
again.
"""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from lostmotion import cli
from lostmotion.compare import compare
from lostmotion.drives import Drive, read_drive
from lostmotion.effects.conditions import Conditions
from lostmotion.effects.library import library
from lostmotion.fit.baseline import BaselineModel
from lostmotion.fit.terms import Term
from lostmotion.model import make_torsion_curve
from lostmotion.recordings import Campaign, read_campaign

DATA = Path(__file__).resolve().parents[1] / "data"
CYCLOIDAL = DATA / "cycloidal_locked_output"
DAMPER = DATA / "friction_damper"

Array = NDArray[np.float64]
Model = Callable[[Array, Array], Array]

ARCMIN = np.pi / 10800
STARTS = 4
BINS = 24


@dataclass(frozen=True)
class Loops:
    """A recording, with its runs by amplitude."""

    name: str
    drive: Path
    file: Path
    large: tuple[str, ...]
    small: tuple[str, ...]


def recordings(more: list[str]) -> list[Loops]:
    """Those in the repository, then those of the command line."""
    files = [CYCLOIDAL / "base_onyx_runin5.csv", *map(Path, more)]
    cycloidal = [
        Loops(
            f"cycloidal, {file.name}", CYCLOIDAL / "drive.toml", file,
            ("100", "101", "102"), ("0", "1", "2", "3", "4"),
        )
        for file in files
    ]  # fmt: skip
    sizes = ("amplitude_1.5",), ("amplitude_0.5", "amplitude_1")
    return [*cycloidal, Loops("damper", DAMPER / "drive.toml", DAMPER / "loops.csv", *sizes)]


# --- plain models: torque as rows, a set of parameters as columns --------------------------------


def spring(wound: Array, p: Array) -> Array:
    """Gap and two slopes: gap, its torque, slope, slope above the knee, knee."""
    size = np.abs(wound)
    slopes = p[2] * np.minimum(size, p[4]) + p[3] * np.maximum(size - p[4], 0)
    return np.asarray(np.sign(wound) * (p[0] * np.tanh(size / p[1]) + slopes))


def with_play(torque: Array, p: Array) -> Array:
    """Friction p[0] + p[1] |T|, of which a share p[2] acts in parallel with the spring."""
    wound = np.empty((torque.size, p.shape[1]))
    state = np.zeros(p.shape[1])
    for row, now in enumerate(torque):
        width = p[0] + p[1] * abs(now)
        state = np.clip(state, now - width, now + width)
        wound[row] = now - p[2] * (now - state)
    return spring(wound, p[3:])


def without_growth(torque: Array, p: Array) -> Array:
    """Coulomb friction, gap and spring."""
    return with_play(torque, np.insert(p, 1, 0.0, axis=0))


def bouc_wen(torque: Array, p: Array) -> Array:
    """Friction p[0] z in parallel with the spring; z follows the torque as Bouc and Wen have it."""
    wound = np.empty((torque.size, p.shape[1]))
    z = np.zeros(p.shape[1])
    before = torque[0]
    for row, now in enumerate(torque):
        parts = 1 + int(abs(now - before) / (0.2 * np.min(p[1])))
        step = (now - before) / parts / p[1]
        for _ in range(parts):
            z = z + step * (1 - np.abs(z) ** p[2] * (step * z > 0))
            z = np.clip(z, -1, 1)
        before = now
        wound[row] = now - p[0] * z
    return spring(wound, p[3:])


def plain_models(rated: float, angle: float) -> dict[str, tuple[Model, Array]]:
    """Models with the upper bounds of their numbers."""
    springs = [angle, 0.3 * rated, 5 * angle / rated, 5 * angle / rated, rated]
    return {
        "Coulomb, gap, spring": (without_growth, np.array([0.5 * rated, 1.0, *springs])),
        "growing with load": (with_play, np.array([0.5 * rated, 0.9, 1.0, *springs])),
        "Bouc-Wen": (bouc_wen, np.array([0.8 * rated, rated, 3.0, *springs])),
    }


@dataclass
class Rows:
    """Rows of some runs."""

    torque: list[Array]
    turned: list[Array]

    def errors(self, model: Model, p: Array) -> Array:
        """Measured minus model without the mean of each run, for each set of parameters."""
        parts = []
        for torque, turned in zip(self.torque, self.turned, strict=True):
            error = turned[:, None] - model(torque, p)
            parts.append(error - error.mean(axis=0))
        return np.concatenate(parts)


def rms(error: Array) -> float:
    return float(np.sqrt(np.mean(error**2)))


def fitted_numbers(rows: Rows, model: Model, high: Array) -> Array:
    """Fit from several starts; the numbers of the best."""
    low = 1e-3 * high
    random = np.random.default_rng(1)
    best: tuple[float, Array] = (np.inf, high)

    def residual(x: Array) -> Array:
        return rows.errors(model, x[:, None])[:, 0]

    def slopes(x: Array) -> Array:
        steps = np.where(x + 1e-4 * high < high, 1e-4, -1e-4) * high
        points = np.column_stack([x, x[:, None] + np.diag(steps)])
        errors = rows.errors(model, points)
        return np.asarray((errors[:, 1:] - errors[:, :1]) / steps)

    for _ in range(STARTS):
        start = low + (high - low) * random.uniform(0.05, 0.6, high.size)
        fit = least_squares(residual, start, slopes, bounds=(low, high), x_scale=high, max_nfev=60)
        if fit.cost < best[0]:
            best = (float(fit.cost), np.asarray(fit.x))
    return best[1]


def table_of(rows: Rows) -> Model:
    """Mean curve by torque and direction."""
    lines = []
    for torque, turned in zip(rows.torque, rows.turned, strict=True):
        lines.append(np.column_stack([torque, turned - turned.mean(), rising(torque)]))
    every = np.concatenate(lines)
    edges = np.linspace(every[:, 0].min(), every[:, 0].max(), BINS + 1)
    curves = {}
    for way in (False, True):
        chosen = every[every[:, 2] == way]
        place = np.clip(np.digitize(chosen[:, 0], edges) - 1, 0, BINS - 1)
        taken = np.unique(place)
        at, angle = (
            [float(chosen[place == one, column].mean()) for one in taken] for column in (0, 1)
        )
        curves[way] = (at, angle)

    def model(torque: Array, p: Array) -> Array:
        del p
        up, down = (np.interp(torque, *curves[way]) for way in (True, False))
        return np.asarray(np.where(rising(torque), up, down)[:, None])

    return model


def rising(torque: Array) -> NDArray[np.bool_]:
    """Whether the torque rises, over a hundredth of the run on either side."""
    reach = max(1, torque.size // 100)
    place = np.arange(torque.size)
    ahead, behind = np.minimum(place + reach, torque.size - 1), np.maximum(place - reach, 0)
    return np.asarray(torque[ahead] > torque[behind])


# --- the library ---------------------------------------------------------------------------------


def answer_of(words: list[str]) -> dict[str, object]:
    """JSON answer of a command."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "answer.json"
        if cli.main([*words, "--json", str(out), "--quiet"]) != 0:
            raise RuntimeError(" ".join(words))
        return dict(json.loads(out.read_text()))


def predicted(loops: Loops, fit_on: tuple[str, ...]) -> tuple[float, str]:
    """Error of the runs that are not fitted, in arcmin, and the friction that was selected."""
    words = ["compare", str(loops.drive), str(loops.file), "--fit-on", ",".join(fit_on)]
    answer = answer_of(words)
    return float(str(answer["heldout_rms_arcsec"])) / 60, str(answer["friction"])


def with_effects(
    drive: Drive, campaign: Campaign, effects: list[str], fit_on: tuple[str, ...]
) -> float:
    """Predict the other runs with these effects in the model: error in arcmin."""
    curve = make_torsion_curve(drive, float(np.max(np.abs(campaign.column("torque")))))
    base = BaselineModel(Conditions(campaign), drive.rated_torque_Nm, curve)
    base.terms = [
        Term(library()[name], library()[name].typical, library()[name].free()) for name in effects
    ]
    labels = [run.label for run in campaign.runs if str(run.label) in fit_on]
    return compare(curve, campaign, base=base, fit_on=labels).heldout_rms_rad / ARCMIN


def rows_of(campaign: Campaign, labels: tuple[str, ...]) -> Rows:
    runs = [run for run in campaign.runs if str(run.label) in labels]
    return Rows(
        [run.columns["torque"] for run in runs],
        [run.columns["lost_motion"] / ARCMIN for run in runs],
    )


def print_loops(loops: Loops) -> None:
    """Print the table of a recording."""
    drive = read_drive(loops.drive)
    campaign = read_campaign(loops.file, ratio=drive.ratio, mapping=drive.columns)
    angle = float(np.ptp(campaign.column("lost_motion"))) / ARCMIN
    print(f"\n{loops.name}: error of the predicted runs, arcmin (of the fitted ones)")
    for name, fit_on, other in (
        ("large fitted", loops.large, loops.small),
        ("small fitted", loops.small, loops.large),
    ):
        inside, outside = rows_of(campaign, fit_on), rows_of(campaign, other)
        found: dict[str, float] = {}
        for title, (model, high) in plain_models(drive.rated_torque_Nm, angle).items():
            p = fitted_numbers(inside, model, high)[:, None]
            found[title] = rms(outside.errors(model, p))
            print(f"  {name}  {title:22s} {found[title]:8.2f} ({rms(inside.errors(model, p)):.2f})")
        table = table_of(inside)
        none = np.zeros((0, 1))
        found["table"] = rms(outside.errors(table, none))
        print(
            f"  {name}  {'table':22s} {found['table']:8.2f} ({rms(inside.errors(table, none)):.2f})"
        )
        ours, friction = predicted(loops, fit_on)
        best = min(found.values())
        print(
            f"  {name}  {'lostmotion':22s} {ours:8.2f}  {ours / best:.2f} of the best, {friction}"
        )
    answer = answer_of(["diagnose", str(loops.drive), str(loops.file)])
    rungs: list[dict[str, object]] = answer["ladder"]  # type: ignore[assignment]
    effects = [str(r["effect"]) for r in rungs if r.get("verdict") == "missing-effect"]
    print(
        f"  diagnose: {answer['verdict']}, missing for certain: {', '.join(effects) or 'nothing'}"
    )
    if effects:
        for fit_on in (loops.large, loops.small):
            plain, added = (with_effects(drive, campaign, e, fit_on) for e in ([], effects))
            print(f"    fitted on {','.join(fit_on)}: {plain:.2f} without, {added:.2f} with")


def main() -> None:
    """Print all tables."""
    for loops in recordings(sys.argv[1:]):
        print_loops(loops)


if __name__ == "__main__":
    main()
