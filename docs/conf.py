"""How Sphinx makes the API reference of the docstrings (`make docs`)."""

from tickrig import __version__

project = "tickrig"
version = release = __version__
extensions = ["sphinx.ext.autodoc", "sphinx.ext.napoleon", "myst_parser"]
root_doc = "api/index"
include_patterns = ["api/*.md"]
html_theme = "furo"
html_title = f"tickrig {version}"

default_role = "code"  # a name between backticks, as in the pages
autodoc_default_options = {
    "members": True,
    "inherited-members": "object, BaseException, Exception, tuple, int, str, Generic, Protocol",
    "member-order": "bysource",
}
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
