"""The compiled build: which modules it compiles, and that it does what the pure one does."""

from __future__ import annotations

import ast
import copy
import hashlib
import importlib
import importlib.util
import inspect
import os
import pickle
import subprocess
import sys
import tomllib
from contextlib import nullcontext
from enum import Enum
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from typing import Any, Final

import pytest

import tickrig
import tickrig.device
import tickrig.host
import tickrig.rtc
import tickrig.testing
from tests.device.canopen.profile_objects import DRIVE, make_dictionary
from tests.import_graph import modules
from tickrig.device.canopen.ds402 import Ds402
from tickrig.device.canopen.models.epos import make_epos
from tickrig.device.canopen.stack import make_slave
from tickrig.device.horizon import Horizon
from tickrig.device.physical import InputBank
from tickrig.device.urg.world import UrgParameters
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.wire.can import CanFrame, parse_log
from tickrig.wire.modbus import Request
from tickrig.wire.scip import Command
from tickrig.wire.uart import UartSetting

ROOT: Final = Path(__file__).parents[1]
TABLE: Final = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["tickrig"]
ROOMS: Final[list[str]] = TABLE["compiled"]["rooms"]
LEFT_OUT: Final[dict[str, str]] = TABLE["compiled"]["left-out"]


def found(pattern: str) -> set[Path]:
    return {path for path in ROOT.glob(pattern) if path.stem != "__init__"}


def compiled_modules() -> list[str]:
    paths = set().union(*map(found, ROOMS)) - set().union(*map(found, LEFT_OUT))
    return sorted("tickrig." + ".".join(p.relative_to(ROOT).with_suffix("").parts) for p in paths)


@pytest.mark.parametrize("pattern", [*ROOMS, *LEFT_OUT])
def test_each_line_of_the_list_names_modules(pattern: str) -> None:
    assert found(pattern)


def test_what_is_left_out_would_be_compiled_otherwise_and_has_a_reason() -> None:
    assert set().union(*map(found, LEFT_OUT)) <= set().union(*map(found, ROOMS))
    assert all(LEFT_OUT.values())


def test_the_pure_floors_are_compiled() -> None:
    assert {"wire/**/*.py", "device/**/*.py"} <= set(ROOMS)


def imported(path: Path) -> set[str]:
    """Return the top-level names that a module imports."""
    nodes = list(ast.walk(ast.parse(path.read_text("utf-8"))))
    froms = {node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)}
    plain = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    return {name.partition(".")[0] for name in froms | plain}


def test_what_compiled_modules_import_of_others_is_there_when_they_are_compiled() -> None:
    files = [ROOT / name.removeprefix("tickrig.").replace(".", "/") for name in compiled_modules()]
    names = set().union(*(imported(file.with_suffix(".py")) for file in files))
    others = names - sys.stdlib_module_names - {"tickrig", "_typeshed"}
    assert others == {"crcmod"}  # NEEDED in setup.py


def test_an_installation_is_compiled_whole_or_not_at_all() -> None:
    for name in compiled_modules():
        spec = importlib.util.find_spec(name)
        assert spec is not None
        assert str(spec.origin).endswith(tuple(EXTENSION_SUFFIXES)) is tickrig.compiled, name


def test_a_compiled_installation_has_the_kernel_too() -> None:
    assert tickrig.kernel or not tickrig.compiled


def test_a_compiled_module_has_its_source_beside_it() -> None:
    package = Path(tickrig.__file__).parent
    for name in compiled_modules():
        assert (package.parent / name.replace(".", "/")).with_suffix(".py").is_file()


