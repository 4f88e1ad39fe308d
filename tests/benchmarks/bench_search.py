"""The design search against pymoo, SciPy and pygmo on the real model.

Several objectives: pymoo's NSGA-II; one objective also the differential evolution of each; pygmo
takes part if it is installed.

Every method gets the same evaluator, with the same sampled drives and all limits, and the same
number of evaluations; the seed is that of the method alone. NSGA-II and differential evolution call
the evaluator once for each. The search counts a plain evaluation as one, as it counts every point
that it screens, breeds or tries; a gradient counts as ``lm_slope_charge`` plain ones (8 for up to
eight variables beside the tolerance grades), and sixteen evaluations of other tolerances of an
evaluated design count as one; ``bench_search_cost.py`` measures the time of each. Arithmetic
without the model is free for all. The search's verification after the budget is left out, so no
method has its result refined. Every feasible point that a method evaluates counts for its front, so
nothing depends on how a method reports. With ``--delivered`` the fronts are those that a user can
have: the grades of tolerance are whole, and a design counts only if it passes the check on the fine
grid that every delivered design passes. The same code rounds and checks the fronts of the others.

    pip install ./bindings/python[benchmark]
    python tests/benchmarks/bench_search.py [BUILD] [--seeds N] [--first-seed N]
        [--evaluations 5000 20000 ...] [--spec NAME ...] [--objectives N ...]
        [--trade-off-only | --one-objective-only] [--delivered]

BUILD is a build folder with the static libraries, that of ``./dev`` unless it is given. A spec is
one of ``tests/data/specs`` or of ``specs`` beside this file; its trade-off is that of the first N
objectives, or of all. Prints one table a spec and problem.
Hypervolume: each objective runs from 0 at the best to 1 at the worst value on the front of all
points of all methods, seeds and budgets of the call; the corner is 1.1. *all together* is the
hypervolume of that front: no method can have more, so its ratio bounds what any could reach.
The line below a table states the range of each objective: if one design extends the front far, the
hypervolumes differ little.
"""

from __future__ import annotations

import argparse
import ctypes as c
import importlib.util
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).parents[2]
SPECS = (ROOT / "tests" / "data" / "specs", Path(__file__).parent / "specs")
BUILD = ROOT / "build"
FREE_MAX = 24
OBJECTIVE_MAX = 4
FRONT_MAX = 2048
RESULT_MAX = 4096
SOLUTION_MAX = 96 + 40
STAGE_VERIFY = 5
TASK_ROUND, TASK_CONFIRM = 7, 8
FIGURES = {
    "lost_motion": 0,
    "tolerance_lost_motion": 1,
    "stiffness": 2,
    "kinematic_error": 3,
    "stress": 4,
    "cost": 5,
}
# What the benchmark needs of the problem and Python cannot reach.
REACH = """\
#include <string.h>
#include "problem.h"
#include "run_task.h"
/* Runs a task without a solver from a design; copies its designs and returns their number. */
int run_plain_task(const lm_problem *problem, int kind, int combination, const double unit[],
                   lm_workspace *workspace, lm_solution found[]) {
  static lm_answer answer;
  lm_task task;
  memset(&task, 0, sizeof task);
  task.kind = kind;
  task.combination = combination;
  memcpy(task.unit, unit, sizeof task.unit);
  lm_scalarise_first(&task.scalar);
  if (lm_run_task(problem, &task, &answer, workspace, NULL) != LM_OK) { return 0; }
  memcpy(found, answer.solution, (size_t)answer.solution_count * sizeof found[0]);
  return answer.solution_count;
}
void set_search_seed(lm_problem *problem, unsigned int seed) { problem->seed = seed; }
double read_figure_max(const lm_problem *problem, int i) { return problem->bounds.figure_max[i]; }
"""
HEAD = """\
| evaluations | seeds | method | median | least | most | of NSGA-II | CPU s |
| --- | --- | --- | --- | --- | --- | --- | --- |"""
Vector = NDArray[np.float64]


