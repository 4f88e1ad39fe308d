"""Run a search in a folder: on the threads of this machine, or by an executor."""

from __future__ import annotations

import json
import os
import re
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

from lostmotion.design.engine import FATES, c_string, engine
from lostmotion.design.left_open import left_open
from lostmotion.design.progress import TICK_SECONDS, OnSnapshot, ProgressReports, reporter
from lostmotion.design.result import Designs, SearchResult
from lostmotion.design.spec import Spec, read_spec
from lostmotion.design.start import Start, starts_of
from lostmotion.drives import format_toml
from lostmotion.errors import InputError, LostMotionError
from lostmotion.files import write_whole
from lostmotion.on_progress import OnProgress
from lostmotion.threads import begin

DONE, FAILED, BAD_INPUT, STOPPED = 0, 1, 2, 130

RUNNING: dict[str, object] = {}
"""Run folders of this process by their real path. A journal is locked only against other processes,
and opening it again in this process would release the lock."""


def search(
    spec_path: str | Path,
    run_folder: str | Path,
    *,
    resume: bool = False,
    workers: int | None = None,
    executor: Any = None,
    progress: OnProgress | None = None,
    watch: OnSnapshot | None = None,
    stop: threading.Event | None = None,
    command: str | None = None,
) -> SearchResult:
    """Search for designs.

    Parameters
    ----------
    spec_path : path
        Search spec, TOML.
    run_folder : path
        Receives ``best.toml``, ``front.csv``, ``history.csv``, ``report.html`` and the journal.
    resume : bool
        Continue the search in the folder; the result is the same as without the interruption.
    workers : int, optional
        Number of threads; by default that of the spec, else one per core.
    executor : optional
        Anything with ``submit(function, *arguments)`` that returns a future: an executor of
        `concurrent.futures`, a Dask client. It runs the tasks instead of threads; the result is
        identical.
    progress : callable, optional
        ``progress(done, of, step)``, see `lostmotion.on_progress`.
    watch : callable, optional
        Called about five times a second, and once at the end, in the thread of the caller, with a
        dict: ``stage``, ``evaluations``, ``budget``, ``done_share`` (of all work, with the
        verification of the front), ``best_value`` (of the first objective, or
        None), ``best`` (its drive file, or None), ``feasible_share``, ``refused``,
        ``combinations`` (``solved``, ``dominated``, ``pruned``, ``not_reached``, ``total``),
        ``front`` (a list of objectives for each design), ``seconds``, ``seconds_left`` (None while
        unknown).
    stop : threading.Event, optional
        When it is set, the search saves its state and returns an unfinished result.
    command : str, optional
        Command line that requested it, for the report.

    Returns
    -------
    SearchResult

    Raises
    ------
    InputError
        Nothing was written.
    LostMotionError
        The work failed, or the package has no search.
    KeyboardInterrupt
        After the state was saved.
    """
    spec = read_spec(spec_path)
    with _Run(spec, Path(run_folder), resume, command) as run:
        return run.work(workers or spec.workers, executor, reporter(progress, watch), stop)


