"""The command ``lostmotion design``."""

from __future__ import annotations

import argparse
import contextlib
import json
import sys
from collections.abc import Callable, Iterator
from typing import Any

from lostmotion.cluster import connect
from lostmotion.design.ends import at_ends
from lostmotion.design.engine import engine
from lostmotion.design.result import SearchResult, margin_unit, relaxation, rounded_up
from lostmotion.design.running import search
from lostmotion.design.spec import read_spec
from lostmotion.errors import InputError, LostMotionError, one_line
from lostmotion.options import whole_number
from lostmotion.terminal import deliver, show_list, show_table

BAR_WIDTH = 20
"""Width of the progress bar in characters."""

FRONT_ROWS = 12
"""Largest number of designs of the front that are printed."""

APART = 0.1
"""Relative difference of an objective between fine check and search that is not reported."""


def run_design(arguments: argparse.Namespace) -> None:
    """``lostmotion design``."""
    workers = None
    if arguments.workers is not None:
        workers = whole_number("--workers", arguments.workers, 1, engine()[1].LM_WORKERS_MAX)
    lines = arguments.progress == "json"
    if lines and arguments.json == "-":
        found = "standard output for both --progress json and --json"
        raise InputError("--json", "", found, "a file")
    spec = read_spec(arguments.spec)
    address = arguments.dask or (None if workers is not None else spec.dask)
    cluster = contextlib.nullcontext() if address is None else connect(address)
    with show_progress(arguments) as watch, cluster as executor:
        try:
            result = search(
                arguments.spec,
                arguments.output,
                resume=arguments.resume,
                workers=workers,
                executor=executor,
                watch=watch,
                command=arguments.command_line,
            )
        except KeyboardInterrupt:
            where = one_line(arguments.output)
            print(
                f"\nthe best design so far is in {where}; --resume continues the search",
                file=sys.stderr,
            )
            raise
    if not lines or arguments.json is not None:
        deliver(result.answer(), arguments, lambda: show_result(result))
    if result.best is None:
        wanted = "; ".join(relaxations(result))
        missed = result.combinations["not_reached"]
        unseen = f" in the budget, {missed} combinations not reached" if missed else ""
        raise LostMotionError(
            f"no feasible design{unseen}; {wanted}; start_from takes the nearest design from "
            f"{one_line(str(result.folder))}"
            if wanted
            else result.note
        )
    if result.note and not arguments.quiet:
        print(f"lostmotion: {one_line(result.note)}", file=sys.stderr)


@contextlib.contextmanager
def show_progress(
    arguments: argparse.Namespace,
) -> Iterator[Callable[[dict[str, Any]], None] | None]:
    """Show progress as the arguments require."""
    how = arguments.progress or ("bar" if sys.stderr.isatty() else "none")
    if arguments.quiet and how == "bar":
        how = "none"
    try:
        yield {"bar": draw_bar, "json": print_line, "none": None}[how]
    finally:
        if how == "bar":
            print("\r\033[K", end="", file=sys.stderr, flush=True)


def draw_bar(seen: dict[str, Any]) -> None:
    """Draw the bar: share of the work, best so far, feasible share, combinations, time left."""
    full = int(BAR_WIDTH * seen["done_share"])
    bar = "#" * full + "." * (BAR_WIDTH - full)
    combinations = seen["combinations"]
    done = combinations["total"] - combinations["not_reached"]
    best = "-" if seen["best_value"] is None else f"{seen['best_value']:.4g}"
    left = "" if seen["seconds_left"] is None else f", {seen['seconds_left']:.0f} s left"
    print(
        f"\r\033[K{seen['stage']:>6} [{bar}] best {best}, feasible "
        f"{100 * seen['feasible_share']:.0f} %, combinations {done}/{combinations['total']}{left}",
        end="",
        file=sys.stderr,
        flush=True,
    )


def print_line(seen: dict[str, Any]) -> None:
    """Print one line of JSON; the drive of the best design is left out."""
    line = {"schema": "lostmotion.progress/1", **{k: v for k, v in seen.items() if k != "best"}}
    print(json.dumps(line, allow_nan=False), flush=True)


def relaxations(result: SearchResult) -> list[str]:
    """List the limits to relax and by how much; empty if unknown."""
    relax: list[str] = []
    beyond: list[str] = []
    for limit in (result.infeasible or {}).get("relax", []):
        by, unit = relaxation(limit)
        text = f"{limit['limit']} by {rounded_up(by)} {unit}"
        (relax if limit["set_by_spec"] else beyond).append(text)
    texts = ["relax " + ", ".join(relax)] if relax else []
    if beyond:
        texts.append("wider ranges or other fixed values are needed for " + ", ".join(beyond))
    return texts


def show_result(result: SearchResult) -> None:
    """Print the front and the result of the certificate."""
    state = "finished" if result.finished else "stopped; --resume continues it"
    states = ", ".join(
        f"{n} {name.replace('_', ' ')}" for name, n in result.combinations.items() if n
    )
    print(f"search in {one_line(str(result.folder))}: {state}; combinations: {states}\n")
    if result.refused:
        left_out = "evaluations that the model refused or that gave no finite result were skipped"
        print(f"{result.refused} {left_out}\n")
    if result.best is None:
        print("no feasible design")
        for wanted in relaxations(result):
            print(f"  {wanted}")
        return
    head = [f"{n} {u}" for n, u in zip(result.objectives, result.units, strict=True)]
    step = max(1, -(-len(result.front) // FRONT_ROWS))
    rows = [[f"{v:.5g}" for v in one["objectives"]] for one in result.front[::step]]
    count = "1 design" if len(result.front) == 1 else f"{len(result.front)} designs"
    print(f"the front, {count}" + (", some of them:" if step > 1 else ":"))
    show_table(head, rows)
    seen = result.certificate or {}
    if seen:
        word = "holds" if seen["holds"] else "does NOT hold"
        print(f"\nbest.toml {word} on the fine check; active limits:")
        bound = [limit["name"] for limit in seen["limits"] if limit["binds"]]
        print("  " + (", ".join(bound) or "no limit"))
        at_bounds = at_ends(seen, f"{result.units[0]} of {result.objectives[0]}")
        show_list("variables at a bound of their range", at_bounds)
        broken = [limit for limit in seen["limits"] if limit["stated"] and limit["margin"] < 0]
        for limit in broken:
            unit = margin_unit(limit["name"])
            print(f"  broken: {limit['name']} by {-limit['margin']:.3g} {unit}")
        for name, unit in zip(result.objectives, result.units, strict=True):
            searched, fine = (seen[k][f"{name}_{unit}"] for k in ("figures_as_searched", "figures"))
            if abs(fine - searched) > APART * abs(fine):
                print(f"  {name} {fine:.5g} {unit} there, {searched:.5g} in the search")
    assumed = (f"{key} = {value}" for key, value in result.assumed.items())
    show_list("default values", assumed)
