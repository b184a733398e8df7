"""What a command line imports: run in a process of its own by `test_start_up`.

Reads lines `MODULE:FUNCTION COMMAND WORD...`, where a last word `TAB` stands for that key;
writes for each the names of the modules that it imports beyond click, as a line of JSON.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import sys
from importlib import import_module


def imported(point: str, command: str, *words: str) -> list[str]:
    """Call a console script as its wrapper does; no two calls in one process."""
    before = set(sys.modules)
    if words[-1] == "TAB":
        variable = f"_{command.replace('-', '_').upper()}_COMPLETE"
        line = [command, *words[:-1], ""]
        os.environ |= {
            variable: "bash_complete",
            "COMP_WORDS": " ".join(line),
            "COMP_CWORD": str(len(line) - 1),
        }
        words = ()
    sys.argv = [command, *words]
    sys.stdout = sys.stderr = io.TextIOWrapper(io.BytesIO())
    with contextlib.suppress(SystemExit):
        module, _, name = point.partition(":")
        getattr(import_module(module), name)()
    return sorted(sys.modules.keys() - before)


if __name__ == "__main__":
    output = sys.stdout
    for line in sys.stdin.read().splitlines():
        if (child := os.fork()) == 0:
            print(json.dumps(imported(*line.split())), file=output, flush=True)
            os._exit(0)
        os.waitpid(child, 0)
