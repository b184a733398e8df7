from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
STALE = shutil.ignore_patterns("__pycache__", "*.egg-info")
FOLDERS = {"wire", "device", "host", "emulators"}
OTHERS = {"src", "tests", "docs", "examples", "findings", "tools", ".ci", ".devcontainer"}
FILES = {
    "SECURITY.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "LICENSE",
    "Makefile",
    "MANIFEST.in",
    "README.md",
}
FILES |= {"conftest.py", "pyproject.toml", "setup.py", ".gitignore"}
FILES |= {"Dockerfile", ".dockerignore", "action.yml"}
TREE = (*sorted(FOLDERS | OTHERS), *sorted(FILES))
MADE = {"__pycache__", "tickrig.egg-info"}
QUICK = (
    "tests/wire/rrc",
    "tests/device/canopen/nmt",
    "tests/host/rrc",
    "tests/emulators/record/test_trace.py",
    "tests/test_rooms.py::test_a_room_has_a_size_and_says_what_lives_there",
    "tests/test_docs.py::test_every_link_and_named_test_is_there",
)
"""Some of each floor, what reads golden files and pages, and what looks at the tree itself."""


def test_the_pages_name_the_pythons_of_the_classifiers() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    pattern = r"Programming Language :: Python :: (3\.\d+)$"
    first, *others, last = re.findall(pattern, "\n".join(project["classifiers"]), re.MULTILINE)
    assert project["requires-python"] == f">={first}"
    readme, page = ((ROOT / name).read_text("utf-8") for name in ("README.md", "docs/install.md"))
    assert f"Linux, Python {first} to {last} and make" in readme
    assert f"Linux and Python {first} to {last}, " in page
    assert f"We test tickrig with Python {first}, {', '.join(others)} and {last} " in page


def test_import_package_links_to_the_top_level_folders() -> None:
    assert links(ROOT) == {name: Path("../..", name) for name in FOLDERS}


def copied(tmp_path: Path) -> Path:
    """Copy what is the project, links as links, so that nothing stale in build/ gets in."""
    tree = tmp_path / "tree"
    for name in TREE:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, tree / name, symlinks=True, ignore=STALE)
        else:
            shutil.copy(ROOT / name, tree / name)
    return tree


@pytest.fixture(scope="module")
def sdist(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the source distribution."""
    folder = tmp_path_factory.mktemp("sdist")
    build = "import sys; from setuptools import build_meta as b; b.build_sdist(sys.argv[1])"
    tree = copied(folder)
    subprocess.run([sys.executable, "-c", build, folder], cwd=tree, check=True, capture_output=True)
    shutil.rmtree(tree)
    (archive,) = folder.glob("*.tar.gz")
    return archive


@pytest.fixture(scope="module")
def unpacked(sdist: Path) -> Path:
    """Unpack it as pip does."""
    with tarfile.open(sdist) as archive:
        archive.extractall(sdist.parent, filter="data")
    return sdist.parent / sdist.name.removesuffix(".tar.gz")


def links(tree: Path) -> dict[str, Path]:
    package = tree / "src" / "tickrig"
    return {path.name: path.readlink() for path in package.iterdir() if path.is_symlink()}


def files(tree: Path) -> set[str]:
    paths = [path.relative_to(tree) for path in tree.rglob("*") if path.is_file()]
    return {path.as_posix() for path in paths if MADE.isdisjoint(path.parts)}


def test_the_sdist_is_the_tree(unpacked: Path) -> None:
    tree = {f"{name}/{path}" for name in (FOLDERS | OTHERS) for path in files(ROOT / name)}
    assert files(unpacked) == tree | FILES | {"PKG-INFO", "setup.cfg"}
    assert links(unpacked) == links(ROOT)


@pytest.mark.realtime  # as some of these are
@pytest.mark.timeout(300)
def test_the_sdist_passes_its_own_tests(unpacked: Path) -> None:
    process = subprocess.run(
        [
            sys.executable,
            "-m",
            "pytest",
            "-q",
            "-p",
            "no:cacheprovider",
            "-m",
            "not hypothesis",
            *QUICK,
        ],
        cwd=unpacked,
        env={**os.environ, "PYTHONPATH": str(unpacked / "src"), "PYTEST_ADDOPTS": ""},
        capture_output=True,
        text=True,
        check=False,
    )
    assert process.returncode == 0, process.stdout[-4_000:]


def test_wheel_holds_one_top_level_name_all_modules_and_templates(
    sdist: Path, tmp_path: Path
) -> None:
    build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps"]
    build += ["--no-build-isolation", "--wheel-dir", str(tmp_path), str(sdist)]
    subprocess.run(build, check=True)
    (wheel,) = tmp_path.glob("*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    packed = {name for name in names if ".dist-info/" not in name}
    assert {name.split("/")[0] for name in packed} == {"tickrig"}
    sources = {f"tickrig/{folder}/{name}" for folder in FOLDERS for name in files(ROOT / folder)}
    real = {path.removeprefix("src/") for path in files(ROOT) if path.startswith("src/")}
    assert packed == {name for name in sources | real if not name.endswith(".c")}


def test_a_checkout_without_links_is_refused_with_the_line_that_mends_it(tmp_path: Path) -> None:
    tree = copied(tmp_path)
    before = links(tree)
    for name, target in before.items():  # as git writes them with core.symlinks=false
        (tree / "src" / "tickrig" / name).unlink()
        (tree / "src" / "tickrig" / name).write_text(str(target))
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
    assert links(tree) == before