class _Run:
    """A running search."""

    def __init__(self, spec: Spec, folder: Path, resume: bool, command: str | None) -> None:
        self.ffi, self.lib = engine()
        self.spec = spec
        self.folder = folder
        self.resume = resume
        self.command = command or f"lostmotion.design.search({spec.file!r}, {str(folder)!r})"
        self.note = self.ffi.new("char[]", self.lib.LM_NOTE_MAX)
        self.notes: list[str] = []
        self.stop_flag = self.ffi.new("int *")
        self.place = os.path.realpath(folder)

    def __enter__(self) -> _Run:
        if RUNNING.setdefault(self.place, self) is not self:
            raise InputError(
                str(self.folder / "journal.bin"),
                "",
                "a running search",
                "a finished search, or another folder",
            )
        try:
            self.open()
        except BaseException:
            del RUNNING[self.place]
            raise
        return self

    def open(self) -> None:
        one = self.ffi.new("lm_run **")
        status = self.lib.lm_open_run(
            self.spec.file.encode(),
            self.spec.text.encode(),
            str(self.folder).encode(errors="surrogateescape"),
            int(self.resume),
            one,
            self.note,
        )
        said = c_string(self.note)
        if status == BAD_INPUT:
            match = re.fullmatch(r"(.*): found (.*), expected (.*)", said, re.S)
            if match is None:
                raise InputError(self.spec.file, "", said, "a valid search")
            raise InputError(match[1], "", match[2], match[3])
        if status != DONE:
            raise LostMotionError(said)
        self.hear(said)
        self.run = one[0]
        self.search = self.lib.lm_run_search(self.run)
        self.designs = Designs(self.lib.lm_run_problem(self.run), self.spec)

    def __exit__(self, *_: object) -> None:
        self.lib.lm_close_run(self.run)
        del RUNNING[self.place]

    def hear(self, said: str) -> None:
        if said:
            self.notes.append(said)

    # --- work ---

    def work(
        self,
        workers: int | None,
        executor: Any,
        watch: OnSnapshot | None,
        stop: threading.Event | None,
    ) -> SearchResult:
        lead = self.spec.objectives[0]
        self.progress = ProgressReports(self.search, self.designs, lead, watch)
        begin(load_report)
        interrupt: BaseException | None = None
        try:
            if executor is not None:
                status = self.work_by(executor, stop)
            else:
                status = self.work_here(workers or 0, stop)
        except BaseException as error:  # saved below, then raised again
            interrupt = error
            status = STOPPED
        status = self.finish(status)
        if status == FAILED and self.lib.lm_read_best(self.search, self.ffi.new("lm_solution *")):
            raise LostMotionError(self.notes[-1] if self.notes else "the search failed")
        result = self.collect(status)
        if interrupt is not None:
            raise interrupt
        self.progress.snapshot()
        self.progress.show()
        return result

    def in_thread(self, call: Callable[[], int], each: Callable[[], None]) -> int:
        """Make a long call of the library while `each` runs periodically in this thread."""
        done: list[int] = []
        thread = threading.Thread(target=lambda: done.append(call()), name="lostmotion search")
        thread.start()
        try:
            while thread.is_alive():
                thread.join(TICK_SECONDS)
                each()
        except BaseException:
            self.stop_flag[0] = 1
            thread.join()
            raise
        if not done:
            raise LostMotionError("the search ended without an answer")
        return done[0]

    def work_here(self, workers: int, stop: threading.Event | None) -> int:
        """Run all tasks with threads of the library."""
        hook = self.ffi.new_handle(self.progress.snapshot)

        def call() -> int:
            status: int = self.lib.lm_work_run(
                self.run, workers, self.lib.lm_hook, hook, self.stop_flag, self.note
            )
            return status

        def each() -> None:
            if stop is not None and stop.is_set():
                self.stop_flag[0] = 1
            self.progress.show()

        status = self.in_thread(call, each)
        self.hear(c_string(self.note))
        return status

    def work_by(self, executor: Any, stop: threading.Event | None) -> int:
        """Submit all tasks to an executor."""
        from lostmotion.design.by_executor import ExecutorWork  # only an executor needs it

        def show() -> None:
            self.progress.snapshot()
            self.progress.show()

        work = ExecutorWork(executor, self.run, self.spec.text, self.folder, show, stop)
        return DONE if work.do_all() else STOPPED

    # --- the end ---

    def finish(self, status: int) -> int:
        """Write the results of the library, while the drives of the front are read and drawn."""
        from lostmotion.design.report import draw_drives  # see load_report
        from lostmotion.report.charts import begin_packing

        finishing = begin(lambda: int(self.lib.lm_finish_run(self.run, status, self.note)))
        begin_packing()
        try:
            self.drives = self.designs.drives(self.search)
            self.pictures = draw_drives(self.drives)
        finally:
            status = finishing()
        self.hear(c_string(self.note))
        return status

    def left_open(self, best: Any, document: dict[str, Any] | None) -> dict[str, Any]:
        """Keys that the spec does not state, with the values of the best design if there is one."""
        designs = self.designs
        there = document is not None
        values = designs.values(best.combination, best.unit) if there else None
        design = document["design"] if document is not None else None
        return left_open(designs.problem, self.spec.said, values, design)

    def collect(self, status: int) -> SearchResult:
        """Read what the search found and finish the files of the folder."""
        from lostmotion.design.report import Context, write_search_report  # see load_report

        best = self.ffi.new("lm_solution *")
        document = certificate = infeasible = None
        if self.lib.lm_read_best(self.search, best):
            document = self.designs.drive(best.combination, best.unit)
            write_whole(self.folder / "best.toml", format_toml(document))
            certificate = json.loads((self.folder / "certificate.json").read_text(encoding="utf-8"))
        elif status == FAILED and (self.folder / "infeasible.json").is_file():
            infeasible = json.loads((self.folder / "infeasible.json").read_text(encoding="utf-8"))
        p = self.ffi.new("lm_progress *")
        self.lib.lm_read_progress(self.search, p)
        result = SearchResult(
            document,
            self.designs.front(self.run, self.drives),
            self.designs.names,
            self.designs.units,
            self.designs.larger,
            status != STOPPED,
            certificate,
            infeasible,
            "; ".join(self.notes),
            {name: int(p.fate[i]) for i, name in enumerate(FATES)},
            int(p.refused),
            self.folder,
            {**self.spec.assumed, **self.left_open(best, document)},
        )
        starts: tuple[Start, ...] = ()
        if document is not None:
            starts = starts_of(self.designs, self.spec, int(best.combination), best.unit)
            result.start = starts[1].figures if starts else {}
        problem = self.designs.problem
        context = Context(
            self.spec,
            self.command,
            int(problem.seed),
            int(p.evaluations),
            int(p.budget),
            float(problem.torque_Nm),
            starts,
            self.pictures,
        )
        write_search_report(result, context)
        return result


def load_report() -> None:
    """Load what the report needs, while the threads of the search run."""
    import lostmotion.design.report  # noqa: F401


def _register() -> None:
    """Register a callback for the library; the handle is a function without arguments."""
    try:
        ffi, _ = engine()
    except LostMotionError:
        return

    @ffi.def_extern(name="lm_hook")  # type: ignore[untyped-decorator]
    def call(handle: Any) -> None:
        ffi.from_handle(handle)()


_register()
