"""Our IDL against the list of OpenRTM's repository IDs, rtshell's stubs, and our own bytes."""

from __future__ import annotations

import subprocess
import sys
from enum import IntEnum
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin, get_type_hints

from tests.host.rtc.engines.openrtm.extra import OMNIORB
from tests.wire.rtc_types.test_rtc_types import TYPES
from tickrig.host.rtc.engines.openrtm.stubs import DATA_TYPES, IDL, compile_idl, stubs
from tickrig.wire.rtc_types.cdr import Endian, decode, encode

pytestmark = OMNIORB

OMG = """
    RTObject LightweightRTObject ExecutionContext ExecutionContextService PortService
    ComponentAction DataFlowComponentAction ComponentProfile PortProfile ConnectorProfile
    ReturnCode_t
    LifeCycleState ExecutionKind PortInterfaceProfile
"""
SDO = """
    SDO SDOSystemElement Configuration ConfigurationSet NameValue Organization ServiceProfile
"""

DESCRIPTIONS = """
import importlib, re, sys
package, names = sys.argv[1], sys.argv[2:]
if package == "tickrig_openrtm":
    from tickrig.host.rtc.engines.openrtm.stubs import stubs
    stubs()
for name in names:
    module = importlib.import_module(f"{package}.{name}")
    for key, value in sorted(vars(module).items()):
        if key.startswith("_d_"):
            print(name, key, re.sub("<class [^>]*>", "class", repr(value)))
        if isinstance(value, type) and hasattr(value, "_NP_RepositoryId"):
            for operation, types in sorted(vars(value).items()):
                if operation.startswith("_d_"):
                    ends = types[:2] if isinstance(types, tuple) else sorted(types)
                    text = re.sub("<class [^>]*>", "class", repr(ends))
                    raises = isinstance(types, tuple) and sorted(types[2] or ())
                    print(name, key, operation, text, raises)
"""


def test_repository_ids_are_those_of_openrtm() -> None:
    idl = stubs()
    for name in OMG.split():
        assert repository_id(idl.rtc, name) == f"IDL:omg.org/RTC/{name}:1.0"
    for name in SDO.split():
        assert repository_id(idl.sdo, name) == f"IDL:org.omg/SDOPackage/{name}:1.0"
    for name in ("InPortCdr", "OutPortCdr"):
        assert repository_id(idl.openrtm, name) == f"IDL:OpenRTM/{name}:1.0"
    assert idl.openrtm._ad_CdrData[1] == "IDL:OpenRTM/CdrData:1.0"
    component = "IDL:openrtm.aist.go.jp/OpenRTM/DataFlowComponent:1.0"
    assert repository_id(idl.openrtm, "DataFlowComponent") == component
    assert repository_id(idl.rtm, "Manager") == "IDL:RTM/Manager:1.0"


def repository_id(module: object, name: str) -> str:
    found = getattr(module, name)
    return str(found._NP_RepositoryId)


def test_operations_and_structs_are_those_of_rtshell() -> None:
    names = ("SDOPackage", "RTC", "OpenRTM", "RTM")
    ours, theirs = described("tickrig_openrtm", *names), described("rtctree.rtc", *names)
    assert len(ours) > 180
    assert ours - theirs == set()
    interfaces = {interface for interface, _ in map(operation, ours)}
    wanted = {line for line in theirs if operation(line)[0] in interfaces}
    assert {line for line in wanted - ours if operation(line)[1]} == set()


def described(package: str, *names: str) -> set[str]:
    """Return the types and operations of a package, a line each, as omniORB knows them."""
    return set(run(DESCRIPTIONS, package, *names).splitlines())


def operation(line: str) -> tuple[str, str]:
    """Return interface and operation of a line, the latter empty for a type."""
    module, name, rest, *_ = line.split()
    return f"{module}.{name}", rest if rest.startswith("_d_") else ""


def run(code: str, *words: str, given: str = "") -> str:
    command = [sys.executable, "-c", code, *words]
    done = subprocess.run(command, input=given, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


UNREAD = ("TimedWChar", "TimedWCharSeq")
"""`cdrUnmarshal` of omniORB 4.3.3 does not even read what its `cdrMarshal` writes for a wchar."""

MARSHAL = """
import importlib, sys
import omniORB
from omniORB import CORBA
orb = CORBA.ORB_init([])  # character sets
sys.path.insert(0, sys.argv[1])
for line in sys.stdin:
    name, endian, data = line.split()
    module, _, kind = name[4:-4].partition("/")
    code = getattr(importlib.import_module(f"foreign.{module}"), f"_tc_{kind}")
    value = omniORB.cdrUnmarshal(code, bytes.fromhex(data), endian == "little")
    print(omniORB.cdrMarshal(code, value, endian == "little").hex())
"""


def test_data_types_are_those_whose_bytes_we_make(tmp_path: Path) -> None:
    compile_idl([IDL / DATA_TYPES], tmp_path, "foreign")
    kinds = [kind for kind in TYPES if kind.__name__ not in UNREAD]
    values = [(sample(kind), endian) for kind in kinds for endian in Endian]
    lines = [f"{type(value).idl_id()} {end} {encode(value, end).hex()}" for value, end in values]
    answers = run(MARSHAL, str(tmp_path), given="\n".join(lines)).split()
    for (value, endian), answer in zip(values, answers, strict=True):
        assert decode(type(value), bytes.fromhex(answer), endian) == value


def sample(hint: Any) -> Any:
    """Return a value of which each octet matters."""
    if get_origin(hint) is tuple:
        return (sample(get_args(hint)[0]),) * 2
    if get_origin(hint) is Annotated:
        return SAMPLES[get_args(hint)[0]]
    if issubclass(hint, IntEnum):
        return list(hint)[-1]
    hints = get_type_hints(hint, include_extras=True)
    return hint(*(sample(hints[name]) for name in hint.__match_args__))


SAMPLES: dict[type, object] = {bool: True, int: 7, float: 1.5, str: "a", bytes: b"\1\2\3"}
