"""What is looked at in the files of a release, and that each of them runs.

An index takes or refuses a file by its name and its metadata, and pip unpacks a wheel without a
look at its RECORD: so these are read here.
"""

from __future__ import annotations

import base64
import csv
import hashlib
import os
import sys
import tarfile
import venv
import zipfile
from pathlib import Path

from packaging.metadata import Metadata
from packaging.utils import parse_sdist_filename, parse_wheel_filename

from releasing.process import ReleaseError, run


def check_files(tag: str, sdist: Path, *wheels: Path) -> None:
    """See that names, metadata and contents of all files are right, and of one version."""
    versions = {str(parse_sdist_filename(sdist.name)[1])}
    versions |= {str(parse_wheel_filename(wheel.name)[1]) for wheel in wheels}
    if versions != {tag.removeprefix("v")}:
        raise ReleaseError(f"{tag} has become version {', '.join(sorted(versions))}")
    described = _metadata_of_sdist(sdist)
    _check_metadata(sdist, described)
    for wheel in wheels:
        with zipfile.ZipFile(wheel) as packed:
            if _metadata_of_wheel(packed) != described:
                raise ReleaseError(f"{wheel.name} has other metadata than {sdist.name}")
            _check_record(wheel, packed)


def _metadata_of_sdist(sdist: Path) -> bytes:
    with tarfile.open(sdist) as packed:
        file = packed.extractfile(f"{sdist.name.removesuffix('.tar.gz')}/PKG-INFO")
        return file.read() if file else b""


def _metadata_of_wheel(packed: zipfile.ZipFile) -> bytes:
    (name,) = (name for name in packed.namelist() if name.endswith(".dist-info/METADATA"))
    return packed.read(name)


def _check_metadata(sdist: Path, described: bytes) -> None:
    try:
        metadata = Metadata.from_email(described, validate=True)
    except ExceptionGroup as wrong:
        raise ReleaseError(f"{sdist.name}: {wrong.exceptions[0]}") from wrong
    for field in ("summary", "description", "description_content_type", "license_expression"):
        if not getattr(metadata, field):
            raise ReleaseError(f"{sdist.name} has no {field.replace('_', ' ')}")


def _check_record(wheel: Path, packed: zipfile.ZipFile) -> None:
    """See that a wheel holds what its RECORD lists, and nothing else."""
    (record,) = (name for name in packed.namelist() if name.endswith(".dist-info/RECORD"))
    rows = csv.reader(packed.read(record).decode("utf-8").splitlines())
    listed = {name: digest for name, digest, _ in rows}
    if odd := listed.keys() ^ set(packed.namelist()):
        raise ReleaseError(f"{wheel.name}: not both in it and in its RECORD: {min(odd)}")
    for name in listed.keys() - {record}:
        digest = base64.urlsafe_b64encode(hashlib.sha256(packed.read(name)).digest())
        if listed[name] != f"sha256={digest.decode().rstrip('=')}":
            raise ReleaseError(f"{wheel.name}: {name} is not that of its RECORD")


def check_runs(file: Path, folder: Path, *, compiled: bool) -> None:
    """Install a file into an environment of its own, and run what it brings."""
    print(f"checking {file.name}", flush=True)
    venv.create(folder, with_pip=False)
    python, tickrig = folder / "bin" / "python", folder / "bin" / "tickrig"
    ours = Path(run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))").strip())
    dependencies = [path for path in sys.path if path.endswith("site-packages")]
    (ours / "dependencies.pth").write_text("\n".join(dependencies) + "\n", "utf-8")
    pip = [sys.executable, "-m", "pip", "--python", python, "install", "--quiet", "--no-compile"]
    pip += ["--ignore-installed", "--no-index", "--no-deps", "--no-build-isolation"]
    run(*pip, file, env=os.environ | {"TICKRIG_COMPILE": "0"})
    is_compiled = run(python, "-c", "import tickrig; print(tickrig.compiled, tickrig.__file__)")
    if not is_compiled.startswith(f"{compiled} {ours}"):
        raise ReleaseError(f"{file.name} is not compiled as it should be: {is_compiled.strip()}")
    (info,) = ours.glob("tickrig-*.dist-info")
    version = info.name.removesuffix(".dist-info").removeprefix("tickrig-")
    if (said := run(tickrig, "--version")) != f"tickrig (tickrig) {version}\n":
        raise ReleaseError(f"{file.name} says it is {said.strip()}")
    run(tickrig, "demo", "rrc")
