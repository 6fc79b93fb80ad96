"""The site of the documentation: `make docs` builds it with Sphinx into build/docs."""

import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# autodoc imports this checkout, whatever is installed
sys.path[:0] = [str(ROOT / "docs"), str(ROOT / "model"), str(ROOT / "analysis")]
os.environ.setdefault("MPLBACKEND", "agg")

project = "flexura"
author = copyright = "the flexura authors"
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "_site.formulas",
    "_site.docstrings",
    "_site.tables",
]
root_doc = "index"
exclude_patterns = ["_site"]

myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_dmath_double_inline = True
myst_heading_anchors = 3
nitpicky = True  # a name that leads nowhere is a warning, and the build stops at the first one
nitpick_ignore_regex = [("py:.*", ".*")]  # types of other packages in signatures

default_role = "code"
smartquotes = False  # two hyphens are an option
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_class_signature = "mixed"
napoleon_numpy_docstring = False
add_module_names = False
python_use_unqualified_type_names = True

html_theme = "furo"
html_title = "flexura"
html_math_renderer = "mathjax-offline"
html_static_path = ["_site/static"]
html_css_files = ["flexura.css"]
html_show_sphinx = False
html_copy_source = False
html_show_sourcelink = False
html_theme_options = {"navigation_with_keys": True}
