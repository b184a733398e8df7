"""Import the host half without POSIX modules: a process of its own, run by `test_windows`.

What others need of them is loaded before. Writes a line for each module that cannot be imported.
"""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.abc import MetaPathFinder
from pathlib import Path

ROOT = Path(__file__).parents[1]
POSIX = {"curses", "fcntl", "grp", "pty", "pwd", "readline", "resource", "syslog", "termios", "tty"}
MODULES = [
    ".".join(("tickrig", *path.relative_to(ROOT).with_suffix("").parts)).removesuffix(".__init__")
    for floor in ("wire", "host")
    for path in sorted((ROOT / floor).rglob("*.py"))
]


class Missing(MetaPathFinder):
    """Finds no module of POSIX."""

    def find_spec(self, name: str, path: object, target: object = None) -> None:
        if name in POSIX:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


if __name__ == "__main__":
    for name in MODULES:
        import_module(name)
    for name in [*sys.modules]:
        if name.partition(".")[0] in {"tickrig", *POSIX}:
            del sys.modules[name]
    sys.meta_path.insert(0, Missing())
    for name in MODULES:
        try:
            import_module(name)
        except ImportError as error:
            print(f"{name}: {error}")
    print(len(MODULES), "modules")
