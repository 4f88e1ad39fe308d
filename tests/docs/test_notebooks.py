"""The notebooks of the documentation run from top to bottom."""

from __future__ import annotations

from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
NOTEBOOKS = sorted((ROOT / "bindings" / "python" / "docs" / "notebooks").glob("*.ipynb"))


@pytest.mark.parametrize("file", NOTEBOOKS, ids=lambda file: file.stem)
def test_a_notebook_runs(file: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    nbclient = pytest.importorskip("nbclient", reason="nbclient: pip install nbclient ipykernel")
    nbformat = pytest.importorskip("nbformat", reason="nbformat: pip install nbformat")
    pytest.importorskip("ipykernel", reason="ipykernel: pip install ipykernel")
    monkeypatch.setenv("LOSTMOTION", str(ROOT))
    notebook = nbformat.read(file, as_version=4)
    nbformat.validate(notebook)
    assert not any(cell.get("outputs") for cell in notebook.cells)  # outputs are not stored
    place = {"metadata": {"path": tmp_path}}
    nbclient.NotebookClient(notebook, timeout=600, resources=place).execute()
    kinds = [
        set(output.get("data", {})) for cell in notebook.cells for output in cell.get("outputs", [])
    ]
    figures = sum("application/vnd.plotly.v1+json" in kind for kind in kinds)
    assert figures == sum(
        ".plot" in cell.source for cell in notebook.cells if cell.cell_type == "code"
    )
    assert any("text/html" in kind for kind in kinds)
