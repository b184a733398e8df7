"""The checkout: its tags, its changes, the version that it declares."""

from __future__ import annotations

import ast
import os
import subprocess
from pathlib import Path
from typing import Final

from releasing.process import ReleaseError

ROOT: Final = Path(__file__).resolve().parents[2]
PACKAGE: Final = Path("src", "tickrig", "_version.py")
SHOWN: Final = 3
"""So many changed files of a tree are named."""


def git(*words: str) -> str:
    """Return what git says, nothing where it fails."""
    done = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=False)
    return done.stdout.rstrip() if done.returncode == 0 else ""


def commit_of(tag: str) -> str:
    """Return the commit of a tag, nothing if there is no such tag."""
    return git("rev-parse", "--verify", "--quiet", f"refs/tags/{tag}^{{commit}}")


def check_tag(tag: str) -> None:
    """See that this checkout is that of a tag, and that the tag is that of its version."""
    if not (commit := commit_of(tag)):
        there = git("tag").replace(os.linesep, " ") or "none"
        raise ReleaseError(f"there is no tag {tag}; there are: {there}")
    if commit != (head := git("rev-parse", "HEAD")):
        raise ReleaseError(f"{tag} is {commit[:10]}, this tree is {head[:10]}: git checkout {tag}")
    if changed := changes():
        raise ReleaseError(f"this tree is not that of {tag}: {changed}")
    if tag != f"v{(version := declared_version())}":
        raise ReleaseError(f"{tag} is the tag, but {PACKAGE} says {version}")


def changes() -> str:
    """Return what is not committed, some of it by name."""
    changed = [" ".join(line.split()) for line in git("status", "--porcelain").splitlines()]
    more = f" and {len(changed) - SHOWN} more" if len(changed) > SHOWN else ""
    return ", ".join(changed[:SHOWN]) + more


def declared_version() -> str:
    """Return the version that the package declares."""
    for node in ast.parse((ROOT / PACKAGE).read_text("utf-8")).body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__version__":
            return str(ast.literal_eval(node.value))
    raise ReleaseError(f"{PACKAGE} has no __version__")


def declare_version(version: str) -> None:
    """Have the package declare another version."""
    text = (ROOT / PACKAGE).read_text("utf-8")
    now = text.replace(f'__version__ = "{declared_version()}"', f'__version__ = "{version}"')
    (ROOT / PACKAGE).write_text(now, "utf-8")
