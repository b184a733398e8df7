"""The sections and keywords of CiA 306, and their spelling."""

from __future__ import annotations

import re
from typing import Final

from tickrig.wire.canopen.eds.eds_value import is_module_object, object_section
from tickrig.wire.canopen.eds.object_table import BIT_RATES_KBIT

FILE_INFO: Final = (
    *("FileName", "FileVersion", "FileRevision", "EDSVersion", "Description", "CreationTime"),
    *("CreationDate", "CreatedBy", "ModificationTime", "ModificationDate", "ModifiedBy"),
)
FLAGS: Final = (
    *(f"BaudRate_{kbit}" for kbit in BIT_RATES_KBIT),
    *("SimpleBootUpMaster", "SimpleBootUpSlave", "GroupMessaging", "LSS_Supported"),
)
NUMBERS: Final = (
    *("VendorNumber", "ProductNumber", "RevisionNumber", "NrOfRXPDO", "NrOfTXPDO"),
    *("Granularity", "DynamicChannelsSupported"),
)
NAMES: Final = ("VendorName", "ProductName", "OrderCode")
DEVICE_INFO: Final = (*NAMES, *NUMBERS, *FLAGS)
_OPTIONAL_INFO: Final = ("CompactPDO", "NG_Slave", "NrOfNG_MonitoredNodes", "NG_Master")
_COMMISSIONING: Final = (
    *("NodeID", "NodeName", "Baudrate", "NetNumber", "NetworkName", "CANopenManager"),
    *("LSS_SerialNumber", "NodeRefd", "NetRefd"),
)
_ENTRY: Final = (
    *("ParameterName", "ObjectType", "DataType", "AccessType", "PDOMapping", "DefaultValue"),
    *("LowLimit", "HighLimit", "SubNumber", "CompactSubObj", "ObjFlags", "SubExtObj"),
    *("InvertedSRAD", "UniqueID", "StorageLocation"),
)
OF_DCF: Final = ("ParameterValue", "Denotation", "UploadFile", "DownloadFile", "ParamRefd")
_OURS: Final = ("MaxBytes", "DefaultBytes", "Unit", "Factor")
"""Keywords that are not in CiA 306. This reader, and partly the canopen library, accept them."""

_LIST: Final = re.compile(r"SupportedObjects|NrOfEntries|[0-9]+", re.IGNORECASE)
_KEYS: Final = {
    "Comments": re.compile(r"Lines|Line[0-9]+", re.IGNORECASE),
    "DummyUsage": re.compile(r"Dummy[0-9A-F]{4}", re.IGNORECASE),
    **dict.fromkeys(("MandatoryObjects", "OptionalObjects", "ManufacturerObjects"), _LIST),
}
"""Patterns of the keywords of sections with numbered keywords."""

SECTION: Final = re.compile(
    r"[0-9A-F]{4}(sub[0-9A-F]{1,2}|Name|Value|Denotation|ObjectLinks)?"
    r"|[0-9A-F]{1,3}(sub[01])?|M[0-9].*|Tool[0-9]+",
    re.IGNORECASE,
)
"""Sections without fixed names: objects, data types, modules, tools."""


def _spelled(*names: str) -> dict[str, str]:
    return {name.lower(): name for name in names}


_BY_SECTION: Final = {
    "FileInfo": _spelled(*FILE_INFO, "LastEDS"),
    "DeviceInfo": _spelled(*DEVICE_INFO, *_OPTIONAL_INFO),
    "DeviceComissioning": _spelled(*_COMMISSIONING),
    **{section: _spelled("SupportedObjects", "Lines") for section in _KEYS},
}
_OBJECT: Final = _spelled(*_ENTRY, *OF_DCF, *_OURS)
_OF_MODULE: Final = {**_OBJECT, **_spelled("Count", "ObjExtend")}

_OBJECT_NUMBERS: Final = frozenset(
    {
        *("objecttype", "datatype", "pdomapping", "subnumber", "compactsubobj"),
        *("objflags", "objextend", "maxbytes"),
    }
)
_NUMBERS: Final = {
    "FileInfo": r"FileVersion|FileRevision",
    "DeviceInfo": "|".join((*NUMBERS, *FLAGS, *_OPTIONAL_INFO)),
    "DeviceComissioning": r"NodeID|Baudrate|NetNumber|CANopenManager|LSS_SerialNumber",
    "Comments": r"Lines",
    "DummyUsage": r"Dummy[0-9A-F]{4}",
    "DynamicChannels": r"NrOfSeg|(Type|PPOffset)[0-9]+",
    "Tools": r"Items",
}
"""Sections whose keywords have numbers as values."""
_LISTED_NUMBERS: Final = re.compile(
    r"(Mandatory|Optional|Manufacturer)Objects|(Supported|Connected)Modules"
    r"|M[0-9]+(FixedObjects|SubExtends)|[0-9A-F]{4}ObjectLinks",
    re.IGNORECASE,
)
"""Sections in which all values are numbers."""
_COUNTED: Final = re.compile(r"NrOfEntries|Lines|ProductVersion|ProductRevision", re.IGNORECASE)
"""Keywords of other sections whose values are numbers."""


def is_number(section: str, key: str) -> bool:
    """Return whether the value of a keyword is always a number.

    The result is False for a keyword such as DefaultValue, whose value is a number or a text, as
    the data type of its object requires.

    >>> is_number("DeviceInfo", "VendorNumber"), is_number("1600Value", "NrOfEntries")
    (True, True)
    >>> is_number("DeviceInfo", "VendorName"), is_number("1017", "DefaultValue")
    (False, False)
    """
    if object_section(section) is not None or is_module_object(section):
        return key.lower() in _OBJECT_NUMBERS
    if (known := _NUMBERS.get(section)) is not None:
        return re.fullmatch(known, key, re.IGNORECASE) is not None
    if _LISTED_NUMBERS.fullmatch(section):
        return True
    return _COUNTED.fullmatch(key) is not None and SECTION.fullmatch(section) is not None


def keys_of(section: str) -> dict[str, str] | None:
    """Return the keywords that CiA 306 allows in a section.

    A key of the mapping is a keyword in lower case. Its value is the correct spelling, such as
    `FileName`. The result is None if the section may have any keyword.
    """
    if object_section(section) is not None:
        return _OBJECT
    if is_module_object(section):
        return _OF_MODULE
    return _BY_SECTION.get(section)


def numbered(section: str, key: str) -> str | None:
    """Return the correct spelling of a numbered keyword, such as `Line3`, `Dummy001B` or `12`.

    The result is None if the section cannot have this keyword.

    >>> numbered("Comments", "line5"), numbered("DummyUsage", "dummy001b"), numbered("Tools", "x")
    ('Line5', 'Dummy001B', None)
    """
    pattern = _KEYS.get(section)
    if pattern is None or not pattern.fullmatch(key):
        return None
    return _LISTED.get(key.lower(), f"{key[:1].upper()}{key[1:5].lower()}{key[5:].upper()}")


_LISTED: Final = _spelled("SupportedObjects", "NrOfEntries", "Lines")
