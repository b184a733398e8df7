"""CHANGELOG.md, in the form of Keep a Changelog: what a version says, and how it gets a section."""

from __future__ import annotations

import re
from datetime import UTC, datetime

from packaging.version import InvalidVersion, Version

from releasing.process import ReleaseError
from releasing.tree import ROOT, changes, commit_of, declare_version, declared_version

CHANGELOG = ROOT / "CHANGELOG.md"
UNRELEASED = "## [Unreleased]"


def notes_of(version: str) -> str:
    """Return what the changelog says of a version; ReleaseError if that is nothing."""
    if (said := _section(rf"## \[{re.escape(version)}\] - \d{{4}}-\d\d-\d\d")) is None:
        raise ReleaseError(
            f"CHANGELOG.md has no heading '## [{version}] - YYYY-MM-DD': "
            f"tools/release --prepare {version} makes it of {UNRELEASED}"
        )
    if not said:
        raise ReleaseError(f"CHANGELOG.md says nothing under '## [{version}]'")
    return said + "\n"


def prepare(version: str) -> None:
    """Declare a version, and make a section of it out of all that is unreleased."""
    _check_version(version)
    if changed := changes():
        raise ReleaseError(f"the commit of a release holds nothing else: {changed}")
    if commit_of(f"v{version}") or _section(rf"## \[{re.escape(version)}\].*") is not None:
        raise ReleaseError(f"{version} has a tag or a section in CHANGELOG.md already")
    if not _section(re.escape(UNRELEASED)):
        raise ReleaseError(f"CHANGELOG.md says nothing under {UNRELEASED!r}")
    heading = f"{UNRELEASED}\n\n## [{version}] - {datetime.now(UTC).date()}\n"
    declare_version(version)
    text = CHANGELOG.read_text("utf-8")
    CHANGELOG.write_text(text.replace(f"{UNRELEASED}\n", heading, 1), "utf-8")


def _check_version(version: str) -> None:
    try:
        normal = str(Version(version))
    except InvalidVersion as error:
        raise ReleaseError(f"{version} is no version, as 0.2.0 is") from error
    if normal != version:
        raise ReleaseError(f"{version} is written {normal}")
    if Version(version) < Version(declared := declared_version()):
        raise ReleaseError(f"{version} is before {declared}, which this tree declares")


def _section(heading: str) -> str | None:
    """Return what stands under a heading, nothing if there are headings alone; None without it."""
    text = CHANGELOG.read_text("utf-8")
    pattern = rf"^{heading}\n(.*?)(?=^## |\Z)"
    if (found := re.search(pattern, text, re.DOTALL | re.MULTILINE)) is None:
        return None
    lines = found[1].strip().splitlines()
    return "\n".join(lines) if any(line and not line.startswith("#") for line in lines) else ""
