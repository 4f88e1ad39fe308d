"""Cost of the design search: a gradient, an evaluation of other tolerances, the search, two cores.

    python tests/benchmarks/bench_search_cost.py [BUILD] [--spec NAME ...] [--evaluations N]
        [--repeats N]

BUILD is a build folder with the static libraries, that of ``./dev`` unless it is given. Prints one
row a spec, in about a minute:

- *model*: CPU time of one plain evaluation; *gradient*: of one with all derivatives, in plain ones;
  *look*: of the same design with other tolerances, in plain ones.
- *overhead*: CPU time of a whole search on one thread minus that within the model, for each
evaluation; a look counts as it is charged. The linker puts a clock around the functions that
evaluate; the time of the clock itself is measured with an empty model and subtracted.
- *two cores*: ratio of the wall times on one thread and on two, measured in pairs; the median of
the pairs and the best one. Only an idle machine with two cores shows the full ratio: *machine* is
the throughput of two independent processes relative to one, *busy* the load of the machine.
- *tasks*: the same from the CPU time of each task on one thread: the sum of all relative to the
time of two threads that process the tasks of a batch in order and wait for each other at its end.
It does not depend on other processes. *CPU* is the ratio of the best CPU times on one thread and on
two: the loss by shared memory.

Each other figure is the best of the repeats.
"""

from __future__ import annotations

import argparse
import ctypes as c
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from bench_search import (
    BUILD,
    FREE_MAX,
    RESULT_MAX,
    ROOT,
    Problem,
    Search,
    load,
    read_spec,
    restate,
)

POINTS = 40
LOOKS = 2000
CLOCK_PAIRS = 100_000
CLOCK = r"""
#define _POSIX_C_SOURCE 200809L
#include <time.h>
#include "points.h"
static double spent;
static double evaluations;
static long calls;
static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}
void start_clock(void) {
  spent = 0;
  evaluations = 0;
  calls = 0;
}
double clock_seconds(long pairs) {
  const double began = now();
  double within = 0;
  long i;
  for (i = 0; i < pairs; i++) {
    const double here = now();
    within += now() - here;
  }
  return (now() - began - within) / (double)pairs;
}
double model_seconds(void) { return spent; }
long model_calls(void) { return calls; }
double model_evaluations(void) { return evaluations; }
#define CLOCKED(name, counted, declared, passed) \
  lm_status __real_##name declared;              \
  lm_status __wrap_##name declared;              \
  lm_status __wrap_##name declared {             \
    const double began = now();                  \
    const lm_status status = __real_##name passed; \
    spent += now() - began;                      \
    calls++;                                     \
    evaluations += counted;                      \
    return status;                               \
  }
CLOCKED(lm_evaluate_point, 1,
        (const lm_problem *p, const lm_scan *s, const lm_layout *l, int combination,
         const double unit[], double result[], lm_workspace *w, lm_fault *f),
        (p, s, l, combination, unit, result, w, f))
CLOCKED(lm_evaluate_slopes, 1,
        (const lm_problem *p, const lm_scan *s, const lm_layout *l, int combination,
         const double unit[], double result[], double slope[], lm_workspace *w, lm_fault *f),
        (p, s, l, combination, unit, result, slope, w, f))
CLOCKED(lm_evaluate_tolerances, 1.0 / LM_LOOKS_CHARGED,
        (const lm_problem *p, const lm_layout *l, int combination, const double unit[],
         double result[], lm_workspace *w, lm_fault *f),
        (p, l, combination, unit, result, w, f))
"""
"""Valid for one thread only."""
HEAD = """\
| spec | model, µs | gradient, plain ones | look, plain ones | overhead, µs | two cores | best \
| machine | tasks | CPU | busy |
| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"""


def time_model(lib: c.CDLL, text: str, repeats: int) -> tuple[float, float, float]:
    """Seconds of a plain evaluation, a gradient and a look, best of the repeats, same points."""
    problem = Problem(lib, text)
    drawn = np.random.default_rng(1).uniform(0.2, 0.8, (POINTS, problem.ranges))
    units = [(c.c_double * FREE_MAX)(*row) for row in drawn]
    slope = (c.c_double * (RESULT_MAX * FREE_MAX))()
    common = problem.memory, problem.scan, c.byref(problem.layout), 0
    plain, slopes, looks = [], [], []
    for _ in range(repeats):
        began = time.process_time()
        for unit in units:
            lib.lm_evaluate_point(*common, unit, problem.result, problem.workspace, None)
        middle = time.process_time()
        for unit in units:
            lib.lm_evaluate_slopes(*common, unit, problem.result, slope, problem.workspace, None)
        plain.append(middle - began)
        slopes.append(time.process_time() - middle)
        looks.append(time_look(lib, problem, units[0]))
    return min(plain) / POINTS, min(slopes) / POINTS, min(looks)


