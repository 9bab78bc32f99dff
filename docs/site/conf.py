"""Settings of the documentation site: python -m sphinx docs/site build/site."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

import site_sources

from limitmason.constants import VERSION

site_sources.write_all()

project = "limitmason"
author = "The limitmason developers"
copyright = "The limitmason developers, MIT licence"
version = release = VERSION

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "numpydoc",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = ["gallery_source", "gallery/**/*.ipynb", "gallery/**/*.py", "gallery/**/*.zip"]
exclude_patterns += ["**/sg_execution_times.rst", "sg_execution_times.rst"]
default_role = "literal"
suppress_warnings = ["config.cache"]

autodoc_member_order = "bysource"
autodoc_typehints = "none"
autodoc_preserve_defaults = True
numpydoc_show_class_members = False
numpydoc_xref_param_type = False

myst_enable_extensions = ["colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3

# output is stored beside the site and shown; running all examples takes a quarter of an hour, see store_gallery.py
plot_gallery = False
sphinx_gallery_conf = {
    "examples_dirs": "gallery_source",
    "gallery_dirs": "gallery",
    "plot_gallery": False,
    "within_subsection_order": "site_sources.GalleryOrder",
    "download_all_examples": False,
    "show_signature": False,
    "write_computation_times": False,
    "remove_config_comments": True,
}

html_theme = "pydata_sphinx_theme"
html_title = "limitmason"
html_theme_options = {"show_toc_level": 2, "navigation_with_keys": False, "show_prev_next": True}
html_show_sourcelink = False
# pages without pages below them: the room is for their tables
ALONE = ("index", "quickstart", "application", "conventions", "theory", "validation", "made/*")
html_sidebars = {name: [] for name in ALONE}
html_static_path = ["static"]
html_css_files = ["wide.css"]


def setup(app):
    """Let docstrings be read before numpydoc does."""
    app.connect(
        "autodoc-process-docstring",
        lambda app, what, name, obj, options, lines: lines.__setitem__(slice(None), site_sources.readable(lines)),
        priority=100,
    )
    # fields of a named tuple stand in its signature; what Python says of them says nothing
    app.connect(
        "autodoc-skip-member",
        lambda app, what, name, obj, skip, options: True if type(obj).__name__ == "_tuplegetter" else None,
    )
