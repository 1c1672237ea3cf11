"""How Sphinx builds the manual: `make docs` writes it to docs/_build, and takes warnings for errors."""

from __future__ import annotations

import re
from collections import namedtuple

import exneat_cli

project = "exneat"
author = "The exneat team"
version = release = exneat_cli.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["_build"]
myst_heading_anchors = 3
nitpicky = True
# Annotations name classes of libraries, and ours by the files that define them; pages name ours as rooms export them.
nitpick_ignore_regex = [("py:.*", r"(?!exneat_cli\.\w+\.\w+$).*")]

html_theme = "furo"
html_title = f"exneat {version}"
html_static_path: list[str] = []
html_show_sphinx = False

default_role = "literal"  # docstrings write `Task`
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
napoleon_use_ivar = True
python_display_short_literal_types = True

_FIELD = type(namedtuple("_", "field").field)
_LITERAL = re.compile(r"(`+.+?`+)")


def skip_fields_of_tuples(app, what, name, obj, skip, options):  # type: ignore[no-untyped-def]
    """A named tuple's docstring lists its fields; Python's own text about each says nothing."""
    return True if isinstance(obj, _FIELD) else None


def escape_bars(app, what, name, obj, options, lines):  # type: ignore[no-untyped-def]
    """``|best|`` is a number without its sign in our docstrings, and no substitution."""
    for number, line in enumerate(lines):
        pieces = _LITERAL.split(line)
        lines[number] = "".join(p if p.startswith("`") else p.replace("|", "\\|") for p in pieces)


def setup(app):  # type: ignore[no-untyped-def]
    """Called by Sphinx."""
    app.connect("autodoc-skip-member", skip_fields_of_tuples)
    app.connect("autodoc-process-docstring", escape_bars)
