"""Write the specs as the optimizer's own text, for its C tests and its program."""

from __future__ import annotations

from pathlib import Path

from lostmotion.design.spec import read_spec

HERE = Path(__file__).parent
FOLDERS = (HERE, HERE.parents[1] / "benchmarks" / "specs")


def derived(file: Path) -> str:
    """Return the text of a spec, with a line that says where it is from."""
    source = f"# Made from {file.name}, which says what it is."
    return f"{source} tests/data/specs/derive.py makes it again.\n{read_spec(file).text}"


if __name__ == "__main__":
    for spec in sorted(file for folder in FOLDERS for file in folder.glob("*.toml")):
        spec.with_suffix(".search").write_text(derived(spec), encoding="utf-8")
