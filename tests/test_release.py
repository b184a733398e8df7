"""What tools/release refuses, each in a line, and what a release is when it makes one."""

from __future__ import annotations

import base64
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.test_containers import run, wanted
from tests.test_packaging import ROOT, STALE, copied

IDENTITY = {"GIT_AUTHOR_NAME": "a", "GIT_AUTHOR_EMAIL": "a@b", "GIT_CONFIG_GLOBAL": os.devnull}
IDENTITY |= {"GIT_COMMITTER_NAME": "a", "GIT_COMMITTER_EMAIL": "a@b"}
CHANGES = """# Changelog

## [Unreleased]

## [0.2.0] - 2026-11-23

### Added

- A kettle.

## [0.1.0] - 2026-01-01
"""
UNRELEASED = CHANGES.replace("ed]\n", "ed]\n\n### Fixed\n\n- The lid.\n")
ERROR = "releasing.process.ReleaseError: "
METADATA = b"""Metadata-Version: 2.4
Name: lid
Version: 0.2.0
Summary: A lid
License-Expression: MIT
Requires-Python: >=3.11
Description-Content-Type: text/markdown

A lid."""


def git(tree: Path, *words: str) -> None:
    subprocess.run(
        ["git", "-C", tree, *words], env=os.environ | IDENTITY, check=True, capture_output=True
    )


