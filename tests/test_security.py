"""SECURITY.md against the code: what listens, what runs files."""

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "SECURITY.md").read_text("utf-8")
FLOORS = ("device", "emulators", "host", "wire")

LISTENING = re.compile(
    r"(^|\.)(create_server|create_datagram_endpoint|create_unix_server|start_server|start_unix_server"
    r"|openpty|ORB_init|DomainParticipant|serve_forever|TCPServer|UDPServer|\w*HTTPServer)$"
)
"""Calls after which somebody else may connect; so is `listen()` of a socket."""

RUNNING = re.compile(
    r"(^|\.)(exec|eval|exec_module|run_path|run_module|Popen|subprocess\.run|check_call|check_output"
    r"|os\.system|popen|execv\w*|spawn\w*|create_subprocess_\w+)$"
)
"""Calls that run code or programs."""

RUNS = {
    "emulators/bench/child.py": "our own emulators, for demos",
    "emulators/commands/doctor.py": "the search of python-can for adapters, which may not end",
    "emulators/testing/bench/modes/operators.py": "`power` of a rig file",
    "emulators/testing/campaign/crew.py": "a worker of a campaign: pytest",
    "host/canmon/conform/stimulus.py": "`--stimulus CMD`",
    "host/canmon/output/report_page.py": "Chromium, which prints the page",
    "host/rtc/engines/openrtm/stubs.py": "omniidl, and the stubs that it makes",
    "host/text/user_file.py": "`FILE.py:Class`",
    "wire/rtc_types/idl.py": "methods of value types, made of our own IDL",
}
"""Modules that run something, and what."""

ANY = re.compile(
    r"[Ss]erver|listen\(\)|openpty|ORB_init|DomainParticipant|exec|eval\(|run|Popen|spawn"
)
"""What must be in a module for any of it."""


@cache
def uses() -> list[tuple[str, str, bool]]:
    """Return what is called and derived from: module, name, whether there are arguments."""
    found = []
    for floor in FLOORS:
        for path in sorted((ROOT / floor).rglob("*.py")):
            text, module = path.read_text("utf-8"), str(path.relative_to(ROOT))
            for node in ast.walk(ast.parse(text)) if ANY.search(text) else ():
                if isinstance(node, ast.Call):
                    found.append((module, ast.unparse(node.func), bool(node.args)))
                elif isinstance(node, ast.ClassDef):
                    found += [(module, ast.unparse(base), False) for base in node.bases]
    return found


def test_the_page_lists_each_module_that_listens() -> None:
    found = {
        module
        for module, name, has_arguments in uses()
        if not module.startswith("device/")  # which has no sockets
        and (LISTENING.search(name) or (name.endswith(".listen") and not has_arguments))
    }
    table = PAGE.partition("## What listens")[2].partition("\n## ")[0]
    assert found == set(re.findall(r"\]\(((?:emulators|host)/[^)]*\.py)\)", table))


def test_what_runs_code_is_known() -> None:
    assert {module for module, name, _ in uses() if RUNNING.search(name)} == RUNS.keys()


def test_options_of_the_page_are_options() -> None:
    texts = "".join(
        path.read_text("utf-8") for floor in FLOORS for path in (ROOT / floor).rglob("*.py")
    )
    options = set(re.findall(r"`[^`\n]*?(--[a-z0-9-]+)", PAGE)) - {"--version"}
    assert [option for option in sorted(options) if f'"{option}"' not in texts] == []
