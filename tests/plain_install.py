"""What happens where no extra is installed: run in a process of its own by `test_commands`.

Reads lines `MODULE:FUNCTION COMMAND WORD...`; writes a line of JSON for each: exit status,
standard output, standard error.
"""

from __future__ import annotations

import contextlib
import io
import json
import sys
import traceback
from collections.abc import Sequence
from importlib.machinery import ModuleSpec, PathFinder
from importlib.metadata import EntryPoint
from types import ModuleType


class Without:
    """Finds modules as Python does, but these packages nowhere."""

    def __init__(self, packages: Sequence[str]) -> None:
        self._packages = frozenset(packages)

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if name.partition(".")[0] in self._packages:
            return None
        return PathFinder.find_spec(name, path, target)


def called(point: str, script: str, *words: str) -> tuple[object, str, str]:
    """Call a console script as its wrapper does."""
    sys.argv = [script, *words]
    out, err = io.StringIO(), io.StringIO()
    status: object = 1
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            status = EntryPoint(script, point, "console_scripts").load()()
        except SystemExit as end:
            status = end.code
        except BaseException:  # as the interpreter does
            traceback.print_exc()
    return status or 0, out.getvalue(), err.getvalue()


if __name__ == "__main__":
    sys.meta_path[sys.meta_path.index(PathFinder)] = Without(sys.argv[1].split(","))
    for line in sys.stdin:
        print(json.dumps(called(*line.split())), file=sys.__stdout__)
