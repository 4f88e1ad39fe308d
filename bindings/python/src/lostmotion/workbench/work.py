"""Background work: one task at a time in a thread, with progress and stop."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor

from lostmotion.errors import LostMotionError
from lostmotion.workbench.disclosure import public_message

LOG = logging.getLogger(__name__)


class StoppedError(Exception):
    """The user stopped the work."""


class Work:
    """State of the background work.

    Attributes
    ----------
    label : str
        Name of the task; empty if there is none.
    share : float
        Completed share, 0 to 1.
    step : str
        What the task does now, if it states it.
    message : str
        Message of the last task: empty, or why it ended without a result.
    version : int
        Incremented with every change.
    """

    def __init__(self) -> None:
        self.label = ""
        self.share = 0.0
        self.step = ""
        self.message = ""
        self.version = 0
        self._stop = threading.Event()
        self._threads = ThreadPoolExecutor(1, thread_name_prefix="lostmotion")

    @property
    def busy(self) -> bool:
        """Whether a task is running."""
        return bool(self.label)

    @property
    def stopping(self) -> bool:
        """Whether a requested stop is still pending."""
        return self.busy and self._stop.is_set()

    def say(self, message: str) -> None:
        """Show a message on the page."""
        self.message = message
        self.version += 1

    def tick(self, done: int, steps: int, step: str = "") -> None:
        """Record progress and the current step; raises `StoppedError` if a stop was requested."""
        if self._stop.is_set():
            raise StoppedError
        self.share, self.step = done / max(steps, 1), step
        self.version += 1

    def stop(self) -> None:
        """Request a stop; the task stops at its next step."""
        self._stop.set()
        self.version += 1

    def start(self, label: str, task: Callable[[], None]) -> Future[None] | None:
        """Start a task; None while another is running."""
        if self.busy:
            return None
        self.label, self.share, self.step, self.message = label, 0.0, "", ""
        self._stop.clear()
        self.version += 1
        return self._threads.submit(self._run, task)

    def _run(self, task: Callable[[], None]) -> None:
        message = ""
        try:
            task()
        except StoppedError:
            message = f"{self.label}: stopped"
        except LostMotionError as error:
            message = public_message(error)
        except MemoryError:
            message = f"{self.label}: not enough memory"
        except Exception as error:
            LOG.exception("%s failed", self.label)
            message = f"{self.label}: {type(error).__name__}; see the terminal for details"
        finally:
            self.label = ""
            self.say(message)

    def close(self) -> None:
        """Stop, and wait until the thread has ended."""
        self._stop.set()
        self._threads.shutdown(cancel_futures=True)
