"""The objects of an EDS, found by the canopen library."""

from __future__ import annotations

import re
from configparser import Error as ConfigError
from io import StringIO
from typing import Final

from canopen.objectdictionary import ObjectDictionary
from canopen.objectdictionary.eds import import_eds

from tickrig.emulators.canopen.eds_file import EdsFile, Section
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds_writer import VARIABLES
from tickrig.wire.canopen.object_table import ObjectCode

NULL_OBJECT: Final = 0
DESCRIBED: Final = (ObjectCode.VAR, ObjectCode.DOMAIN, ObjectCode.ARRAY, ObjectCode.RECORD)
NUMBERS: Final = ("ObjectType", "DataType", "PDOMapping", "SubNumber", "ObjFlags")

_DERIVED_TYPE: Final = re.compile(r"[0-9A-F]{1,3}sub1")

Kinds = dict[int, ObjectCode]


def object_kinds(file: EdsFile) -> Kinds:
    """Return the kind of each object; those that only define a data type are left out.

    Raises:
        EdsError: an ObjectType that is none.
    """
    kinds = {}
    with_subs = {index for _, index, sub in file.objects() if sub is not None}
    for section, index, sub in file.objects():
        if sub is None:
            default = ObjectCode.RECORD if index in with_subs else ObjectCode.VAR
            number = file.number(section, "ObjectType", default)
            if number in DESCRIBED:
                kinds[index] = ObjectCode(number)
            elif number not in (NULL_OBJECT, ObjectCode.DEFTYPE, ObjectCode.DEFSTRUCT):
                raise file.error(section, f"ObjectType={number} is no kind of object")
    return kinds


def import_objects(file: EdsFile, kinds: Kinds) -> ObjectDictionary:
    """Let the canopen library find the objects.

    It gets what it can read of the file, so that it neither drops an error
    silently nor stumbles over the order of the sections. Node-ID 0 leaves
    `$NODEID` sums relative.

    Raises:
        EdsError: a sub-index without its object, or a keyword that is no number or missing.
    """
    _check(file, kinds)
    try:
        found: ObjectDictionary = import_eds(  # type: ignore[no-untyped-call] # has no types
            StringIO(_text(file, kinds)), 0
        )
    except ConfigError as error:
        section, key = getattr(error, "section", ""), getattr(error, "option", "it")
        raise file.error(section, f"{key} is missing") from error
    return found


def is_visible_char(file: EdsFile, section: str) -> bool:
    """Say whether 00A0h is the data type of RTC-CANopen here, not one that the file derives."""
    kind = file.number(section, "DataType")
    return kind == DataType.VISIBLE_CHAR and f"{kind:X}sub1" not in file.sections


def _check(file: EdsFile, kinds: Kinds) -> None:
    """Refuse what the library refuses without naming the section."""
    heads = {index for _, index, sub in file.objects() if sub is None}
    for section, index, sub in file.objects():
        for key in NUMBERS:
            file.number(section, key)
        if index not in heads:
            raise file.error(section, f"has no object [{index:04X}]")
        if sub is not None and kinds.get(index) in VARIABLES:
            raise file.error(section, f"is part of a {kinds[index].name}, which has none")


def _text(file: EdsFile, kinds: Kinds) -> str:
    """Write the objects, then their sub-indices, then the data types that they refer to."""
    objects = list(file.objects())
    lines = ["[DeviceInfo]"]
    for section, index, sub in sorted(objects, key=lambda row: row[2] is not None):
        if index in kinds:
            keys = dict(file.sections[section])
            if sub is None:
                keys["ObjectType"] = str(int(kinds[index]))
            if file.number(section, "ObjectType") == ObjectCode.DOMAIN:
                keys["DataType"] = str(int(DataType.DOMAIN))
            elif is_visible_char(file, section):
                keys["DataType"] = str(int(DataType.VISIBLE_STRING))
            lines += _section(section, keys)
    for section, keys in file.sections.items():
        if _DERIVED_TYPE.fullmatch(section):
            lines += _section(section, keys)
    return "\n".join(lines)


def _section(title: str, keys: Section) -> list[str]:
    return [f"[{title}]", *(f"{key}={value}" for key, value in keys.items())]
