"""Classes in a user's file, in the notation `FILE.py:Class`."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType
from typing import Any, Final

SUFFIX: Final = ".py"


def find_class(spec: str, base: type[Any]) -> type[Any]:
    """Run a Python file of the user, and return one of its classes.

    Args:
        spec: file and class in the form `FILE.py:Class`.
        base: base class that the class must have.

    Raises:
        ValueError: the text has another form, the file cannot be found or run, or it has no such
            class.
    """
    file, colon, name = spec.rpartition(":")
    if not colon or not file.endswith(SUFFIX):
        raise ValueError(f"{spec!r} is not FILE{SUFFIX}:Class")
    module = _run(Path(file))
    found = getattr(module, name, None)
    if not (isinstance(found, type) and issubclass(found, base)):
        known = ", ".join(_classes(module, base)) or "none"
        noun = "component" if base.__name__.endswith("Component") else base.__name__
        raise ValueError(f"{file} has no {noun} {name!r}; it has {known}")
    return found


def explain_error(error: BaseException, file: str = "") -> str:
    """Describe an error in a Python file of the user in one line, with file and line if known."""
    if isinstance(error, SyntaxError) and error.filename == file:
        return f"line {error.lineno}: {error.msg}"
    import traceback  # noqa: PLC0415 - slow

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
    """Run a user's file as a separate module that can import its neighbours."""
    module = ModuleType(f"_user_{path.stem}")
    sys.modules[module.__name__] = module  # dataclasses look for it there
    sys.path.insert(0, str(path.parent))
    try:
        exec(compile(path.read_bytes(), str(path), "exec"), vars(module))
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror}") from None
    except Exception as error:  # a user's file may raise anything
        raise ValueError(f"{path}: {explain_error(error, str(path))}") from None
    return module


def _classes(module: ModuleType, base: type[Any]) -> list[str]:
    return [
        name
        for name, value in vars(module).items()
        if isinstance(value, type)
        and issubclass(value, base)
        and value.__module__ == module.__name__
    ]