def time_look(lib: c.CDLL, problem: Problem, unit: c.Array[c.c_double]) -> float:
    """Seconds of a look at other tolerances of one design."""
    lib.lm_evaluate_point(
        problem.memory, problem.scan, c.byref(problem.layout), 0, unit, problem.result,
        problem.workspace, None,
    )  # fmt: skip
    began = time.process_time()
    for _ in range(LOOKS):
        lib.lm_evaluate_tolerances(
            problem.memory, c.byref(problem.layout), 0, unit, problem.result, problem.workspace,
            None,
        )  # fmt: skip
    return (time.process_time() - began) / LOOKS


def time_search(lib: c.CDLL, text: str, evaluations: int, workers: int) -> tuple[float, float]:
    """Wall and CPU seconds of a search up to its verification."""
    with Search(Problem(lib, restate(text, evaluations=evaluations)), workers) as search:
        wall, cpu = time.perf_counter(), time.process_time()
        search.run()
        return time.perf_counter() - wall, time.process_time() - cpu


def load_clocked(build: Path) -> c.CDLL:
    """Load the libraries with a clock around the model."""
    with tempfile.TemporaryDirectory() as place:
        source = Path(place) / "clock.c"
        source.write_text(CLOCK)
        lib = load(
            build, str(source), f"-I{ROOT / 'optimizer'}", f"-I{ROOT / 'lib/include'}",
            "-Wl,--wrap=lm_evaluate_point", "-Wl,--wrap=lm_evaluate_slopes",
            "-Wl,--wrap=lm_evaluate_tolerances",
        )  # fmt: skip
    lib.model_seconds.restype = c.c_double
    lib.model_calls.restype = c.c_long
    lib.model_evaluations.restype = c.c_double
    lib.clock_seconds.restype = c.c_double
    return lib


def time_overhead(lib: c.CDLL, text: str, budget: int) -> float:
    """CPU seconds outside the model for each evaluation, without the clock's own time."""
    lib.start_clock()
    _, cpu = time_search(lib, text, budget, 1)
    clock = lib.clock_seconds(CLOCK_PAIRS) * lib.model_calls()
    return float((cpu - lib.model_seconds() - clock) / lib.model_evaluations())


def compare_threads(
    lib: c.CDLL, text: str, evaluations: int, repeats: int
) -> tuple[float, float, float]:
    """Speed of two threads relative to one: median pair, best pair, and ratio of CPU times."""
    times = np.array(
        [
            [time_search(lib, text, evaluations, workers) for workers in (1, 2)]
            for _ in range(repeats)
        ]
    )
    pairs = times[:, 0, 0] / times[:, 1, 0]
    cpu = times[:, 0, 1].min() / times[:, 1, 1].min()
    return float(np.median(pairs)), float(pairs.max()), float(cpu)


def try_machine() -> float:
    """Throughput of two simultaneous processes relative to one."""
    busy = [sys.executable, "-c", "sum(range(30_000_000))"]

    def time_processes(count: int) -> float:
        began = time.perf_counter()
        for process in [subprocess.Popen(busy) for _ in range(count)]:
            process.wait()
        return time.perf_counter() - began

    return 2 * time_processes(1) / time_processes(2)


def share_tasks(lib: c.CDLL, text: str, evaluations: int) -> float:
    """Speed of two threads relative to one if only the tasks take time."""
    with Search(Problem(lib, restate(text, evaluations=evaluations)), 1) as search:
        batches = search.run(time.process_time)
    shared = 0.0
    for batch in batches:
        busy = [0.0, 0.0]
        for taken in batch:
            busy[busy.index(min(busy))] += taken
        shared += max(busy)
    return sum(map(sum, batches)) / shared


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("build", type=Path, nargs="?", default=BUILD)
    parser.add_argument(
        "--spec", nargs="+", default=["robot_joint", "ring_generator", "instrument"]
    )
    parser.add_argument("--evaluations", type=int, default=5000)
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    lib, clocked = load(options.build), load_clocked(options.build)
    repeats = range(options.repeats)
    print(HEAD)
    for name in options.spec:
        text = read_spec(name)
        plain, slopes, look = time_model(lib, text, options.repeats)
        overhead = min(time_overhead(clocked, text, options.evaluations) for _ in repeats)
        wall, best, cpu = compare_threads(lib, text, options.evaluations, options.repeats)
        tasks = share_tasks(lib, text, options.evaluations)
        print(
            f"| {name} | {1e6 * plain:.0f} | {slopes / plain:.1f} | {look / plain:.3f} | "
            f"{1e6 * overhead:.1f} | {wall:.2f} | {best:.2f} | {try_machine():.2f} | "
            f"{tasks:.2f} | {cpu:.2f} | {os.getloadavg()[0]:.1f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
