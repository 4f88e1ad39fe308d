"""A fault of each kind for two quick commands; faults.py covers every command."""

from __future__ import annotations

from pathlib import Path

import faults
import pytest

COMMANDS = ("export", "design")


@pytest.mark.parametrize("name", COMMANDS)
def test_after_any_fault_a_file_is_the_old_one_or_the_new_one(name: str, tmp_path: Path) -> None:
    if name == "design":
        pytest.importorskip("lostmotion._search", reason="no NLopt: apt install libnlopt-dev")
    for _, fault, count, wrongs in faults.cases(
        [name], dict.fromkeys(faults.FAULTS, 1), 1, tmp_path
    ):
        assert count == 1
        assert not wrongs, f"{fault}: {wrongs[0]}"
