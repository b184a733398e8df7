"""Files that are no rig file, and tables of files of before: what to write in their place."""

from __future__ import annotations

import json
import re
from typing import Final

from tickrig.host.text.section import Section
from tickrig.host.text.toml_reader import BROKEN
from tickrig.host.text.trace import BEGIN

_SYSTEM: Final = (
    "it is a system of RT components, of which nothing is emulated: tickrig rtc run FILE"
)
SCENARIO: Final = "it is a scenario: --scenario FILE plays it"
_TRACE: Final = "it is a trace: tickrig replay FILE, tickrig compare FILE"
EDS: Final = "it is an EDS or DCF: a rig file names it as the type of a device, type = FILE"
_URDF: Final = (
    "it is a URDF: a bus.yml names it, options: {tickrig: {urdf: FILE}}, and tickrig check of that"
    " checks both"
)
_NODE: Final = "[[node]] is a device now, one for each node-ID: {new}"
_DUT: Final = (
    'a real RRC is a device now: [device.rrc] with type = "rrc", [hardware.rrc] with port = "...";'
    " [tolerance] is [hardware.tolerance], [operator] is [hardware]"
)
_EDS: Final = re.compile(r"\s*\[(FileInfo|DeviceInfo|DeviceComissioning)\]", re.IGNORECASE)
_HEAD: Final = 2_000
"""Characters at its beginning by which a URDF is known."""
_SCENARIO: Final = re.compile(
    r"(?:[^\S\n]*+(?:#.*+)?\n)*+[^\S\n]*+\+?[0-9][0-9.]*(s|ms|us)?[ \t]+[a-z]+\b(?!\s*=)"
)


def no_rig_file(text: str) -> str:
    r"""Say what a text is that no bench can be made of; empty if nothing is known of it.

    >>> no_rig_file("# drive\n0.1s press power_button\n")
    'it is a scenario: --scenario FILE plays it'
    """
    if text.startswith(BEGIN):
        return _TRACE
    if _EDS.match(text):
        return EDS
    head = text[:_HEAD].lstrip("\ufeff \t\r\n")
    if head.startswith("<") and "<robot" in head:
        return _URDF
    return SCENARIO if _SCENARIO.match(text) else ""


def refuse_old_tables(top: Section) -> Section:
    """Return a rig file as it is; note what replaces the tables of files of before.

    Args:
        top: the whole file.
    """
    given, before = top.values, len(top.notes.all)
    nodes = given.get("node")
    if isinstance(nodes, list):
        for at, node in enumerate(nodes):
            if node is not BROKEN:
                top.wrong(_NODE.format(new=_device(node, at + 1)), "node", at)
    if isinstance(given.get("dut"), dict):
        top.wrong(_DUT, "dut")
    if isinstance(given.get("component"), list):
        top.wrong(_SYSTEM, "component")
    if len(top.notes.all) > before or ("device" not in given and before):
        return Section(top.notes, (), {"device": {}})
    return top


def _device(node: object, number: int) -> str:
    """Return a table [[node]] as a table [device.NAME]."""
    old: dict[str, object] = node if isinstance(node, dict) else {}
    device = next((old[key] for key in ("eds", "model", "rtc") if key in old), "FILE.eds")
    keys = {"type": device, "node_id": old.get("id"), "profile": old.get("profile")}
    shown = ", ".join(f"{key} = {json.dumps(x)}" for key, x in keys.items() if x is not None)
    return f"[device.node{number}] with {shown}"
