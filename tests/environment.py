"""Environments of their own with our wheel in them, as users have them; nothing is downloaded.

The workers of a run share one build of the wheel, and of each environment a template: that a file
of tests gets a copy saves the run 20 s of processor time.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import subprocess
import sys
import venv
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

import tickrig

ROOT = Path(__file__).parents[1]
STALE = shutil.ignore_patterns("__pycache__", "*.egg-info", ".*", "build")
BUILD = "import sys; from setuptools import build_meta as b; b.build_wheel(sys.argv[1])"
SHIM = '#!/bin/sh\nexec "{python}" -m {module} "$@"\n'


@dataclass(frozen=True)
class Environment:
    """A virtual environment that sees the dependencies of this one, but not its tickrig."""

    folder: Path

    @property
    def variables(self) -> dict[str, str]:
        """What a shell in it has."""
        return {
            "PATH": f"{self.folder / 'bin'}:/usr/bin:/bin",
            "HOME": str(self.folder),
            "PIP_NO_INDEX": "1",
            "PIP_NO_DEPS": "1",
            "PIP_NO_BUILD_ISOLATION": "0",
            "PIP_DISABLE_PIP_VERSION_CHECK": "1",
            "PIP_NO_CACHE_DIR": "1",
        }

    def run(self, *words: str | Path, cwd: Path, typed: str = "", status: int = 0) -> str:
        """Run a command and return what it printed; it has to end with this status."""
        done = subprocess.run(
            words,
            cwd=cwd,
            env=self.variables,
            input=typed,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == status, f"{words}: {done.stdout}{done.stderr}"
        return done.stdout

    def start(self, *words: str | Path, cwd: Path) -> subprocess.Popen[bytes]:
        """Start a command."""
        return subprocess.Popen(words, cwd=cwd, env=self.variables, stdout=subprocess.PIPE)

    def copy(self, folder: Path) -> Environment:
        """Return a copy, whose commands run its own Python."""
        shutil.copytree(self.folder, folder, symlinks=True)
        for command in (folder / "bin").iterdir():
            if not command.is_symlink():
                text = command.read_text("utf-8")
                command.write_text(text.replace(str(self.folder), str(folder)), "utf-8")
        return Environment(folder)


def make_environment(factory: pytest.TempPathFactory, *projects: str) -> Environment:
    """Make one.

    Args:
        factory: of folders.
        projects: folders in tests/ that are installed into it, after our wheel.
    """
    return _template(factory, *projects).copy(factory.mktemp("own") / "env")


def _template(factory: pytest.TempPathFactory, *projects: str) -> Environment:
    def make(folder: Path) -> None:
        if not projects:
            _install_wheel(folder)
            return
        made = _template(factory, *projects[:-1]).copy(folder / "env")
        project = folder / projects[-1]
        shutil.copytree(ROOT / "tests" / project.name, project)
        made.run("pip", "install", "--quiet", f"./{project.name}", cwd=folder)

    return Environment(made_once(factory, "-".join(("with", *projects)), make) / "env")


def made_once(factory: pytest.TempPathFactory, name: str, make: Callable[[Path], None]) -> Path:
    """Return a folder that the first worker of a run fills, while the others wait."""
    base = factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / name
    with folder.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (folder / "made").exists():
            shutil.rmtree(folder, ignore_errors=True)  # of a worker that failed
            folder.mkdir()
            make(folder)
            (folder / "made").touch()
    return folder


def _install_wheel(folder: Path) -> None:
    """Make an environment with our wheel in it, that of the tree."""
    venv.create(folder / "env", symlinks=True)
    made = Environment(folder / "env")
    (packages,) = made.folder.glob("lib/python*/site-packages")
    ours = [path for path in sys.path if path.endswith("site-packages")]
    (packages / "dependencies.pth").write_text("\n".join(ours) + "\n")
    for module in ("pip", "pytest"):
        shim = made.folder / "bin" / module
        shim.write_text(SHIM.format(python=made.folder / "bin" / "python", module=module))
        shim.chmod(0o755)
    again = "--force-reinstall"  # though tickrig is among the dependencies, not in this one
    made.run("pip", "install", "--quiet", again, make_wheel(folder), cwd=folder)


def make_wheel(folder: Path) -> Path:
    """Return a wheel of this tree; where the compiled package is tested, that of `.ci/compiled`."""
    if tickrig.compiled:
        (wheel,) = (ROOT / "build" / "compiled").glob("tickrig-*.whl")
        return wheel
    tree = folder / "tree"
    tree.mkdir()
    for name in ("src", "wire", "device", "host", "emulators"):
        shutil.copytree(ROOT / name, tree / name, symlinks=True, ignore=STALE)
    for name in ("pyproject.toml", "setup.py", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, tree / name)
    subprocess.run([sys.executable, "-c", BUILD, folder], cwd=tree, check=True, capture_output=True)
    shutil.rmtree(tree)
    (wheel,) = folder.glob("tickrig-*.whl")
    return wheel