class Found(c.Structure):
    """`lm_solution`."""

    _fields_ = [
        ("combination", c.c_int),
        ("verified", c.c_int),
        ("violation", c.c_double),
        ("unit", c.c_double * FREE_MAX),
        ("objective", c.c_double * OBJECTIVE_MAX),
    ]


class Layout(c.Structure):
    """`lm_layout`."""

    _fields_ = [
        ("figure_start", c.c_int * 6),
        ("figure_count", c.c_int * 6),
        ("single_start", c.c_int),
        ("gap_start", c.c_int),
        ("gap_count", c.c_int),
        ("count", c.c_int),
    ]


class Progress(c.Structure):
    """First fields of `lm_progress`, up to the charged evaluations."""

    _fields_ = [
        ("stage", c.c_int),
        ("has_best", c.c_int),
        ("best_combination", c.c_int),
        ("best_value", c.c_double),
        ("evaluations", c.c_int),
        ("more", c.c_int * 64),
    ]


def load(build: Path, *more: str) -> c.CDLL:
    """Link the static libraries, with more arguments for the compiler, into one for Python."""
    if not (build / "optimizer/liblostmotion_optimizer.a").exists():
        raise SystemExit(f"{build}: no static libraries there; ./dev test builds them")
    folder = Path(tempfile.mkdtemp())
    shared, reach = folder / "optimizer.so", folder / "reach.c"
    reach.write_text(REACH)
    subprocess.run(
        [
            *("cc", "-shared", "-fPIC", "-o", shared, reach),
            *("-I", ROOT / "optimizer", "-I", ROOT / "lib/include", "-Wl,--whole-archive"),
            *(build / "optimizer/liblostmotion_optimizer.a", build / "lib/liblostmotion.a"),
            *("-Wl,--no-whole-archive", *more, "-lnlopt", "-lm", "-lpthread"),
        ],
        check=True,
    )
    lib = c.CDLL(str(shared))
    lib.lm_create_workspace.restype = c.c_void_p
    lib.lm_open_search.restype = c.c_void_p
    lib.lm_open_pool.restype = c.c_void_p
    lib.lm_figure_of.restype = c.c_double
    lib.read_figure_max.restype = c.c_double
    lib.lm_violation_of.restype = c.c_double
    lib.lm_chosen_value.restype = c.c_double
    return lib


