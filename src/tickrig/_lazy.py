"""Lazy imports: names are imported at their first use (PEP 562)."""

from __future__ import annotations

import sys

TYPE_CHECKING = False  # as typing has it: importing typing takes longer than the rest here
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


def lazy(
    package: str, names: Mapping[str, tuple[str, ...]]
) -> tuple[list[str], Callable[[str], object], Callable[[], list[str]]]:
    """Make a package export names of modules that are not imported yet.

    Args:
        package: name of the package, for the message about an unknown name.
        names: the exported names of each module.

    Returns:
        The package's `__all__`, `__getattr__` and `__dir__`. `__version__` is found, but not
        listed.
    """
    modules = {name: module for module, offered in names.items() for name in offered}

    def find(name: str) -> object:
        if name not in modules:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        from importlib import import_module  # noqa: PLC0415 - not before it is needed

        home = import_module(modules[name])
        if not hasattr(home, name):  # a module of that package
            return import_module(f"{modules[name]}.{name}")
        found: object = getattr(home, name)
        return found

    listed = sorted(modules.keys() - {"__version__"})
    return listed, find, lambda: listed


class LazyModule:
    """A placeholder for a module that is imported at its first use.

    Type checkers see the import that it replaces:

        if TYPE_CHECKING:
            from package import slow
        else:
            slow = LazyModule("package.slow")

    Args:
        name: full name of the module.
    """

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, name: str) -> object:
        """Return the attribute of the module."""
        from importlib import import_module  # noqa: PLC0415 - not before it is needed

        found: object = getattr(import_module(self._name), name)
        return found


def tell_pyserial() -> None:
    """Register the handler of `tickrig://` with pyserial if pyserial is loaded already.

    If pyserial is not loaded yet, the handler is registered when the first line gets a name.
    Importing tickrig therefore takes no extra time.
    """
    packages = getattr(sys.modules.get("serial"), "protocol_handler_packages", None)
    if packages is not None and "tickrig.emulators.serial.outside" not in packages:
        packages.append("tickrig.emulators.serial.outside")
