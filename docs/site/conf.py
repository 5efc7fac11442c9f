"""Settings of the documentation site; `tools/docs.py` gathers its pages and calls Sphinx."""

from __future__ import annotations

from typing import TYPE_CHECKING

from docutils.nodes import SkipNode

from chutelab import __version__
from chutelab.classroom.lessons.texts import mathml

if TYPE_CHECKING:
    from docutils import nodes
    from sphinx.application import Sphinx
    from sphinx.writers.html5 import HTML5Translator

project = "Chutelab"
author = "The Chutelab founders"
version = release = __version__
html_title = f"Chutelab {release}"

extensions = ["myst_parser", "sphinx.ext.autodoc", "numpydoc"]

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3

default_role = "py:obj"
add_module_names = False
autodoc_member_order = "bysource"
autodoc_default_options = {"exclude-members": "model_config, model_post_init"}  # pydantic's
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
autodoc_class_signature = "separated"
numpydoc_show_class_members = False  # autodoc has them
maximum_signature_line_length = 88
python_display_short_literal_types = True
toc_object_entries_show_parents = "hide"

html_theme = "furo"
html_static_path = ["site.css", "site.js"]
html_css_files = ["site.css"]
html_js_files = [("site.js", {"defer": "defer"})]
html_copy_source = False
html_show_copyright = False
html_show_sourcelink = False
html_show_search_summary = False  # it asks for files, which a page that is a file may not
html_math_renderer = "mathml"


def inline(writer: HTML5Translator, node: nodes.math) -> None:
    """Write a formula in a line as MathML, which browsers set without script or network."""
    writer.body.append(mathml(node.astext()))
    raise SkipNode


def displayed(writer: HTML5Translator, node: nodes.math_block) -> None:
    """Write a formula on a line of its own, which scrolls by itself where it is too wide."""
    formula = mathml(node.astext(), display=True)
    writer.body.append(f'<div class="formula" tabindex="0">{formula}</div>')
    raise SkipNode


def setup(app: Sphinx) -> None:
    """Add what sets formulas."""
    app.add_html_math_renderer("mathml", (inline, None), (displayed, None))
