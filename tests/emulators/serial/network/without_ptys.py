"""Run emulators where no module of POSIX can be imported; a process of its own."""

from __future__ import annotations

import sys
from importlib import import_module

from click.testing import CliRunner

from tests.without_posix import POSIX, Missing

MAINS = [f"tickrig.emulators.{name}.cli" for name in ("rrc", "rtc_lite", "rh3", "urg")]

if __name__ == "__main__":
    import serial.rfc2217  # noqa: F401 - it has the modules of its own that it wants

    for name in [*sys.modules]:
        if name.partition(".")[0] in {"tickrig", *POSIX}:
            del sys.modules[name]
    sys.meta_path.insert(0, Missing())
    for module in MAINS:
        main = import_module(module).main
        for words in ("--serve rfc2217://0 --scenario -", "--link x"):
            result = CliRunner().invoke(main, words.split(), input="0.02 end\n")
            print(result.exit_code, result.stderr.splitlines()[-1], result.exception)
