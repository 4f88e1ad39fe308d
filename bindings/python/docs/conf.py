"""Sphinx: pages in Markdown, formulas as MathML, so that nothing needs the network."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import latex2mathml.converter
from docutils import nodes

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))
import generate  # noqa: E402

CHECKOUT = next(
    place for place in (HERE.parent / "checkout", HERE.parents[2]) if (place / "lib").is_dir()
)

project = "lostmotion"
project_copyright = "the lostmotion authors"
release = re.search(
    r"project\(lostmotion VERSION ([\d.]+)", (CHECKOUT / "CMakeLists.txt").read_text()
)[1]  # type: ignore[index]
version = release

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 3
napoleon_google_docstring = False
napoleon_use_rtype = False
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_preserve_defaults = True
python_use_unqualified_type_names = True

html_theme = "furo"
html_title = f"lostmotion {release}"
html_static_path = ["_static"]
html_css_files = ["page.css"]
html_math_renderer = "mathml"
exclude_patterns = ["_build"]


def open_math(self: Any, node: nodes.math) -> None:
    """Write a formula in a line."""
    self.body.append(latex2mathml.converter.convert(node.astext()))
    raise nodes.SkipNode


def open_math_block(self: Any, node: nodes.math_block) -> None:
    """Write a displayed formula."""
    self.body.append(latex2mathml.converter.convert(node.astext(), display="block"))
    raise nodes.SkipNode


def setup(app: Any) -> None:
    """Register the formulas, and make the pages that come from the sources."""
    app.add_html_math_renderer("mathml", (open_math, None), (open_math_block, None))
    generate.write_pages(CHECKOUT, HERE / "reference" / "generated")
