"""What tools/release refuses, each in a line, and what a release is when it makes one."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.test_packaging import ROOT, copied

IDENTITY = {"GIT_AUTHOR_NAME": "a", "GIT_AUTHOR_EMAIL": "a@b", "GIT_CONFIG_GLOBAL": os.devnull}
IDENTITY |= {"GIT_COMMITTER_NAME": "a", "GIT_COMMITTER_EMAIL": "a@b"}
CHANGES = """# Changelog

## [Unreleased]

## [0.2.0] - 2026-11-23

### Added

- A kettle.

## [0.1.0] - 2026-01-01
"""


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
    (package / "__init__.py").write_text('__version__ = "0.2.0"\n')
    (tree / "tools").mkdir()
    shutil.copy(ROOT / "tools" / "release", tree / "tools")
    (tree / "CHANGELOG.md").write_text(CHANGES)
    git(tree, "init", "--quiet")
    commit(tree)
    git(tree, "tag", "v0.2.0")
    return tree


def commit(tree: Path) -> None:
    git(tree, "add", "--all")
    git(tree, "commit", "--quiet", "--allow-empty", "--message", "a change")


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
    (tree / "CHANGELOG.md").write_text(CHANGES.replace("### Added\n\n- A kettle.\n", ""))
    commit(tree)
    git(tree, "tag", "--force", "v0.2.0")


def without_version(tree: Path) -> None:
    (tree / "src" / "tickrig" / "__init__.py").write_text("")
    commit(tree)
    git(tree, "tag", "--force", "v0.2.0")


@pytest.mark.parametrize(
    ("prepare", "tag", "said"),
    [
        (commit, "v0.9.0", "there is no tag v0.9.0; there are: v0.2.0"),
        (go_on, "v0.2.0", ": git checkout v0.2.0"),
        (edit, "v0.2.0", "this tree is not that of v0.2.0: M CHANGELOG.md, ?? new"),
        (tag_another, "v0.3.0", "v0.3.0 is the tag, but src/tickrig/__init__.py says 0.2.0"),
        (without_version, "v0.2.0", "src/tickrig/__init__.py has no __version__"),
        (without_notes, "v0.2.0", "CHANGELOG.md has no heading '## [0.2.0] - YYYY-MM-DD'"),
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


@pytest.mark.release
@pytest.mark.timeout(1800)
def test_a_release_has_all_files_with_their_sums_and_the_notes_of_its_version(
    tmp_path: Path,
) -> None:
    tree = copied(tmp_path)
    (tree / "CHANGELOG.md").write_text(CHANGES.replace("0.2.0", "0.1.0", 1))
    git(tree, "init", "--quiet")
    commit(tree)
    git(tree, "tag", "v0.1.0")
    status, out, err = release(tree, "v0.1.0")
    assert (status, err) == (0, "")
    assert out.endswith("dist: checked, and nothing is published\n")
    assert (tree / "dist" / "NOTES.md").read_text() == "### Added\n\n- A kettle.\n"
    made = {path.name: path for path in (tree / "dist").iterdir()}
    sums = made.pop("SHA256SUMS").read_text().split()
    del made["NOTES.md"]
    assert [name.split("-")[-1] for name in sorted(made)] == [
        *("linux_x86_64.whl", "any.whl", "0.1.0.tar.gz"),
    ]
    assert dict(zip(sums[1::2], sums[::2], strict=True)) == {
        name: hashlib.sha256(path.read_bytes()).hexdigest() for name, path in made.items()
    }
