"""A base for containers out of this machine's Debian packages, where no image can be fetched."""

from __future__ import annotations

import re
import shutil
import subprocess
import tarfile
from pathlib import Path
from typing import Final

WANTED: Final = ("apt", "mawk", "passwd", "python3-venv")
"""What the images of Python have and an essential system has not; wheels want apt's libstdc++."""

LEFT_OUT: Final = ("/usr/share/doc", "/usr/share/man", "/usr/share/locale")
ACCOUNTS: Final = {
    "etc/passwd": "root:x:0:0:root:/root:/bin/sh\n",
    "etc/group": "root:x:0:\n",
}
STATUS: Final = "var/lib/dpkg/status"
SOURCES: Final = ("apt.conf.d", "sources.list", "sources.list.d/debian*", "sources.list.d/ubuntu*")
"""Where packages come from: what others than the distribution have may want more than http."""

KINDS: Final = ("suggests", "recommends", "conflicts", "breaks", "replaces", "enhances")


def why_no_base() -> str:
    """Return why none can be made, nothing if one can."""
    if missing := [tool for tool in ("dpkg-query", "apt-cache") if not shutil.which(tool)]:
        return f"this is no Debian: there is no {missing[0]}"
    done = subprocess.run(["dpkg-query", "-W", *WANTED], capture_output=True, check=False)
    return f"a base wants the packages {', '.join(WANTED)}" if done.returncode else ""


def write_base(path: Path) -> None:
    """Write the files of all essential packages, and of those that are wanted, as a tar file."""
    packages = _packages()
    with tarfile.open(path, "w") as base:
        for name in ("bin", "sbin", "lib", "lib64"):  # links into /usr
            base.add(f"/{name}", name, recursive=False)
        for name in sorted(_files(packages)):
            base.add(name, name.removeprefix("/"), recursive=False)
        for name, text in (ACCOUNTS | {STATUS: _status(packages)}).items():
            file = path.with_name("text")
            file.write_text(text, "utf-8")
            base.add(file, name)
        for source in SOURCES:
            for file in Path("/etc/apt").glob(source):
                base.add(file, str(file).removeprefix("/"))
        base.add("/etc/ld.so.cache", "etc/ld.so.cache")


def _packages() -> set[str]:
    """Return the names of all packages that it is made of."""
    essential = _lines("dpkg-query", "-W", "-f", "${Essential} ${Package}\n")
    names = [line.removeprefix("yes ") for line in essential if line.startswith("yes ")]
    options = [f"--no-{kind}" for kind in KINDS]
    closure = _lines("apt-cache", "depends", "--recurse", "--installed", *options, *names, *WANTED)
    return {line for line in closure if line[0] not in " <|"}


def _files(packages: set[str]) -> set[str]:
    """Return what dpkg knows of packages, where it really is."""
    listed = [Path(line) for line in _lines("dpkg-query", "-L", *packages) if line[0] == "/"]
    real = {str(each.parent.resolve() / each.name) for each in listed if each.name}
    return {
        each
        for each in real - {"/bin", "/sbin", "/lib", "/lib64"}
        if Path(each).exists() and not each.startswith(LEFT_OUT)
    }


def _status(packages: set[str]) -> str:
    """Return what dpkg writes down of packages, so that apt-get adds to them."""
    each = re.split(r"\n\n", Path("/", STATUS).read_text("utf-8"))
    names = {text.partition("\n")[0].removeprefix("Package: "): text for text in each}
    return "".join(f"{text}\n\n" for name, text in names.items() if name in packages)


def _lines(*words: str) -> list[str]:
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    return [line for line in done.stdout.splitlines() if line]
