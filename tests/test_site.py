"""The site of docs/: made without a warning and without a network, each page and link of it."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from urllib.parse import unquote

import pytest

from tests.environment import ROOT, made_once

PLACES = ("tickrig", "tickrig.device", "tickrig.host", "tickrig.rtc", "tickrig.testing")
pytestmark = pytest.mark.timeout(600)  # it takes half a minute of a processor, beside other tests

INDEXES = {"genindex.html", "py-modindex.html", "search.html", "404.html"}
"""Sphinx and its extensions make them; whether they are linked is the theme's business."""


SITE = "https://docs.example.org/rig/"


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Make it, once for all workers."""
    return made_once(tmp_path_factory, "site", make_site) / "html"


def make_site(folder: Path) -> None:
    done = subprocess.run(
        (
            *(sys.executable, "-m", "sphinx", "-W", "-q", "-d", str(folder / "doctrees")),
            *(str(ROOT / "docs"), str(folder / "html")),
        ),
        env={**os.environ, "PYTHONPATH": str(ROOT / "src"), "SITE": SITE},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")


@cache
def text_of(page: Path) -> str:
    return page.read_text("utf-8")


def links(page: Path) -> Iterator[tuple[Path, str]]:
    """Return where a page leads to within the site: files, and names in them."""
    for target in re.findall(r'<a [^>]*href="([^"]+)"', text_of(page)):
        if not re.match(r"\w+:", target):
            path, _, name = unquote(target).partition("#")
            if page.name == "404.html" and path:
                assert path.startswith("/rig/"), path  # it is shown for an address in any folder
                path = str(page.parent / path.removeprefix("/rig/"))
            yield ((page.parent / path).resolve() if path else page), name


def test_every_page_of_docs_is_reached_from_the_first_one(site: Path) -> None:
    reached, new = set[Path](), {site / "index.html"}
    while new:
        page = new.pop()
        reached.add(page)
        new |= {path for path, _ in links(page) if path.suffix == ".html"} - reached
    pages = {
        (site / path.relative_to(ROOT / "docs")).with_suffix(".html")
        for path in (ROOT / "docs").rglob("*.md")
    }
    assert pages - reached == set()
    assert set(site.rglob("*.html")) - reached - {site / name for name in INDEXES} == set()


def test_every_link_of_the_site_leads_to_something(site: Path) -> None:
    for page in site.rglob("*.html"):
        for path, name in links(page):
            assert path.exists(), f"{page.name} leads to {path.name}"
            if name and path.suffix == ".html":
                assert f'id="{name}"' in text_of(path), f"{page.name} leads to {path.name}#{name}"


def test_the_site_wants_nothing_of_the_network(site: Path) -> None:
    loading = re.compile(
        r'<(?:script|img|iframe|link(?! rel="canonical"))\b[^>]*(?:src|href)="(?:https?:)?//[^"]*"'
    )
    for page in site.rglob("*.html"):
        assert loading.findall(text_of(page)) == []
    fetching = re.compile(r"""(?:@import\s|url\()\s*["']?(?:https?:)?//[^"')]*""")
    for path in (*site.rglob("*.css"), *site.rglob("*.svg")):
        assert fetching.findall(text_of(path)) == [], path.name


def test_each_page_is_in_the_menu_of_each_page(site: Path) -> None:
    pages = {path.relative_to(site) for path in site.rglob("*.html")} - set(map(Path, INDEXES))
    for page in sorted(pages):
        _, _, menu = text_of(site / page).partition('<div class="sidebar-tree">')
        there = re.findall(r'href="([^"#]*)', menu.partition("</aside>")[0])
        found = {(site / page).parent.joinpath(path).resolve() for path in there if path}
        missed = {path for path in pages if (site / path).resolve() not in found}
        assert missed <= {page, Path("index.html")}, page.name


def test_the_page_for_an_unknown_address_has_the_menu_and_its_styles_in_any_folder(
    site: Path,
) -> None:
    text = text_of(site / "404.html")
    assert "Page not found" in text
    assert 'href="/rig/tutorials/index.html"' in text
    assert re.findall(r'(?:src|href)="(?!https:|/rig/|#)[^"]*"', text) == []


def test_the_site_map_has_each_page(site: Path) -> None:
    there = set(re.findall(r"<loc>(.*?)</loc>", (site / "sitemap.xml").read_text("utf-8")))
    pages = {f"{SITE}{page.relative_to(site)}" for page in site.rglob("*.html")}
    assert pages - there == {f"{SITE}404.html", f"{SITE}search.html"}


def test_no_table_is_torn(site: Path) -> None:
    for page in site.rglob("*.html"):
        assert not re.search(r"<p>\s*\|", text_of(page)), page.name


def test_a_word_of_code_is_broken_where_it_is_long(site: Path) -> None:
    text = text_of(site / "reference" / "canmon" / "canmon.html")
    may_break = '</span><wbr><span class="pre">'
    assert may_break.join(("test_", "what_", "a_", "frame_", "means_")) in text
    assert '<span class="pre">conform</span>' in text
    assert 'href="../../_static/site.css' in text
    css = text_of(site / "_static" / "site.css")
    assert re.search(r"^code\.literal span\.pre \{\s+white-space: nowrap;", css, re.MULTILINE)


def test_a_last_column_of_tests_is_folded(site: Path) -> None:
    text = text_of(site / "howto" / "ros2.html")
    rows = re.findall(r"<tr\b.*?</tr>", text, re.DOTALL)
    (row,) = (
        row
        for row in rows
        if "test_a_stopped_peer" in row.replace('</span><wbr><span class="pre">', "")
    )
    assert re.search(r"<td><details><summary>show</summary><p>.*</details></td>\s*</tr>", row)
    assert row.count("<details>") == 1
    folded = [page for page in site.rglob("*.html") if "<summary>show" in text_of(page)]
    assert len(folded) > 30


def test_headings_go_down_one_level_at_a_time(site: Path) -> None:
    for page in site.rglob("*.html"):
        if page.name not in INDEXES:
            levels = [int(level) for level in re.findall(r"<h([1-6])\b", text_of(page))]
            assert levels.count(1) == 1, page.name
            assert all(b <= a + 1 for a, b in pairwise(levels)), page.name


def test_the_search_knows_all_pages(site: Path) -> None:
    index = (site / "searchindex.js").read_text("utf-8")
    found = json.loads(index.removeprefix("Search.setIndex(").rstrip().removesuffix(")"))
    pages = {str(page.relative_to(ROOT / "docs"))[:-3] for page in (ROOT / "docs").rglob("*.md")}
    assert set(found["docnames"]) == pages
    where = found["terms"]["wheelchair"]
    assert "index" in [found["docnames"][page] for page in where]


@pytest.mark.parametrize("place", PLACES)
def test_the_reference_has_each_public_name(site: Path, place: str) -> None:
    text = text_of(site / "api" / f"{place.rpartition('.')[2]}.html")
    for name in import_module(place).__all__:
        assert f'id="{place}.{name}"' in text


def test_signatures_lead_to_the_types_of_others_and_to_public_names(site: Path) -> None:
    text = text_of(site / "api" / "tickrig.html")
    can = "https://python-can.readthedocs.io/en/stable/bus.html#can.BusABC"
    for target in (can, "https://docs.python.org/3/library/pathlib.html#pathlib.Path"):
        assert f'href="{target}"' in text
    assert 'href="#tickrig.Rig" title="tickrig.emulators.rig.rig.Rig"' in text
