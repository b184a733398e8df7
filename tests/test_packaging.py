from __future__ import annotations

import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
STALE = shutil.ignore_patterns("__pycache__", "*.egg-info")
FOLDERS = {"wire", "device", "host", "emulators"}


def test_import_package_links_to_the_top_level_folders() -> None:
    links = {p.name: p.resolve() for p in (ROOT / "src" / "tickrig").iterdir() if p.is_symlink()}
    assert links == {name: ROOT / name for name in FOLDERS}


def copied(tmp_path: Path) -> Path:
    """Copy what goes into a wheel, links as links, so that nothing stale in build/ gets in."""
    tree = tmp_path / "tree"
    for name in (*sorted(FOLDERS), "src"):
        shutil.copytree(ROOT / name, tree / name, symlinks=True, ignore=STALE)
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, tree / name)
    return tree


def test_wheel_holds_one_top_level_name_and_all_modules(tmp_path: Path) -> None:
    build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps"]
    build += ["--no-build-isolation", "--wheel-dir", str(tmp_path), str(copied(tmp_path))]
    subprocess.run(build, check=True)
    (wheel,) = tmp_path.glob("*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    packed = {name for name in names if ".dist-info/" not in name}
    assert {name.split("/")[0] for name in packed} == {"tickrig"}
    sources = {
        f"tickrig/{path.relative_to(ROOT).as_posix()}"
        for folder in FOLDERS
        for path in (ROOT / folder).rglob("*.py")
    }
    assert packed == sources | {"tickrig/__init__.py", "tickrig/py.typed"}