def release(tree: Path, *words: str) -> tuple[int, str, str]:
    done = subprocess.run(
        [sys.executable, tree / "tools" / "release", *words],
        env=os.environ | {"MYPYC_OPT_LEVEL": "0"},  # builds in a third of the time
        capture_output=True,
        text=True,
        check=False,
    )
    return done.returncode, done.stdout, done.stderr


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A checkout with as little as the tool looks at before it builds."""
    tree = tmp_path / "tree"
    package = tree / "src" / "tickrig"
    package.mkdir(parents=True)
    (package / "_version.py").write_text('__version__ = "0.2.0"\n')
    shutil.copytree(ROOT / "tools" / "releasing", tree / "tools" / "releasing", ignore=STALE)
    shutil.copy(ROOT / "tools" / "release", tree / "tools")
    (tree / "CHANGELOG.md").write_text(CHANGES)
    git(tree, "init", "--quiet")
    commit(tree)
    git(tree, "tag", "v0.2.0")
    return tree


@pytest.fixture
def unreleased(tree: Path) -> Path:
    """The same, with something that no release has."""
    (tree / "CHANGELOG.md").write_text(UNRELEASED)
    commit(tree)
    return tree


def commit(tree: Path) -> None:
    git(tree, "add", "--all")
    git(tree, "commit", "--quiet", "--allow-empty", "--message", "a change")


def without_tag(tree: Path) -> None:
    git(tree, "tag", "--delete", "v0.2.0")


def edit(tree: Path) -> None:
    (tree / "CHANGELOG.md").write_text("")
    (tree / "new").write_text("")


def go_on(tree: Path) -> None:
    commit(tree)


def tag_another(tree: Path) -> None:
    git(tree, "tag", "v0.3.0")


def without_notes(tree: Path) -> None:
    (tree / "CHANGELOG.md").write_text(CHANGES.replace("0.2.0", "0.2.1"))
    commit(tree)
    git(tree, "tag", "--force", "v0.2.0")


def with_empty_notes(tree: Path) -> None:
    (tree / "CHANGELOG.md").write_text(CHANGES.replace("- A kettle.\n", ""))
    commit(tree)
    git(tree, "tag", "--force", "v0.2.0")


def without_version(tree: Path) -> None:
    (tree / "src" / "tickrig" / "_version.py").write_text("")
    commit(tree)
    git(tree, "tag", "--force", "v0.2.0")


@pytest.mark.parametrize(
    ("prepare", "tag", "said"),
    [
        (commit, "v0.9.0", "there is no tag v0.9.0; there are: v0.2.0"),
        (without_tag, "v0.2.0", "there is no tag v0.2.0; there are: none"),
        (go_on, "v0.2.0", ": git checkout v0.2.0"),
        (edit, "v0.2.0", "this tree is not that of v0.2.0: M CHANGELOG.md, ?? new"),
        (tag_another, "v0.3.0", "v0.3.0 is the tag, but src/tickrig/_version.py says 0.2.0"),
        (without_version, "v0.2.0", "src/tickrig/_version.py has no __version__"),
        (
            without_notes,
            "v0.2.0",
            "CHANGELOG.md has no heading '## [0.2.0] - YYYY-MM-DD': "
            "tools/release --prepare 0.2.0 makes it of ## [Unreleased]",
        ),
        (with_empty_notes, "v0.2.0", "CHANGELOG.md says nothing under '## [0.2.0]'"),
    ],
    ids=lambda each: getattr(each, "__name__", None),
)
def test_what_is_no_release_is_refused_in_a_line(
    prepare: Callable[[Path], None], tag: str, said: str, tree: Path
) -> None:
    prepare(tree)
    status, out, err = release(tree, tag)
    assert (status, out) == (1, "")
    assert err.startswith("tools/release: ")
    assert err.endswith(f"{said}\n")
    assert err.count("\n") == 1
    assert not (tree / "dist").exists()


def test_what_is_unreleased_becomes_the_section_of_a_version(unreleased: Path) -> None:
    status, out, err = release(unreleased, "--prepare", "0.3.0")
    assert (status, err) == (0, "")
    assert "    git tag v0.3.0\n    tools/release v0.3.0\n" in out
    text = (unreleased / "CHANGELOG.md").read_text()
    (date,) = re.findall(r"^## \[0\.3\.0\] - (\d{4}-\d\d-\d\d)$", text, re.MULTILINE)
    assert text == UNRELEASED.replace(
        "## [Unreleased]\n", f"## [Unreleased]\n\n## [0.3.0] - {date}\n"
    )
    package = unreleased / "src" / "tickrig" / "_version.py"
    assert package.read_text() == '__version__ = "0.3.0"\n'


@pytest.mark.parametrize(
    ("prepare", "version", "said"),
    [
        (commit, "v0.3", "v0.3 is written 0.3"),
        (commit, "next", "next is no version, as 0.2.0 is"),
        (commit, "0.1.9", "0.1.9 is before 0.2.0, which this tree declares"),
        (commit, "0.2.0", "0.2.0 has a tag or a section in CHANGELOG.md already"),
        (without_tag, "0.2.0", "0.2.0 has a tag or a section in CHANGELOG.md already"),
        (edit, "0.3.0", "the commit of a release holds nothing else: M CHANGELOG.md, ?? new"),
        (with_empty_notes, "0.3.0", "CHANGELOG.md says nothing under '## [Unreleased]'"),
    ],
    ids=lambda each: getattr(each, "__name__", None),
)
def test_what_cannot_be_prepared_is_refused_in_a_line(
    prepare: Callable[[Path], None], version: str, said: str, unreleased: Path
) -> None:
    prepare(unreleased)
    before = (unreleased / "CHANGELOG.md").read_text()
    assert release(unreleased, "--prepare", version) == (1, "", f"tools/release: {said}\n")
    assert (unreleased / "CHANGELOG.md").read_text() == before


def test_the_steps_of_the_help_are_those_of_the_page_and_of_the_tool(unreleased: Path) -> None:
    """What somebody types is written in three places, the same in each."""
    (steps,) = re.findall(r"(?:^    \S.*\n){4}", release(unreleased, "--help")[1], re.MULTILINE)
    commands = [line.strip().split("  ")[0] for line in steps.splitlines()]
    told = release(unreleased, "--prepare", "0.3.0")[1].splitlines()[1:]
    assert [line.strip().replace("0.3.0", "0.2.0") for line in told] == commands[1:]
    page = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    assert "\n".join(commands) in re.sub(r" +#.*", "", page)


def test_each_version_of_the_changelog_has_each_group_once_and_no_line_twice() -> None:
    text = (ROOT / "CHANGELOG.md").read_text("utf-8")
    for section in re.split(r"^## ", text, flags=re.MULTILINE)[1:]:
        groups = re.findall(r"^### (.+)$", section, re.MULTILINE)
        assert len(groups) == len(set(groups))
        assert set(groups) <= {"Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"}
        starts = Counter(re.findall(r"^- (.{40})", section, re.MULTILINE))
        assert [start for start, times in starts.items() if times > 1] == []


def test_a_folder_with_files_is_left_alone(tree: Path, tmp_path: Path) -> None:
    (tmp_path / "made").mkdir()
    (tmp_path / "made" / "mine.whl").write_text("")
    status, _, err = release(tree, "v0.2.0", "--into", str(tmp_path / "made"))
    assert (status, err) == (1, f"tools/release: {tmp_path}/made has files already: mine.whl\n")


def test_a_build_that_fails_is_told_by_its_last_line(tree: Path, tmp_path: Path) -> None:
    (tree / "pyproject.toml").write_text("[project\n")
    commit(tree)
    git(tree, "tag", "--force", "v0.2.0")
    status, _, err = release(tree, "v0.2.0", "--into", str(tmp_path / "made"))
    assert status == 1
    assert err.startswith("tools/release: python")
    assert err.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".release")] == []
    assert list((tmp_path / "made").iterdir()) == []


@pytest.fixture
def made(tmp_path: Path) -> list[Path]:
    """A source distribution and a wheel, as small as they can be."""
    sdist, wheel = tmp_path / "lid-0.2.0.tar.gz", tmp_path / "lid-0.2.0-py3-none-any.whl"
    (tmp_path / "PKG-INFO").write_bytes(METADATA)
    with tarfile.open(sdist, "w:gz") as packed:
        packed.add(tmp_path / "PKG-INFO", "lid-0.2.0/PKG-INFO")
    pack(wheel, METADATA)
    return [sdist, wheel]


def pack(wheel: Path, metadata: bytes, module: bytes = b"", more: str = "lid.py") -> None:
    """Write a wheel whose RECORD says that its module is empty and has that name."""
    info = "lid-0.2.0.dist-info"
    files = {"lid.py": b"", f"{info}/METADATA": metadata}
    rows = [f"{name},sha256={sha256_of(text)},{len(text)}" for name, text in files.items()]
    with zipfile.ZipFile(wheel, "w") as packed:
        for name, text in (files | {"lid.py": module, more: module}).items():
            packed.writestr(name, text)
        packed.writestr(f"{info}/RECORD", "\n".join([*rows, f"{info}/RECORD,,"]))


def sha256_of(text: bytes) -> str:
    return base64.urlsafe_b64encode(hashlib.sha256(text).digest()).decode().rstrip("=")


def checked(tag: str, made: list[Path]) -> str:
    """Return what is wrong with these files."""
    words = ["import sys; from releasing.checks import *; from pathlib import Path"]
    words += ["check_files(sys.argv[1], *map(Path, sys.argv[2:]))"]
    done = subprocess.run(
        [sys.executable, "-B", "-c", "\n".join(words), tag, *made],
        env=os.environ | {"PYTHONPATH": str(ROOT / "tools")},
        capture_output=True,
        text=True,
        check=False,
    )
    return done.stderr.strip().rpartition("\n")[2].removeprefix(ERROR)


def test_files_that_an_index_takes_are_right(made: list[Path]) -> None:
    assert checked("v0.2.0", made) == ""


def test_files_of_another_version_are_refused(made: list[Path]) -> None:
    assert checked("v0.3.0", made) == "v0.3.0 has become version 0.2.0"


@pytest.mark.parametrize(
    ("was", "now", "said"),
    [
        (b"License-Expression: MIT\n", b"", "lid-0.2.0.tar.gz has no license expression"),
        (b"A lid.", b"", "lid-0.2.0.tar.gz has no description"),
        (b"Python: >=3.11", b"Python: new", "lid-0.2.0.tar.gz: 'new' is invalid for"),
    ],
)
def test_metadata_that_an_index_refuses_are_told(
    was: bytes, now: bytes, said: str, made: list[Path], tmp_path: Path
) -> None:
    (tmp_path / "PKG-INFO").write_bytes(METADATA.replace(was, now))
    with tarfile.open(made[0], "w:gz") as packed:
        packed.add(tmp_path / "PKG-INFO", "lid-0.2.0/PKG-INFO")
    assert checked("v0.2.0", made).startswith(said)


def test_a_wheel_with_other_metadata_is_refused(made: list[Path]) -> None:
    pack(made[1], METADATA + b"More.\n")
    assert checked("v0.2.0", made) == f"{made[1].name} has other metadata than {made[0].name}"


def test_a_wheel_that_is_not_as_its_record_says_is_refused(made: list[Path]) -> None:
    pack(made[1], METADATA, b"changed")
    assert checked("v0.2.0", made) == f"{made[1].name}: lid.py is not that of its RECORD"
    pack(made[1], METADATA, more="pot.py")
    said = f"{made[1].name}: not both in it and in its RECORD: pot.py"
    assert checked("v0.2.0", made) == said


@pytest.mark.release
@pytest.mark.timeout(1800)
def test_a_release_of_a_tag_in_a_clone_is_prepared_made_and_right(tmp_path: Path) -> None:
    """The steps of CONTRIBUTING, with the changelog of this tree."""
    origin = copied(tmp_path)
    git(origin, "init", "--quiet")
    commit(origin)
    tree = tmp_path / "clone"
    git(tmp_path, "clone", "--quiet", str(origin), str(tree))
    version = "1000.0.0"
    assert release(tree, "--prepare", version)[::2] == (0, "")
    git(tree, "commit", "--quiet", "--all", "--message", f"release: {version}")
    git(tree, "tag", f"v{version}")
    status, out, err = release(tree, f"v{version}")
    assert (status, err) == (0, "")
    assert out.endswith("dist: checked, and nothing is published\n")
    made = {path.name: path for path in (tree / "dist").iterdir()}
    text = (ROOT / "CHANGELOG.md").read_text("utf-8").partition("## [Unreleased]\n")[2]
    assert made.pop("NOTES.md").read_text("utf-8").strip() == text.partition("\n## [")[0].strip()
    sums = made.pop("SHA256SUMS").read_text().split()
    assert [name.split("-")[-1] for name in sorted(made)] == [
        *("linux_x86_64.whl", "any.whl", f"{version}.tar.gz"),
    ]
    assert dict(zip(sums[1::2], sums[::2], strict=True)) == {
        name: hashlib.sha256(path.read_bytes()).hexdigest() for name, path in made.items()
    }
    run(wanted("twine"), "check", "--strict", *made.values())
