"""Components by name: ours, and those of a user's file (`FILE.py:Class`)."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Final

from tickrig.device.rtc_lite.component import Component
from tickrig.device.rtc_lite.relays import Echo, LiteA, LiteB

COMPONENTS: Final[Mapping[str, type[Component]]] = MappingProxyType(
    {"echo": Echo, "lite-a": LiteA, "lite-b": LiteB}
)

SUFFIX: Final = ".py"


def find_component(spec: str) -> type[Component]:
    """Return the component that a name or `FILE.py:Class` stands for.

    Raises:
        ValueError: there is none, its file cannot be run, or no PIC has room for it.
    """
    if spec in COMPONENTS:
        return COMPONENTS[spec]
    file, colon, name = spec.rpartition(":")
    if not colon or not file.endswith(SUFFIX):
        raise ValueError(f"no node {spec!r}; known: {', '.join(COMPONENTS)}, or FILE.py:Class")
    kind = _find_class(_run(Path(file)), file, name)
    try:
        kind()
    except Exception as error:  # a user's constructor may raise anything
        raise ValueError(f"{spec}: {told(error, file)}") from None
    return kind


def told(error: Exception, file: str) -> str:
    """Say in a line what went wrong in a user's file, and where."""
    if isinstance(error, SyntaxError) and error.filename == file:
        return f"line {error.lineno}: {error.msg}"
    lines = [
        frame.lineno
        for frame in traceback.extract_tb(error.__traceback__)
        if frame.filename == file
    ]
    place = f"line {lines[-1]}: " if lines else ""
    text = " ".join(str(error).split())
    if isinstance(error, ValueError):
        return f"{place}{text}"
    return f"{place}{type(error).__name__}: {text}"


def _run(path: Path) -> ModuleType:
    """Run a user's file as a module of its own, which finds its neighbours."""
    module = ModuleType(f"_rtc_lite_{path.stem}")
    sys.modules[module.__name__] = module  # dataclasses look for it there
    sys.path.insert(0, str(path.parent))
    try:
        exec(compile(path.read_bytes(), str(path), "exec"), vars(module))
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror}") from None
    except Exception as error:  # a user's file may raise anything
        raise ValueError(f"{path}: {told(error, str(path))}") from None
    return module


def _find_class(module: ModuleType, file: str, name: str) -> type[Component]:
    known = [
        key
        for key, value in vars(module).items()
        if isinstance(value, type)
        and issubclass(value, Component)
        and value.__module__ == module.__name__
    ]
    found = getattr(module, name, None)
    if not (isinstance(found, type) and issubclass(found, Component)):
        raise ValueError(f"{file} has no component {name!r}; it has {', '.join(known) or 'none'}")
    return found
