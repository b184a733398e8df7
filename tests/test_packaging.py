from __future__ import annotations

import re
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
    for name in ("pyproject.toml", "setup.py", "README.md", "LICENSE"):
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
    assert packed == sources | {
        "tickrig/__init__.py",
        "tickrig/__main__.py",
        "tickrig/commands.py",
        "tickrig/py.typed",
    }


def test_a_checkout_without_links_is_refused_with_the_line_that_mends_it(tmp_path: Path) -> None:
    tree = copied(tmp_path)
    links = {
        path: path.readlink() for path in (tree / "src" / "tickrig").iterdir() if path.is_symlink()
    }
    for path, target in links.items():  # as git writes them with core.symlinks=false
        path.unlink()
        path.write_text(str(target))
    build = subprocess.run(  # what every build and installation begins with
        [sys.executable, "setup.py", "--version"],
        cwd=tree,
        capture_output=True,
        text=True,
        check=False,
    )
    assert build.returncode == 1
    assert build.stderr.startswith("src/tickrig/device is no link to device/")
    (line,) = re.findall(r"ln -sf .*", build.stderr)
    subprocess.run(line, shell=True, cwd=tree, check=True)
    assert {path: path.readlink() for path in links} == links
