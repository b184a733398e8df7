"""Words that were given up stay away: identifiers of `tests/retired.txt`, and phrases of the pages.

Why, and which word stands for each identifier now: docs/glossary.md.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest

from tests.import_graph import ROOT, modules

RETIRED = frozenset(
    line
    for line in (Path(__file__).parent / "retired.txt").read_text("utf-8").splitlines()
    if line and not line.startswith("#")
)


def names(tree: ast.AST) -> Iterator[str]:
    """Yield the names of classes, functions, their arguments, attributes, fields."""
    for node in ast.walk(tree):
        match node:
            case ast.ClassDef(name=name, body=body):
                yield name
                yield from _fields(body)
            case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name):
                yield name
            case ast.Attribute(attr=name) | ast.arg(arg=name):
                yield name
            case ast.Module(body=body):
                yield from _fields(body)


def _fields(body: list[ast.stmt]) -> Iterator[str]:
    """Yield what stands in the body of a class or a module: fields, constants."""
    for statement in body:
        match statement:
            case ast.Assign(targets=[ast.Name(id=name)]) | ast.AnnAssign(target=ast.Name(id=name)):
                yield name


def test_names_are_found() -> None:
    source = (
        "class A:\n    b = 1\n    c: int\n    def d(self, e):\n        self.f = l = e.g\nH = 1\n"
    )
    assert {*names(ast.parse(source))} == {"A", "b", "c", "d", "self", "e", "f", "g", "H"}


def retired(module: str, text: str) -> list[str]:
    """Return the retired names of a module; parsed is what has such a word at all."""
    words = {word.lstrip("_") for word in re.findall(r"\w+", text)}
    inside = () if RETIRED.isdisjoint(words) else names(ast.parse(text))
    return [name for name in (*module.split("."), *inside) if name.lstrip("_") in RETIRED]


def test_retired_names_are_found() -> None:
    assert retired("tickrig.drum", "def f(__Beat): ...\n") == ["__Beat"]
    assert retired("tickrig.Beat", "def f(a): Beat = a\n") == ["Beat"]


def test_no_retired_word_is_left() -> None:
    found = [
        f"{path.relative_to(ROOT)}: {name}"
        for module, path in modules().items()
        for name in retired(module, path.read_text("utf-8"))
    ]
    assert found == []


PHRASES = re.compile(
    r"""\b(?:
    told | tells?\ (?:of|in|all|what) | nobody | somebody | whoever | anew | begun | meanwhile
    | for\ ever | for\ life | all\ else | as\ ever | is\ none\ of | that\ is\ none
    | what\ is\ no | none\ of\ ours | (?:is|are)\ passed\ (?:over|by) | passes?\ by
    | mend(?:s|ed|ing)? | is\ said | unless\ (?:said|told) | hands\ and\ eyes | knows?\ of\ no
    | is\ (?:asked|looked|waited)\ for | is\ looked\ at | proven\ by | held\ against | heard
    | is\ (?:not\ )?to\ be\ had | speed\ of\ life | in\ silence | is\ warned\ of | lets?\ go
    | that\ is\ so | it\ is\ so | makes?\ up\ for | comes?\ of\ (?:it|them) | what\ befalls
    )\b""",
    re.VERBOSE | re.IGNORECASE,
)
"""What reads as translated: say who does what, in the verb that the field has for it."""

ODD = re.compile(
    r"""(?:
    ^(?:Say|Know|Hear|Put\ up\ with|Give\ (?:the|its|all)|Let\ (?:it|go|pass)|Be\ (?:as|told))\b
    | \bsays?\ whether\b | \bas\ people\ \w+ | \bwhat\ (?:it\ is\ like|cannot\ be)\b
    | \bput\ up\ with\b | \bso\ many\b
    )""",
    re.VERBOSE,
)
"""The same in docstrings and messages, beside `PHRASES`."""

CLEAN = ("device", "emulators", "host", "src/tickrig", "wire")
"""Folders whose docstrings, help and messages have no such phrases."""

NOT_YET_CLEAN = {
    *("wire/rtc_types/rtc.py", "wire/rtc_types/iis.py"),  # written by tools/rtc-types
    *("emulators/commands/new_cli.py", "emulators/commands/doctor.py", "host/text/notebook.py"),
    *("src/tickrig/testing/labgrid.py", "src/tickrig/testing/robot.py"),
}

NOT_YET = {
    "CHANGELOG.md",
    "docs/reference/canopen/conformance.md",  # written by tools/conform-stacks
}
"""Pages that may have such phrases still."""

PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])


def phrases(text: str) -> list[str]:
    """Return those of a page, but for code, quoted words, and rules that commands print."""
    text = re.sub(r"^ *```.*?^ *```", "", text, flags=re.DOTALL | re.MULTILINE)
    text = re.sub(r"^\| rule \|.*?\n\n", "", text, flags=re.DOTALL | re.MULTILINE)
    text = re.sub(r'`[^`]*`|"[^"\n]*"', "", text)
    return [" ".join(found.split()) for found in PHRASES.findall(" ".join(text.split()))]


def test_phrases_are_found() -> None:
    text = "Nobody is\ntold `told` of\nwhat is no frame.\n\n```sh\nmended\n```\n"
    assert phrases(text) == ["Nobody", "told", "what is no"]


@pytest.mark.parametrize("page", PAGES, ids=[page.name for page in PAGES])
def test_no_page_has_a_retired_phrase(page: Path) -> None:
    if str(page.relative_to(ROOT)) not in NOT_YET:
        assert phrases(page.read_text("utf-8")) == []


def texts(module: Path) -> Iterator[tuple[int, str]]:
    """Yield docstrings, help and messages of a module, without code; each with its line."""
    for node in ast.walk(ast.parse(module.read_text("utf-8"))):
        match node:
            case ast.Constant(value=str(text)) if " " in text.strip():
                text = re.sub(r"^ *(?:>>>|\.\.\.) .*$", "", text, flags=re.MULTILINE)
                yield node.lineno, re.sub(r"^ *\w+: ", "", text, flags=re.MULTILINE)


def test_docstrings_and_messages_are_texts(tmp_path: Path) -> None:
    module = tmp_path / "a.py"
    module.write_text('"""Say whether.\n\nArgs:\n    told: who.\n"""\nf"{a} is none of {b}"\n')
    assert [text.split() for _, text in texts(module)] == [
        ["Say", "whether.", "Args:", "who."],
        ["is", "none", "of"],
    ]


def modules_of(folders: Iterable[str]) -> list[Path]:
    found = {path for folder in folders for path in (ROOT / folder).rglob("*.py")}
    found |= {ROOT / folder for folder in folders if folder.endswith(".py")}
    return sorted(path for path in found if str(path.relative_to(ROOT)) not in NOT_YET_CLEAN)


@pytest.mark.parametrize("folder", CLEAN)
def test_no_docstring_or_message_has_a_retired_phrase(folder: str) -> None:
    found = [
        f"{module.relative_to(ROOT)}:{line}: {phrase}"
        for module in modules_of([folder])
        for line, text in texts(module)
        for phrase in (*phrases(text), *ODD.findall(text.strip()))
    ]
    assert found == []


FRAGMENT = re.compile(
    r"^ +\*{0,2}(?P<name>[a-z_]\w*): (?P<entry>"
    r"(?:of|by|as|in|for|to|from|with|on|if|at|per|above|its|after|before|under|such|so|what|how|why"
    r"|when|where|which|until|without|through|only|same|[0-9][\w.]*)(?![-\w]).*)$",
    re.MULTILINE,
)
"""An entry of Args or Attributes that cannot be read without its name: `index: of its object`."""


def docstrings(module: Path) -> Iterator[tuple[int, str]]:
    for node in ast.walk(ast.parse(module.read_text("utf-8"))):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            yield getattr(node, "lineno", 1), ast.get_docstring(node) or ""


@pytest.mark.parametrize("folder", CLEAN)
def test_each_entry_of_a_docstring_can_be_read_alone(folder: str) -> None:
    found = [
        f"{module.relative_to(ROOT)}:{line}: {entry['name']}: {entry['entry']}"
        for module in modules_of([folder])
        for line, text in docstrings(module)
        for entry in FRAGMENT.finditer(text)
    ]
    assert found == []


def test_fragments_are_found() -> None:
    text = "Args:\n    index: of its object.\n    sub: sub-index.\n    low: 1 to 3.\n"
    assert [entry["name"] for entry in FRAGMENT.finditer(text)] == ["index", "low"]
