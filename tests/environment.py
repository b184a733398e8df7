"""An environment of its own with our wheel in it, as users have it; nothing is downloaded."""

from __future__ import annotations

import shutil
import subprocess
import sys
import venv
from dataclasses import dataclass
from pathlib import Path

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
            "PYTHONDONTWRITEBYTECODE": "1",
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


def make_environment(folder: Path) -> Environment:
    """Make one, with our wheel in it."""
    venv.create(folder / "env", symlinks=True)
    made = Environment(folder / "env")
    (packages,) = made.folder.glob("lib/python*/site-packages")
    ours = [path for path in sys.path if path.endswith("site-packages")]
    (packages / "dependencies.pth").write_text("\n".join(ours) + "\n")
    for module in ("pip", "pytest"):
        shim = made.folder / "bin" / module
        shim.write_text(SHIM.format(python=made.folder / "bin" / "python", module=module))
        shim.chmod(0o755)
    tree = folder / "tree"
    tree.mkdir()
    for name in ("src", "wire", "device", "host", "emulators"):
        shutil.copytree(ROOT / name, tree / name, symlinks=True, ignore=STALE)
    for name in ("pyproject.toml", "setup.py", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, tree / name)
    subprocess.run([sys.executable, "-c", BUILD, folder], cwd=tree, check=True, capture_output=True)
    shutil.rmtree(tree)
    (wheel,) = folder.glob("tickrig-*.whl")
    made.run("pip", "install", "--quiet", wheel, cwd=folder)
    return made
