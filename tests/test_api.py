"""The five places that users import from: their names, and that nothing else is needed."""

from __future__ import annotations

import ast
import pickle
import re
import runpy
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from pathlib import Path

import griffe
import pytest

ROOT = Path(__file__).parents[1]
PLACES = ("tickrig", "tickrig.device", "tickrig.host", "tickrig.rtc", "tickrig.testing")
NAMES = {name: place for place in PLACES for name in import_module(place).__all__}
TOOL = runpy.run_path(str(ROOT / "tools" / "api"))
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))

SHOWN = [ROOT / "README.md", *EXAMPLES, *sorted((ROOT / "docs").rglob("*.md"))]
MEANT_TWICE = {"ReturnCode"}
"""Names that the component model of devices has too."""


@cache
def defined() -> Counter[str]:
    """Count how often each name is defined in the product."""
    return Counter(
        name
        for floor in ("wire", "device", "host", "emulators")
        for path in (ROOT / floor).rglob("*.py")
        for name in re.findall(r"^ *(?:class|def) (\w+)", path.read_text("utf-8"), re.MULTILINE)
    )


def typed_names(place: str) -> dict[str, str]:
    """Return what type checkers see: names, and the modules that they come from."""
    file = import_module(place).__file__
    assert file is not None
    return {
        name.name: str(node.module)
        for node in ast.walk(ast.parse(Path(file).read_text("utf-8")))
        if isinstance(node, ast.ImportFrom)
        and node.module not in {"tickrig._lazy", "tickrig._version"}
        for name in node.names
    }


@pytest.mark.parametrize("place", PLACES)
def test_an_exception_is_shown_by_the_name_that_users_import(place: str) -> None:
    offered = [getattr(import_module(place), name) for name in import_module(place).__all__]
    errors = [one for one in offered if isinstance(one, type) and issubclass(one, BaseException)]
    assert {error.__module__ for error in errors} <= {place}
    assert all(pickle.loads(pickle.dumps(error)) is error for error in errors)


@pytest.mark.parametrize("place", PLACES)
def test_a_place_offers_at_run_time_what_type_checkers_see(place: str) -> None:
    module = import_module(place)
    typed = typed_names(place)
    assert sorted(typed) == module.__all__
    assert set(module.__all__) <= set(dir(module))
    for name, path in typed.items():
        assert getattr(module, name) is getattr(import_module(path), name)


@pytest.mark.parametrize("place", PLACES)
def test_a_name_that_a_place_has_not_is_an_attribute_error(place: str) -> None:
    with pytest.raises(AttributeError, match=f"module '{place}' has no attribute 'nothing'"):
        import_module(place).nothing  # noqa: B018 - that it raises


@pytest.mark.parametrize("place", PLACES)
def test_a_place_imports_nothing_before_a_name_is_asked_for(place: str) -> None:
    program = f"import sys; old = {{*sys.modules}}; import {place}; print(*{{*sys.modules}} - old)"
    words = [sys.executable, "-S", "-c", program]
    said = subprocess.check_output(words, text=True, env={"PYTHONPATH": str(ROOT / "src")})
    assert {*said.split()} - {"__future__"} == {"tickrig", "tickrig._lazy", place}


@pytest.fixture(scope="module")
def package() -> griffe.Module:
    """Read the package, without importing it."""
    found = griffe.load("tickrig", search_paths=[ROOT / "src"])
    assert isinstance(found, griffe.Module)
    return found


def test_what_is_public_is_what_the_file_says(package: griffe.Module) -> None:
    found = list(TOOL["lines"](package))
    listed = (ROOT / "tests" / "api.txt").read_text("utf-8").splitlines()
    assert [line for line in listed if line not in found] == [], "gone: this breaks programs"
    assert found == listed, "new: tools/api --renew"


def untold(path: str, call: griffe.Function, docstring: griffe.Docstring | None) -> Iterator[str]:
    """Give what a docstring does not tell: all, or arguments."""
    if docstring is None:
        yield path
        return
    names = {each.name.lstrip("*") for each in call.parameters} - {"self", "cls"}
    told = re.findall(r"\w+", docstring.value)
    yield from (f"{path}({name})" for name in sorted(names.difference(told)))


def untold_of_class(path: str, found: griffe.Class) -> Iterator[str]:
    """Give what its docstring and those of its methods do not tell; a base may tell it."""
    for name, member in found.all_members.items():
        method = member.final_target if isinstance(member, griffe.Alias) else member
        if not isinstance(method, griffe.Function) or not method.is_public:
            continue
        owners = [owner for owner in (found, *found.mro()) if name in owner.members]
        if name == "__init__":
            yield from untold(path, method, found.docstring or owners[0].docstring)
        elif not name.startswith("__"):
            ways = [
                {*untold(f"{path}.{name}", method, each.members[name].docstring)} for each in owners
            ]
            yield from set.intersection(*ways)


@pytest.mark.parametrize("place", PLACES)
def test_docstrings_of_what_is_public_tell_all_arguments(
    package: griffe.Module, place: str
) -> None:
    missing: list[str] = []
    for name, member in TOOL["public"](package, place).members.items():
        found = member.final_target if name in NAMES else None
        if isinstance(found, griffe.Class):
            missing += untold_of_class(f"{place}.{name}", found)
        elif isinstance(found, griffe.Function):
            missing += untold(f"{place}.{name}", found, found.docstring)
    assert missing == []


@pytest.mark.parametrize("name", NAMES)
def test_a_public_name_means_one_thing(name: str) -> None:
    assert defined()[name] <= (3 if name in MEANT_TWICE else 1)


def programs(page: Path) -> str:
    text = page.read_text("utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    return text if page.suffix == ".py" else "".join(blocks)


def inner_imports(program: str) -> Iterator[tuple[str, ast.ImportFrom]]:
    """Give the imports of tickrig from elsewhere than the five places, with their line."""
    for node in ast.walk(ast.parse(program)):
        match node:
            case ast.ImportFrom(module=str(module)) if module.startswith("tickrig."):
                if module not in PLACES:
                    yield program.splitlines()[node.lineno - 1], node


@pytest.mark.parametrize("page", SHOWN, ids=[page.name for page in SHOWN])
def test_programs_that_users_read_import_public_names_from_the_five_places(page: Path) -> None:
    for line, node in inner_imports(programs(page)):
        known = {name.name for name in node.names} & NAMES.keys()
        assert not known or (known <= MEANT_TWICE and "device" in str(node.module)), line


@pytest.mark.parametrize("page", EXAMPLES, ids=[page.name for page in EXAMPLES])
def test_what_is_not_public_is_marked_in_examples(page: Path) -> None:
    for line, _ in inner_imports(programs(page)):
        assert line.endswith("  # internal"), line


def test_the_first_page_imports_public_names_alone() -> None:
    assert [line for line, _ in inner_imports(programs(ROOT / "README.md"))] == []


def test_what_the_upgrading_page_says_to_import_is_there() -> None:
    page = (ROOT / "docs" / "howto/upgrading.md").read_text("utf-8")
    lines = re.findall(r"`(from (tickrig[\w.]*) import [^`]+)`", page)
    assert {place for _, place in lines} <= {*PLACES}
    assert len(lines) > 20
    for line, _ in lines:
        exec(line, {})
