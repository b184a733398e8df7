"""What can be shown of Windows without one: `tools/check` has mypy look at the same.

Neither shows that a bus of PEAK or Kvaser works there.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from tests.without_posix import MODULES, POSIX

ROOT = Path(__file__).parents[1]


def test_the_host_half_is_imported_without_posix_modules() -> None:
    words = [sys.executable, str(ROOT / "tests" / "without_posix.py")]
    said = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    assert said == f"{len(MODULES)} modules\n"
    assert {"termios", "fcntl", "pty"} <= POSIX
