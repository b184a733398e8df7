from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_the_picture_of_the_architecture_is_true() -> None:
    done = subprocess.run([sys.executable, ROOT / "tools/picture", "--check"], check=False)
    assert done.returncode == 0, "run tools/picture"
