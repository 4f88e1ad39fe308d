"""Tasks of a search that run in an executor: a pool of `concurrent.futures`, or a Dask client."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from lostmotion.design.engine import engine
from lostmotion.design.progress import TICK_SECONDS
from lostmotion.design.tasks import build_mark, do_task
from lostmotion.errors import LostMotionError

RETRIES = 20
"""Largest number of workers that a task of a cluster may lose."""


class ExecutorWork:
    """Tasks of a search, submitted to an executor batch by batch.

    Parameters
    ----------
    executor
        Anything with ``submit(function, *arguments)``.
    run : cdata
        ``lm_run *``.
    text : str
        Spec as the optimizer reads it.
    folder : Path
        Of the run, for messages.
    show : callable
        Called a few times a second.
    stop : threading.Event, optional
    """

    def __init__(
        self,
        executor: Any,
        run: Any,
        text: str,
        folder: Path,
        show: Callable[[], None],
        stop: threading.Event | None,
    ) -> None:
        self.ffi, self.lib = engine()
        self.executor = executor
        self.run = run
        self.text = text
        self.folder = folder
        self.show = show
        self.stop = stop

    def do_all(self) -> bool:
        """Run all tasks; False if it was stopped."""
        ffi, lib = self.ffi, self.lib
        search = lib.lm_run_search(self.run)
        tasks = ffi.new("const lm_task **")
        while (count := lib.lm_next_tasks(search, tasks)) > 0:
            waiting = [
                bytes(ffi.buffer(ffi.addressof(tasks[0][i])))
                for i in range(count)
                if not lib.lm_is_answered(search, tasks[0][i].id)
            ]
            if not self.do_batch(waiting):
                return False
        return True

    def do_batch(self, waiting: list[bytes]) -> bool:
        """Run one batch of tasks; False if it was stopped."""
        mark = build_mark()
        answers: queue.SimpleQueue[Any] = queue.SimpleQueue()
        futures = []
        shown = time.monotonic()
        try:
            for task in waiting:
                future = submit(self.executor, self.text, task, mark)
                futures.append(future)
                future.add_done_callback(answers.put)
            for _ in range(len(waiting)):
                while True:
                    if self.stop is not None and self.stop.is_set():
                        return False
                    try:
                        future = answers.get(timeout=TICK_SECONDS)
                        break
                    except queue.Empty:
                        self.show()
                self.take(future)
                if time.monotonic() - shown > TICK_SECONDS:
                    shown = time.monotonic()
                    self.show()
            return True
        finally:
            for future in futures:
                if not future.done():
                    future.cancel()

    def take(self, future: Any) -> None:
        """Give an answer to the search."""
        try:
            data = future.result()
        except LostMotionError:
            raise
        except Exception as error:
            raise LostMotionError(
                f"a task was lost by the executor ({type(error).__name__}: {error}); the completed "
                f"work is in {self.folder}; resume the search to continue"
            ) from error
        answer = self.ffi.new("lm_answer *")
        self.ffi.buffer(answer)[: len(data)] = data
        if self.lib.lm_take_answer(self.run, answer) != 0:
            raise LostMotionError(f"{self.folder}: the journal cannot be written")


def submit(executor: Any, text: str, task: bytes, mark: tuple[str, int, int]) -> Any:
    """Submit a task to an executor; a Dask cluster may lose workers while it runs."""
    if type(executor).__module__.split(".")[0] == "distributed":
        return executor.submit(do_task, text, task, mark, retries=RETRIES, pure=False)
    return executor.submit(do_task, text, task, mark)