def history(seconds: int) -> str:
    """Run two drives and a master that moves one of them; a hash over (time, frame)."""
    wire, heard = CanWire(), hashlib.sha256()
    wire.observers.append(lambda at_us, frame: heard.update(f"{at_us} {frame}\n".encode()))
    plain = make_slave(make_dictionary({DRIVE}), 5, application=Ds402)
    rig = Rig(*(Station(device, wire.end()) for device in (plain, make_epos(6))))
    master = wire.end()
    rig.run_for(100_000)
    for text in ("000#0100", *(f"606#2B406000{word}000000" for word in ("06", "07", "0F"))):
        master.send(rig.now_us, (CanFrame.parse(text),))
        rig.run_for(10_000)
    for text in ("606#2F60600003000000", "606#23FF6000E8030000", "606#4064600000000000"):
        master.send(rig.now_us, (CanFrame.parse(text),))
        rig.run_for(seconds * 300_000)
    return heard.hexdigest()


def test_both_builds_do_the_same() -> None:
    assert history(3) == "4a0f71aba09b197fc5d78be7089e0f1b147d7ab9d1b47a2e74a970da97fa6a9c"


KEPT: Final = {
    *("CanopenSlave", "Dictionary", "EntryDescription", "InputSignal", "LineSplitter"),
    *("OutputSignal", "Rh3Base", "Rig", "Urg"),
}
"""Public classes that nobody derives from where they are compiled (docs/howto/compiled.md)."""


def derivable(base: type) -> bool:
    own: Any = type("Own", (base,), {})
    try:
        own.__new__(own)
    except TypeError:
        return False
    return True


def test_of_the_public_classes_users_derive_from_all_but_those_of_the_page() -> None:
    doors = (tickrig, tickrig.device, tickrig.host, tickrig.rtc, tickrig.testing)
    public = {name: getattr(door, name) for door in doors for name in dir(door)}
    unlike = (Enum, tuple)  # made in other ways; CanFrame is a tuple
    classes = {n: c for n, c in public.items() if isinstance(c, type) and not issubclass(c, unlike)}
    assert {name for name, base in classes.items() if not derivable(base)} == (
        KEPT if tickrig.compiled else set()
    )
    page = (ROOT / "docs" / "howto/compiled.md").read_text("utf-8")
    assert not [name for name in KEPT if f"`{name}`" not in page]


def refuses(base: type, made: type) -> bool:
    """Return whether no instance of `made`, in Python, can be created if `base` is compiled."""
    if issubclass(made, Enum | tuple | BaseException) or getattr(base, "_is_protocol", False):
        return False
    return "allow_interpreted_subclasses=True" not in inspect.getsource(base).partition("class ")[0]


@pytest.mark.skipif(tickrig.compiled, reason="a compiled class has no source to look at")
def test_no_class_of_python_derives_from_a_compiled_one_that_refuses_it() -> None:
    compiled = set(compiled_modules())
    found = [
        f"{name}.{made.__name__}({base.__name__})"
        for name in modules().keys() - compiled
        for made in vars(importlib.import_module(name)).values()
        if isinstance(made, type) and made.__module__ == name
        for base in made.__mro__[1:]
        if base.__module__ in compiled and refuses(base, made)
    ]
    assert found == []


def test_a_compiled_caller_does_not_see_what_is_replaced(monkeypatch: pytest.MonkeyPatch) -> None:
    line = "(0000000000.010000) vcan0 705#7F"
    monkeypatch.setattr("tickrig.wire.can.parse_line", lambda line, number: number)
    assert isinstance(parse_log(line)[0], int) is not tickrig.compiled


def test_a_compiled_object_has_the_attributes_that_its_class_declares() -> None:
    with pytest.raises(AttributeError) if tickrig.compiled else nullcontext():
        Rig().nickname = "mine"  # type: ignore[attr-defined] # a user's, by the way


def test_types_are_checked_where_compiled_code_begins() -> None:
    with pytest.raises(TypeError) if tickrig.compiled else nullcontext():
        Horizon().until_us = "soon"  # type: ignore[assignment] # a user's mistake
    assert type(UrgParameters(noise=1).noise) is (float if tickrig.compiled else int)


