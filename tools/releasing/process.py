"""Commands that a release runs, and the one error of all of it."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Any


class ReleaseError(Exception):
    """No release can be made of this: the message says why, in a line."""


def run(*words: str | Path, **how: Any) -> str:
    """Run a command and return what it said; ReleaseError, with its last line, if it fails."""
    done = subprocess.run(words, capture_output=True, text=True, check=False, **how)
    if done.returncode:
        last = (done.stderr.strip() or done.stdout.strip() or "nothing").splitlines()[-1]
        name = " ".join([Path(words[0]).name, *map(str, words[1:4])])
        raise ReleaseError(f"{name}: status {done.returncode}: {last}")
    return done.stdout
