"""Every dress and every fault has the clean copy's answer, or is refused with a reason."""

from __future__ import annotations

from .clean import HIDDEN, clean
from .dress import DRESSES, SAME
from .judge import right_answer
from .table import dresses, faults


def test_the_clean_copy_names_what_is_hidden() -> None:
    answer = right_answer("diagnose")
    assert (answer["verdict"], answer["effects"]) == ("missing-effect", [HIDDEN])


def test_there_are_sixty_dresses_and_twenty_faults_in_every_column() -> None:
    assert len([name for name in dresses() if DRESSES[name].expected == SAME]) >= 60
    for column in clean().names:
        assert len([name for name in faults() if name.startswith(f"{column}: ")]) >= 20, column
