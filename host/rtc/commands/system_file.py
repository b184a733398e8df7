"""System files on disk: TOML, or RTSProfile where the name ends in .xml."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from tickrig.host.cli.refused import Refused, refuse_path
from tickrig.host.rtc.states import RtcRefused
from tickrig.host.rtc.system.rts_profile import parse_rts_profile
from tickrig.host.rtc.system.system import System
from tickrig.host.rtc.system.system_toml import parse_toml
from tickrig.host.text.whole_file import check_file, write_whole

TOML: Final = ".toml"
XML: Final = ".xml"


def read_system(path: Path) -> System:
    """Read a system file; Refused if that cannot be done."""
    parse = parse_rts_profile if file_format(path) == "xml" else parse_toml
    try:
        return parse(path.read_text("utf-8"))
    except UnicodeDecodeError as error:
        raise Refused(f"system {path}: byte {error.start} is not UTF-8") from None
    except OSError as error:
        refuse_path("system", error)
    except RtcRefused as error:
        raise Refused(f"system {path}: {error}") from None


def write_system(text: str, path: Path) -> None:
    """Write a system file; Refused if that cannot be done."""
    try:
        write_whole(path, text)
    except OSError as error:
        refuse_path("system", error)


def file_format(path: Path) -> str:
    """Return `toml` or `xml`; Refused for another ending."""
    if path.suffix.lower() not in (TOML, XML):
        raise Refused(f"system {path}: the name ends in {TOML} or {XML}")
    return path.suffix.lower().removeprefix(".")


def check_system(path: Path) -> None:
    """See before a run whether a system could be written after it; Refused if not."""
    file_format(path)
    try:
        check_file(path, "system")
    except ValueError as error:
        raise Refused(str(error)) from None
