"""All thresholds are in one file, each with its meaning and its origin."""

from __future__ import annotations

import ast
from pathlib import Path

from lostmotion import rules

ORIGINS = ("Derived: ", "Conventional: ", "Chosen: ")


def test_every_threshold_states_its_meaning_and_source() -> None:
    body = ast.parse(Path(rules.__file__).read_text()).body[1:]
    names = body[::2]
    assert len(names) == sum(name.isupper() for name in vars(rules))
    for name, said in zip(names, body[1::2], strict=True):
        assert isinstance(name, ast.Assign)
        assert isinstance(said, ast.Expr)
        assert isinstance(said.value, ast.Constant)
        meaning, _, origin = str(said.value.value).strip().rpartition("\n\n")
        assert len(meaning) > 20, ast.unparse(name)
        assert origin.startswith(ORIGINS), ast.unparse(name)


def test_every_threshold_is_used_by_its_place() -> None:
    """Rules are read by name at the time of use: a changed one is changed everywhere."""
    package = Path(rules.__file__).parent
    text = "".join(file.read_text() for file in package.rglob("*.py") if file.name != "rules.py")
    unused = [name for name in vars(rules) if name.isupper() and f"rules.{name}" not in text]
    assert unused == []
    assert "lostmotion.rules import" not in text
