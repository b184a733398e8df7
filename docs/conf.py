"""How Sphinx makes the site: of these pages, and of the docstrings (`make docs`).

`make docs SITE=https://docs.example.org/tickrig/` makes it for that address: it adds
sitemap.xml, and the links of 404.html work below that path. Without an address these links begin at
the root of a host.
"""

from __future__ import annotations

import os
import re
from logging import getLogger
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from tickrig import __version__

if TYPE_CHECKING:
    from sphinx.application import Sphinx

project = "tickrig"
version = release = __version__
extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.intersphinx",
    "myst_parser",
    "notfound.extension",
]
html_baseurl = os.environ.get("SITE", "")
if html_baseurl:
    extensions.append("sphinx_sitemap")
    sitemap_url_scheme = "{link}"
    sitemap_excludes = ["404.html", "search.html"]
notfound_urls_prefix = f"{urlsplit(html_baseurl).path.rstrip('/')}/"
notfound_context = {
    "title": "Page not found",
    "body": "<h1>Page not found</h1>\n\n<p>This page has another name now, or the address has a "
    "mistake. The menu has all pages, and the field above it searches them.</p>",
}
html_theme = "furo"
html_title = f"tickrig {version}"
html_show_sourcelink = False
html_show_copyright = False  # the license is in the README
html_static_path = ["site/site.css"]
html_css_files = ["site.css"]

myst_heading_anchors = 4
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

# What of others our signatures name. The lists lie here, so that no build asks the network.
intersphinx_mapping = {
    name: (where, f"site/{name}.txt")
    for name, where in {
        "python": "https://docs.python.org/3/",
        "python-can": "https://python-can.readthedocs.io/en/stable/",
        "canopen": "https://canopen.readthedocs.io/en/stable/",
        "pyserial": "https://pyserial.readthedocs.io/en/latest/",
    }.items()
}

ELSEWHERE = re.compile(r"(?<!!)\[([^]]*)\]\(((?:\.\./)+)(?!examples/[^)]*\.)[^)]*\)")
"""A link out of the folder of its page, but to a file of examples/, which can be downloaded."""

LONG_WORD = re.compile(r'(?<=<span class="pre">)[^<]{20,}(?=</span>)')
"""Of code: the name of a test, mostly. Unbroken it takes the room of its neighbours in a table."""


TABLE = re.compile(r"<table\b.*?</table>", re.DOTALL)
PROOF = re.compile(r"(?:(?:further )?tests?|checks?|proven by|held by)")
"""Head of a last column that names the tests of each row: most readers want the others."""


def setup(app: Sphinx) -> None:
    """Mend what is right on a code host and not on a site."""
    # A toctree ends with `*`, for pages that it does not name; that there is none is no mistake.
    getLogger("sphinx.sphinx.directives.other").addFilter(
        lambda record: getattr(record, "subtype", "") != "empty_glob"
    )
    app.connect("source-read", _unlink)
    app.connect("html-page-context", _let_words_break)
    app.connect("html-page-context", _fold_proofs)


def _unlink(app: Sphinx, page: str, source: list[str]) -> None:
    """Let links out of docs/ be plain text: the site has no sources beside it."""
    out = "../" * (page.count("/") + 1)
    source[0] = ELSEWHERE.sub(lambda link: link[1] if link[2] == out else link[0], source[0])


def _let_words_break(
    app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: object
) -> None:
    """Let long words of code go on in a line below, behind `_`, `/` and a hyphen within."""
    place = re.compile(r"([_/]|(?<=\w)-)")
    parted = r'\1</span><wbr><span class="pre">'
    if "body" in context:
        context["body"] = LONG_WORD.sub(lambda word: place.sub(parted, word[0]), context["body"])


def _fold_proofs(
    app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: object
) -> None:
    """Fold the cells of a last column of tests: on a telephone it takes a third of the width."""
    if "body" in context:
        context["body"] = TABLE.sub(_folded, context["body"])


def _folded(table: re.Match[str]) -> str:
    heads = re.findall(r"<th\b[^>]*>(?:<p>)?(.*?)(?:</p>)?</th>", table[0], re.DOTALL)
    if not heads or not PROOF.fullmatch(heads[-1]):
        return table[0]
    cell = r"<td>(?!\s*</td>)((?:(?!<td>).)*?)</td>(\s*</tr>)"
    fold = r"<td><details><summary>show</summary>\1</details></td>\2"
    return re.sub(cell, fold, table[0], flags=re.DOTALL)
