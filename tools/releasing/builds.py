"""Builds of a release: the source distribution of a tag, and the wheels of that."""

from __future__ import annotations

import sys
import tarfile
from pathlib import Path

from releasing.process import run
from releasing.tree import ROOT

SDIST = "import sys; from setuptools import build_meta as b; b.build_sdist(sys.argv[1])"


def build_sdist(tag: str, folder: Path, environment: dict[str, str]) -> Path:
    """Build the source distribution out of what git has, so that nothing else gets in."""
    tree = folder / "tree"
    archive = folder / "tree.tar"
    run("git", "archive", "--output", archive, tag, cwd=ROOT)
    with tarfile.open(archive) as packed:
        packed.extractall(tree, filter="data")
    run(sys.executable, "-c", SDIST, folder, cwd=tree, env=environment)
    return _only(folder, "*.tar.gz")


def build_wheel(sdist: Path, folder: Path, environment: dict[str, str]) -> Path:
    """Build a wheel of a source distribution."""
    print(f"building the {folder.name} wheel", flush=True)
    pip = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation"]
    run(*pip, "--no-cache-dir", "--wheel-dir", folder, sdist, cwd=folder.parent, env=environment)
    return _only(folder, "*.whl")


def _only(folder: Path, pattern: str) -> Path:
    """Return the one file that a build has left."""
    (path,) = folder.glob(pattern)
    return path
