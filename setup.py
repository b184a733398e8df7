"""Refuse to build what has no modules; all else about the build stands in pyproject.toml."""

from pathlib import Path

from setuptools import setup

FOLDERS = ("device", "emulators", "host", "wire")

package = Path(__file__).parent / "src" / "tickrig"
if missing := [name for name in FOLDERS if not (package / name / "__init__.py").is_file()]:
    links = " ".join(f"../../{name}" for name in FOLDERS)
    raise SystemExit(
        f"src/tickrig/{missing[0]} is no link to {missing[0]}/: this checkout has no symbolic"
        f" links, nothing of tickrig would be installed. Make them:\n  ln -sf {links} src/tickrig/"
    )
setup()
