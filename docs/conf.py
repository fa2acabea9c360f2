"""Configuration of the documentation site, which ``make docs`` builds."""

import re
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent
sys.path[:0] = [str(ROOT), str(Path(__file__).parent)]

import made  # noqa: E402
from docutils import nodes  # noqa: E402
from docutils.utils.math import MathError  # noqa: E402
from docutils.utils.math.latex2mathml import tex2mathml  # noqa: E402
from sphinx.util.logging import getLogger  # noqa: E402

import gqm_sym  # noqa: E402

made.copy_notebooks(Path(__file__).parent / "made")

project = "gqm_sym"
author = "the gqm_sym developers"
copyright = "the gqm_sym developers"  # noqa: A001 (Sphinx wants it so)
release = gqm_sym.__version__

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["_build", "**/.ipynb_checkpoints", "**/generated"]
myst_enable_extensions = ["amsmath", "dollarmath"]
myst_heading_anchors = 3
nb_execution_mode = "cache"
nb_execution_raise_on_error = True
nb_execution_timeout = 300
napoleon_numpy_docstring = True
napoleon_use_ivar = True
autodoc_typehints = "none"
autodoc_member_order = "bysource"

html_theme = "furo"
html_math_renderer = "mathml"
html_title = "gqm_sym"
html_copy_source = False


def _split_names(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Give each attribute a line of its own where a docstring describes several together."""
    found = [(line, re.fullmatch(r":ivar (\w+(?:, \w+)+): (.*)", line)) for line in lines]
    lines[:] = [
        text
        for line, names in found
        for text in ([f":ivar {one}: {names[2]}" for one in names[1].split(", ")] if names else [line])
    ]


def _link_maths(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Let what docstrings cite as MATHS lead to its page."""
    lines[:] = [line.replace("MATHS", ":doc:`MATHS </concepts/maths>`") for line in lines]


def _link_notebooks(app: Any, page: str, source: list[str]) -> None:
    """Let links between pages and notebooks, which are files of the repository, lead to their pages on the site."""
    if page.startswith("made/"):
        source[0] = source[0].replace("](../docs/", "](../")
    source[0] = re.sub(r"\]\(\.\./((?:\.\./)*)notebooks/(\w+)\.ipynb\)", r"](\1made/\2.ipynb)", source[0])


def _write_formula(writer: Any, node: nodes.Element) -> None:
    """Write a formula as MathML, which browsers show without a script and without a network."""
    is_block = isinstance(node, nodes.math_block)
    try:
        writer.body.append(tex2mathml(node.astext(), as_block=is_block))
    except MathError as error:
        getLogger(__name__).warning("the formula %r has no MathML: %s", node.astext(), error, location=node)
    raise nodes.SkipNode


def setup(app: Any) -> None:
    """Connect the functions above; the first one after napoleon, which writes the lines that it splits."""
    app.add_html_math_renderer("mathml", (_write_formula, None), (_write_formula, None))
    app.connect("autodoc-process-docstring", _split_names, priority=600)
    app.connect("autodoc-process-docstring", _link_maths)
    app.connect("source-read", _link_notebooks)
