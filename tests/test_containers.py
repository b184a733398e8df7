"""The container: its Dockerfile is clean, is built here, and runs what it should as no root."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.local_base import why_no_base, write_base

ROOT = Path(__file__).parents[1]
DOCKERFILE = (ROOT / "Dockerfile").read_text("utf-8")
(EXTRAS,) = re.findall(r"^ARG EXTRAS=(.+)$", DOCKERFILE, re.MULTILINE)
"""What is in it unless somebody asks otherwise."""
IMPORTED = ("textual", "tomlkit", "numpy", "jinja2", "yaml", "pytest", "hypothesis")


def wanted(tool: str) -> str:
    """Return where a tool is; without it the test is skipped."""
    beside = Path(sys.executable).with_name(tool)
    if found := str(beside) if beside.exists() else shutil.which(tool):
        return found
    pytest.skip(f"there is no {tool}: .ci/release installs it")


def run(*words: str | Path, status: int = 0) -> str:
    done = subprocess.run(
        words,
        env=os.environ | {"BUILDAH_ISOLATION": "chroot"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == status, f"{words}: {done.stdout}{done.stderr}"
    return done.stdout


@pytest.mark.release
def test_the_dockerfile_is_clean() -> None:
    assert run(wanted("hadolint"), ROOT / "Dockerfile") == ""


def test_the_development_container_is_a_target_of_the_dockerfile() -> None:
    folder = ROOT / ".devcontainer"
    container = json.loads((folder / "devcontainer.json").read_text("utf-8"))
    build = container["build"]
    assert (folder / build["dockerfile"]).samefile(ROOT / "Dockerfile")
    assert (folder / build["context"]).samefile(ROOT)
    assert f" AS {build['target']}\n" in DOCKERFILE
    assert f"--uid 1000 {container['remoteUser']}\n" in DOCKERFILE
    make, goal = container["postCreateCommand"].split()
    assert make in DOCKERFILE
    assert goal == ".venv/.ready"  # READY of the Makefile, with its VENV
    assert "$(READY): pyproject.toml\n" in (ROOT / "Makefile").read_text("utf-8")


def test_what_is_copied_into_the_build_is_what_a_wheel_is_made_of() -> None:
    kept = re.findall(r"^!(.+)$", (ROOT / ".dockerignore").read_text("utf-8"), re.MULTILINE)
    assert set(kept) == {
        *("device", "emulators", "host", "src", "wire"),
        *("LICENSE", "README.md", "pyproject.toml", "setup.py"),
    }
    assert all((ROOT / name).exists() for name in kept)


class Store:
    """Images of buildah in a folder of their own."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._words: list[str | Path] = [wanted("buildah"), "--storage-driver", "vfs"]
        self._words += ["--root", folder / "root", "--runroot", folder / "runroot"]

    def __call__(self, *words: str | Path, status: int = 0) -> str:
        return run(*self._words, *words, status=status).strip()


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Store]:
    if os.geteuid():
        pytest.skip("buildah with --isolation chroot wants root")
    if why := why_no_base():
        pytest.skip(why)
    store = Store(tmp_path_factory.mktemp("store"))
    write_base(store.folder / "base.tar")
    container = store("from", "scratch")
    store("add", "--quiet", container, store.folder / "base.tar")
    store("commit", "--quiet", "--rm", container, "localhost/base")
    yield store
    shutil.rmtree(store.folder)


@pytest.fixture(scope="module")
def wheelhouse(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheels")
    words = [sys.executable, "-m", "pip", "wheel", "--quiet", "--wheel-dir", str(folder)]
    done = subprocess.run(
        [*words, "setuptools>=77", f"{ROOT}[{EXTRAS}]"], capture_output=True, text=True, check=False
    )
    if done.returncode:
        pytest.skip(f"no wheels to be had: {done.stderr.strip().splitlines()[-1]}")
    for ours in folder.glob("tickrig-*.whl"):
        ours.unlink()  # the container builds it
    return folder


@pytest.mark.release
@pytest.mark.timeout(1800)
def test_a_container_runs_the_commands_for_a_user_who_is_not_root(
    store: Store, wheelhouse: Path
) -> None:
    arguments = {"BASE": "localhost/base"}
    arguments |= {"PIP_NO_INDEX": "1", "PIP_FIND_LINKS": "/wheels"}
    options = [word for each in arguments.items() for word in ("--build-arg", "=".join(each))]
    options += ["--layers=false", "--volume", f"{wheelhouse}:/wheels:ro", "--tag", "tickrig"]
    store("build", "--isolation", "chroot", *options, ROOT)
    container = store("from", "localhost/tickrig")
    for command, said in {
        "id -u": "1000",
        "pwd": "/work",
        "touch mine && stat -c %U mine": "tickrig",
        "test -w /opt/tickrig || echo read only": "read only",
        "tickrig --version": "tickrig (tickrig) ",
        "tickrig demo": "tickrig demo rrc ",
        "tickrig demo fig120": "Node 16 is an f-palette",
        "tickrig demo rrc": "Done. Late ticks: ",
        f"python -c 'import {', '.join(IMPORTED)}' && echo all": "all",
    }.items():
        assert said in store("run", container, "--", "sh", "-c", command), command
    shown = store("inspect", "--type", "image", "localhost/tickrig")
    configured = json.loads(shown)["OCIv1"]["config"]
    assert (configured["Entrypoint"], configured["Cmd"]) == (["tickrig"], ["demo"])


@pytest.mark.release
@pytest.mark.timeout(1800)
def test_the_development_container_has_what_the_source_tree_wants(store: Store) -> None:
    words = ("--isolation", "chroot", "--layers=false", "--build-arg", "BASE=localhost/base")
    try:
        store("build", *words, "--target", "dev", "--tag", "dev", ROOT)
    except AssertionError as error:
        if re.search("Unable to locate package|Failed to fetch", str(error)):
            pytest.skip("no packages to be had")
        raise
    container = store("from", "--volume", f"{ROOT}:/tree:ro", "localhost/dev")
    for command, said in {
        "id -u": "1000",
        "make --version": "GNU Make",
        "git --version": "git version",
        "echo 'int main(void){return 0;}' | gcc -x c -o /tmp/a - && /tmp/a && echo ran": "ran",
        "candump --help 2>&1 | head -1": "candump",
        "/tree/tools/with-vcan --guest --where": ": vcan0 vcan1",
        "python3 -m venv /tmp/venv && /tmp/venv/bin/pip --version": "pip ",
    }.items():
        assert said in store("run", container, "--", "sh", "-c", command), command
