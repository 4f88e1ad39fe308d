"""Reading does not change a continuous lost motion, and never misreads a wrapped one."""

from __future__ import annotations

import tempfile
from pathlib import Path

from .two_encoders_judge import changed, misread

LOGS = 400
"""Number of generated logs of each type; a step of ``./dev check`` uses 5,000."""


def test_reading_changes_no_bit_of_a_continuous_lost_motion() -> None:
    with tempfile.TemporaryDirectory() as folder:
        wrong = [said for seed in range(LOGS) if (said := changed(seed, Path(folder)))]
    assert not wrong, f"{len(wrong)} of {LOGS}:\n" + "\n".join(wrong[:20])


def test_a_wrapped_log_is_restored_or_left_open_but_never_misread() -> None:
    with tempfile.TemporaryDirectory() as folder:
        said = {seed: misread(seed, Path(folder)) for seed in range(LOGS)}
    wrapped = {seed: line for seed, line in said.items() if line is not None}
    wrong = [line for line in wrapped.values() if line]
    print(f"{len(wrapped)} of {LOGS} logs are wrapped")
    assert len(wrapped) > LOGS / 2
    assert not wrong, f"{len(wrong)} of {len(wrapped)}:\n" + "\n".join(wrong[:20])
