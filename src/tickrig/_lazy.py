"""What an import of tickrig does: names are imported when somebody asks for them (PEP 562)."""

from __future__ import annotations

import sys

TYPE_CHECKING = False  # as typing has it: importing typing would take longer than all else here
if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


def lazy(
    package: str, names: Mapping[str, tuple[str, ...]]
) -> tuple[list[str], Callable[[str], object], Callable[[], list[str]]]:
    """Make a package offer names of modules that are not imported yet.

    Args:
        package: its name, for the message about a name that it has not.
        names: what it offers of each module.

    Returns:
        Its `__all__`, `__getattr__` and `__dir__`; `__version__` is found, and is in no list.
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
    """Stands at the top of a module for another that is imported when it is first used.

    Type checkers see the import that it replaces:

        if TYPE_CHECKING:
            from package import slow
        else:
            slow = LazyModule("package.slow")

    Args:
        name: of the module, in full.
    """

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, name: str) -> object:
        """Return what the module has under this name."""
        from importlib import import_module  # noqa: PLC0415 - not before it is needed

        found: object = getattr(import_module(self._name), name)
        return found


def tell_pyserial() -> None:
    """Let pyserial find the handler of `tickrig://`, if it is loaded already.

    Else that is done when the first line is offered under a name; so an import costs nothing.
    """
    packages = getattr(sys.modules.get("serial"), "protocol_handler_packages", None)
    if packages is not None and "tickrig.emulators.serial.outside" not in packages:
        packages.append("tickrig.emulators.serial.outside")