def test_a_traceback_names_the_lines_of_the_sources() -> None:
    with pytest.raises(ValueError, match="no input 'label'") as told:
        InputBank().set("label", 1)
    file = told.traceback[-1].frame.code.raw.co_filename
    assert file.endswith("tickrig/device/physical.py") or not tickrig.compiled
    assert Path(file).is_absolute() is not tickrig.compiled


def test_a_profiler_sees_no_compiled_function() -> None:
    seen: set[str] = set()
    rig = Rig()
    sys.setprofile(lambda frame, event, _: seen.add(frame.f_code.co_name))
    try:
        rig.run_for(1_000)
    finally:
        sys.setprofile(None)
    assert ("run_to" in seen) is not tickrig.compiled


FROZEN: Final = (CanFrame(5), UrgParameters(), Request(6), Command("VV"), UartSetting(9_600))
"""Frozen values, of compiled modules and of others."""


@pytest.mark.parametrize("value", FROZEN, ids=[type(value).__name__ for value in FROZEN])
def test_frozen_values_are_pickled_and_copied(value: object) -> None:
    for copied in (pickle.loads(pickle.dumps(value)), copy.deepcopy(value), copy.copy(value)):
        assert copied == value
        assert type(copied) is type(value)


@pytest.mark.skipif(not tickrig.compiled, reason="the pure classes leave that to pickle")
def test_the_state_of_a_pure_object_is_refused() -> None:
    with pytest.raises(TypeError, match="no state of this build"):
        Horizon().__setstate__((None, {"until_us": 1}))  # type: ignore[attr-defined]


def mended(text: str, tmp_path: Path) -> str:
    """Let setup.py mend a file of C; return the file, or why it gave up."""
    source = tmp_path / "a.c"
    source.write_text(text)
    code = f"import setup, pathlib; setup.mend([pathlib.Path({str(source)!r})])"
    asked = [sys.executable, "-c", code, "--name"]
    done = subprocess.run(asked, cwd=ROOT, capture_output=True, text=True, check=False)
    return source.read_text() if done.returncode == 0 else done.stderr.strip()


INIT: Final = """
static int
A_init(PyObject *self, PyObject *args, PyObject *kwds)
{
    return 0;
}
"""
STATE: Final = """#include "__native_internal_tickrig.h"
{"__setstate__", (PyCFunction)CPyPickle_SetState, METH_O, NULL},
"""


def test_the_build_mends_what_mypyc_writes(tmp_path: Path) -> None:
    whole = mended(STATE + INIT, tmp_path)
    assert "return CPyPy_A_____init__(self, args, kwds) == NULL ? -1 : 0;" in whole
    assert "(PyCFunction)set_state, METH_O" in whole
    assert "static PyObject *set_state(" in whole


@pytest.mark.parametrize(
    ("written", "told"),
    [
        (STATE, "this mypyc writes nothing that calling_init in setup.py mends"),
        (INIT, "this mypyc writes nothing that setting_state in setup.py mends"),
        (
            STATE + INIT.replace("return 0;", "return -1;"),
            "this mypyc calls an __init__ in a way that setup.py does not know",
        ),
    ],
)
def test_the_build_ends_where_mypyc_writes_something_else(
    written: str, told: str, tmp_path: Path
) -> None:
    assert mended(written, tmp_path).endswith(told)


def test_a_source_tree_stays_pure_where_a_wheel_would_be_compiled(tmp_path: Path) -> None:
    """`TICKRIG_COMPILE` counts for wheels alone."""
    code = "import setup; print(setup.extensions())"
    asked = [sys.executable, "-c", code, "--name"]
    environment = os.environ | {"TICKRIG_COMPILE": "1"}
    done = subprocess.run(
        asked, cwd=ROOT, env=environment, capture_output=True, text=True, check=False
    )
    assert done.stdout.splitlines()[-1:] == ["[]"], done.stderr