class Problem:
    """A spec as every method sees it: variables in the unit interval, then one for each choice."""

    def __init__(self, lib: c.CDLL, text: str) -> None:
        self.lib = lib
        self.memory = c.create_string_buffer(1 << 20)
        error = c.create_string_buffer(256)
        if lib.lm_read_spec(text.encode(), self.memory, error) != 0:
            raise ValueError(error.raw[4:].split(b"\0")[0].decode())
        words = [line.split("#")[0].split() for line in text.splitlines()]
        words = [w for w in words if w]
        self.ranges = sum(w[0] in ("range", "whole") for w in words)
        self.objectives = [FIGURES[w[1]] for w in words if w[0] == "objective"]
        self.combinations = lib.lm_count_combinations(self.memory)
        self.sizes = self._choice_sizes(words)
        self.workspace = c.c_void_p(lib.lm_create_workspace())
        self.scan = c.create_string_buffer(1 << 14)
        self.layout = Layout()
        lib.lm_default_scan(self.scan)
        lib.lm_lay_out(self.memory, self.scan, c.byref(self.layout))
        self.result = (c.c_double * RESULT_MAX)()
        self.variables = self.ranges + len(self.sizes)
        most = [(i, lib.read_figure_max(self.memory, i)) for i in FIGURES.values()]
        self.limited = [(i, value) for i, value in most if value > 0]
        self.limits = self.layout.gap_start - self.layout.single_start + 1 + len(self.limited)
        self.start()

    def _choice_sizes(self, words: list[list[str]]) -> list[int]:
        sizes = []
        for w in words:
            if w[0] == "choose":
                sizes.append(len(w) - 2)
            elif w[0] == "ratio":
                known = int(np.prod(sizes)) if sizes else 1
                others = [len(v) - 2 for v in words if v[0] == "choose"]
                rest = int(np.prod(others)) // known if others else 1
                sizes.append(self.combinations // known // rest)
        return sizes

    def start(self) -> None:
        """Forget all evaluations."""
        self.evaluations = 0
        self.points: list[Vector] = []
        self.designs: list[tuple[int, c.Array[c.c_double]]] = []

    def evaluate(self, x: Vector) -> tuple[Vector, Vector]:
        """Objectives and limits of a point, as `judge` gives them."""
        combination, factor = 0, 1
        for size, value in zip(self.sizes, x[self.ranges :], strict=True):
            combination += factor * min(int(value * size), size - 1)
            factor *= size
        return self.judge(combination, (c.c_double * FREE_MAX)(*np.clip(x[: self.ranges], 0, 1)))

    def judge(self, combination: int, unit: c.Array[c.c_double]) -> tuple[Vector, Vector]:
        """Objectives and limits (g <= 0) of a design.

        The limits: the single ones, the smallest gap, one for each limited figure.
        """
        self.evaluations += 1
        status = self.lib.lm_evaluate_point(
            self.memory, self.scan, c.byref(self.layout), combination, unit, self.result,
            self.workspace, None,
        )  # fmt: skip
        if status != 0:
            return np.full(len(self.objectives), 1e3), np.full(self.limits, 1e3)
        layout = c.byref(self.layout)
        f = np.array([self.lib.lm_figure_of(layout, self.result, j) for j in self.objectives])
        all_results = np.ctypeslib.as_array(self.result)
        single = all_results[self.layout.single_start : self.layout.gap_start]
        gaps = all_results[self.layout.gap_start :][: self.layout.gap_count]
        over = [self.lib.lm_figure_of(layout, self.result, i) / v - 1 for i, v in self.limited]
        g = np.array([*single, gaps.max(), *over])
        feasible = self.lib.lm_violation_of(self.memory, layout, self.result) <= 0
        if feasible != (g.max() <= 0):
            raise RuntimeError("the limits that a method sees are not those that count")
        if feasible:
            self.points.append(f)
            self.designs.append((combination, unit))
        return f, g

    def deliverable(self) -> list[Vector]:
        """Return the front of the designs evaluated so far, with whole grades, that are confirmed.

        As the search treats its own front before a solver works on it.
        """
        front = [self.designs[i] for i in front_places(self.points)]
        rounded = [one for at in front for one in self._run(TASK_ROUND, *at)]
        places = front_places([self._objectives(one) for one in rounded])
        kept = [(rounded[i].combination, rounded[i].unit) for i in places]
        confirmed = [one for at in kept for one in self._run(TASK_CONFIRM, *at)]
        return [self._objectives(one) for one in confirmed if one.verified]

    def _objectives(self, found: Found) -> Vector:
        return np.array(found.objective[: len(self.objectives)])

    def _run(self, kind: int, combination: int, unit: c.Array[c.c_double]) -> list[Found]:
        found = (Found * SOLUTION_MAX)()
        count = self.lib.run_plain_task(self.memory, kind, combination, unit, self.workspace, found)
        return list(found[:count])


def non_dominated(points: list[Vector]) -> Vector:
    """Points that no other point dominates, in rising order.

    To 1e-9 of each unit, as in the search: a kinematic error of 1e-12 arcsec is rounding.
    """
    every = np.unique(np.round(np.array(points), 9), axis=0)
    kept = np.empty_like(every)
    count = 0
    for point in every:
        if not (kept[:count] <= point).all(axis=1).any():
            kept[count] = point
            count += 1
    return kept[:count]


def front_places(points: list[Vector]) -> list[int]:
    """Places of the points that no other point dominates."""
    return [
        next(i for i, p in enumerate(points) if np.array_equal(np.round(p, 9), one))
        for one in (non_dominated(points) if points else [])
    ]


def hypervolume(points: list[Vector], front: Vector) -> float:
    """Volume that points dominate, relative to the ends of a front and with the corner at 1.1."""
    from pymoo.indicators.hv import HV

    if not points:
        return 0.0
    low, high = front.min(axis=0), front.max(axis=0)
    corner = np.full(front.shape[1], 1.1)
    return float(HV(ref_point=corner)((non_dominated(points) - low) / (high - low)))


def read_spec(name: str) -> str:
    """Return the optimizer's own text of a spec."""
    files = [folder / f"{name}.search" for folder in SPECS]
    found = [file for file in files if file.exists()]
    if not found:
        raise SystemExit(f"{name}: no such spec in {' or '.join(str(f.parent) for f in files)}")
    return found[0].read_text()


def keep_objectives(text: str, count: int) -> str:
    """Return a spec's text with only the first objectives."""
    lines = text.splitlines()
    dropped = [line for line in lines if line.startswith("objective")][count:]
    return "\n".join(line for line in lines if line not in dropped)


def restate(text: str, **numbers: int) -> str:
    """Return a spec's text with another number of evaluations and another seed."""
    kept = [w for w in text.splitlines() if not w.startswith(tuple(numbers))]
    return "\n".join([*kept, *(f"{key} {value}" for key, value in numbers.items())])


class Search:
    """The library's search of a problem with some threads, as a context manager."""

    def __init__(self, problem: Problem, workers: int) -> None:
        self.problem, self.workers, self.lib = problem, workers, problem.lib
        self.progress = Progress()

    def __enter__(self) -> Search:
        self.search = c.c_void_p(self.lib.lm_open_search(self.problem.memory))
        self.pool = c.c_void_p(self.lib.lm_open_pool(self.workers))
        return self

    def __exit__(self, *_: object) -> None:
        self.lib.lm_close_pool(self.pool)
        self.lib.lm_close_search(self.search)

    def run(
        self, clock: Callable[[], float] | None = None, verify: bool = False
    ) -> list[list[float]]:
        """Search up to the verification, which is not charged to the budget, or to its end.

        With a clock: returns the time of each task of each batch, valid for one thread.
        """
        lib, search, tasks = self.lib, self.search, c.c_void_p()
        taken: list[list[float]] = []
        began = 0.0

        def accept(_: int, answer: int) -> None:
            nonlocal began
            if clock:
                taken[-1].append(clock() - began)
            lib.lm_accept_answer(search, c.c_void_p(answer))
            began = clock() if clock else 0.0

        sink = c.CFUNCTYPE(None, c.c_void_p, c.c_void_p)(accept)
        while True:
            count = lib.lm_next_tasks(search, c.byref(tasks))
            lib.lm_read_progress(search, c.byref(self.progress))
            if count == 0 or (self.progress.stage >= STAGE_VERIFY and not verify):
                return taken
            taken.append([])
            began = clock() if clock else 0.0
            lib.lm_run_tasks(self.pool, self.problem.memory, tasks, count, None, sink, None, None)

    def read_front(self) -> list[Found]:
        """Designs of the front."""
        front = (Found * FRONT_MAX)()
        count = self.lib.lm_read_front(self.search, front, FRONT_MAX)
        return list(front[:count])


def run_search(
    lib: c.CDLL, text: str, evaluations: int, seed: int, verify: bool = False
) -> list[Vector]:
    """Run the library's search on one thread, with or without the verification."""
    problem = Problem(lib, restate(text, evaluations=evaluations))
    lib.set_search_seed(problem.memory, seed)
    with Search(problem, workers=1) as search:
        search.run(verify=verify)
        charged = search.progress.evaluations
        if not verify and charged > 1.02 * evaluations:
            raise RuntimeError(f"{charged} evaluations, more than the budget of {evaluations}")
        front = search.read_front()
    points = [np.array(one.objective[: len(problem.objectives)]) for one in front]
    if front:
        judged, _ = Problem(lib, text).judge(front[0].combination, front[0].unit)
        if not np.allclose(judged, points[0], rtol=1e-9, atol=1e-8):
            raise RuntimeError("the search had another evaluator than the other methods")
    return points


def run_nsga2(
    lib: c.CDLL, text: str, evaluations: int, seed: int, verify: bool = False
) -> list[Vector]:
    """Run pymoo's NSGA-II, population 100."""
    from pymoo.algorithms.moo.nsga2 import NSGA2

    return minimize_pymoo(Problem(lib, text), NSGA2(pop_size=100), evaluations, seed, verify)


def minimize_pymoo(
    problem: Problem, algorithm: Any, evaluations: int, seed: int, verify: bool
) -> list[Vector]:
    """Run an algorithm of pymoo, which knows objectives and limits separately."""
    from pymoo.core.problem import ElementwiseProblem
    from pymoo.optimize import minimize

    class Wrapped(ElementwiseProblem):
        def __init__(self) -> None:
            super().__init__(
                n_var=problem.variables, n_obj=len(problem.objectives),
                n_ieq_constr=problem.limits, xl=0.0, xu=1.0,
            )  # fmt: skip

        def _evaluate(self, x: Vector, out: dict[str, Vector], *_: object, **__: object) -> None:
            out["F"], out["G"] = problem.evaluate(x)

    minimize(Wrapped(), algorithm, ("n_eval", evaluations), seed=seed, verbose=False)
    return problem.deliverable() if verify else problem.points


def penalise(problem: Problem, x: Vector) -> float:
    """Objective of a point, or beyond every objective by its violations."""
    f, g = problem.evaluate(x)
    violation = np.maximum(g, 0).sum()
    return float(f[0]) if violation <= 0 else 100.0 + float(violation)


def run_differential_evolution(
    lib: c.CDLL, text: str, evaluations: int, seed: int, verify: bool = False
) -> list[Vector]:
    """Run scipy's differential evolution with an exact penalty, for one objective."""
    from scipy.optimize import differential_evolution

    problem = Problem(lib, text)

    def penalised(x: Vector) -> float:
        if problem.evaluations >= evaluations:
            return 1e6
        return penalise(problem, x)

    population = 15
    generations = evaluations // (population * problem.variables) + 1
    differential_evolution(
        penalised, [(0.0, 1.0)] * problem.variables, maxiter=generations, popsize=population,
        seed=seed, polish=False, tol=0,
    )  # fmt: skip
    return problem.deliverable() if verify else problem.points


def run_pymoo_evolution(
    lib: c.CDLL, text: str, evaluations: int, seed: int, verify: bool = False
) -> list[Vector]:
    """Run pymoo's differential evolution, population 100, for one objective."""
    from pymoo.algorithms.soo.nonconvex.de import DE

    return minimize_pymoo(Problem(lib, text), DE(pop_size=100), evaluations, seed, verify)


def run_pygmo(
    lib: c.CDLL, text: str, evaluations: int, seed: int, verify: bool = False
) -> list[Vector]:
    """Run pygmo's self-adaptive differential evolution with an exact penalty, for one objective."""
    import pygmo

    problem = Problem(lib, text)
    population = 50

    class Penalised:
        def fitness(self, x: Vector) -> list[float]:
            return [penalise(problem, x)]

        def get_bounds(self) -> tuple[list[float], list[float]]:
            return [0.0] * problem.variables, [1.0] * problem.variables

    method = pygmo.sade(gen=evaluations // population - 1, seed=seed, ftol=0, xtol=0)
    begun = pygmo.population(pygmo.problem(Penalised()), size=population, seed=seed)
    pygmo.algorithm(method).evolve(begun)
    return problem.deliverable() if verify else problem.points


METHODS: dict[str, Callable[[c.CDLL, str, int, int, bool], list[Vector]]] = {
    "lostmotion": run_search,
    "NSGA-II": run_nsga2,
}
ALONE = {
    "differential evolution, SciPy": run_differential_evolution,
    "differential evolution, pymoo": run_pymoo_evolution,
}
"""Methods for one objective."""
if importlib.util.find_spec("pygmo"):
    ALONE["differential evolution, pygmo"] = run_pygmo


Runs = dict[str, list[list[Vector]]]


def run_all(
    lib: c.CDLL, text: str, evaluations: int, seeds: range, verify: bool
) -> tuple[Runs, dict[str, float]]:
    """Points that each method finds with each seed, and the processor time of one run."""
    runs: Runs = {}
    seconds = {}
    for name, method in {**METHODS, **(ALONE if is_alone(text) else {})}.items():
        began = time.process_time()
        runs[name] = [method(lib, text, evaluations, seed, verify) for seed in seeds]
        seconds[name] = (time.process_time() - began) / len(seeds)
    return runs, seconds


def is_alone(text: str) -> bool:
    """Whether a spec has one objective."""
    return text.count("\nobjective") == 1


def compare(lib: c.CDLL, text: str, budgets: list[int], seeds: range, verify: bool) -> None:
    """Print the rows of a problem, all in one unit."""
    everything = {
        evaluations: run_all(lib, text, evaluations, seeds, verify) for evaluations in budgets
    }
    every_run = [run for runs, _ in everything.values() for each in runs.values() for run in each]
    front = non_dominated([point for run in every_run for point in run])
    for evaluations, (runs, seconds) in everything.items():
        if is_alone(text):
            scores = {
                name: [min((p[0] for p in points), default=np.inf) for points in each]
                for name, each in runs.items()
            }
        else:
            scores = {
                name: [hypervolume(points, front) for points in each] for name, each in runs.items()
            }
            scores["all together"] = [hypervolume(list(front), front)]
        other = float(np.median(scores["NSGA-II"]))
        for name, values in scores.items():
            middle = float(np.median(values))
            took = f"{seconds[name]:.1f}" if name in seconds else ""
            share = f"{middle / other:.3f}" if other > 0 else "-"
            print(
                f"| {evaluations} | {len(seeds)} | {name} | {middle:.4f} | {min(values):.4f} | "
                f"{max(values):.4f} | {share} | {took} |",
                flush=True,
            )
    if not is_alone(text):
        ends = zip(front.min(axis=0), front.max(axis=0), strict=True)
        print("\nunit:", ", ".join(f"{low:.4g} to {high:.4g}" for low, high in ends))


def main() -> None:
    """Read the arguments and print all tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("build", type=Path, nargs="?", default=BUILD)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--evaluations", type=int, nargs="+", default=[5000, 20000])
    parser.add_argument("--spec", nargs="+", default=["robot_joint"])
    parser.add_argument("--objectives", type=int, nargs="+", choices=(2, 3, 4), default=[4])
    parser.add_argument(
        "--delivered", action="store_true", help="count only designs that can be delivered"
    )
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--trade-off-only", action="store_true")
    which.add_argument("--one-objective-only", action="store_true")
    options = parser.parse_args()
    if importlib.util.find_spec("pymoo") is None:
        raise SystemExit(
            "pymoo is not installed: there is nothing to compare with "
            "(pip install ./bindings/python[benchmark])"
        )
    lib = load(options.build)
    seeds = range(options.first_seed, options.first_seed + options.seeds)
    for name in options.spec:
        text = read_spec(name)
        single = "\n".join(
            line
            for line in text.splitlines()
            if not line.startswith("objective") or "tolerance_lost_motion" in line
        )
        problems = []
        if not options.one_objective_only:
            for count in options.objectives:
                kept = keep_objectives(text, count)
                wanted = kept.count("\nobjective")
                problems.append((f"hypervolume of {wanted} objectives, more is better", kept))
        if not options.trade_off_only:
            problems.append(("best objective, less is better", single))
        for title, spec in problems:
            print(f"\n{name}, seeds from {seeds[0]}: {title}\n")
            print(HEAD)
            compare(lib, spec, options.evaluations, seeds, options.delivered)


if __name__ == "__main__":
    main()
