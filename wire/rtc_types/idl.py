"""IDL types as Python annotations (OMG IDL to CDR, CORBA 3.0, chapter 15).

A struct is a frozen dataclass whose fields carry these annotations, in the
order of the IDL file; sequences are tuples, sequences of octets bytes.
"""

from __future__ import annotations

from enum import Enum
from typing import Annotated, ClassVar


class Primitive(Enum):
    """IDL types that are no struct, sequence or enum."""

    BOOLEAN = "boolean"
    CHAR = "char"
    WCHAR = "wchar"
    OCTET = "octet"
    SHORT = "short"
    USHORT = "unsigned short"
    LONG = "long"
    ULONG = "unsigned long"
    LONGLONG = "long long"
    ULONGLONG = "unsigned long long"
    FLOAT = "float"
    DOUBLE = "double"
    STRING = "string"
    WSTRING = "wstring"
    OCTET_SEQ = "sequence<octet>"


Boolean = Annotated[bool, Primitive.BOOLEAN]
Char = Annotated[str, Primitive.CHAR]
WChar = Annotated[str, Primitive.WCHAR]
Octet = Annotated[int, Primitive.OCTET]
Short = Annotated[int, Primitive.SHORT]
UShort = Annotated[int, Primitive.USHORT]
Long = Annotated[int, Primitive.LONG]
ULong = Annotated[int, Primitive.ULONG]
LongLong = Annotated[int, Primitive.LONGLONG]
ULongLong = Annotated[int, Primitive.ULONGLONG]
Float = Annotated[float, Primitive.FLOAT]
Double = Annotated[float, Primitive.DOUBLE]
String = Annotated[str, Primitive.STRING]
WString = Annotated[str, Primitive.WSTRING]
OctetSeq = Annotated[bytes, Primitive.OCTET_SEQ]


class Struct:
    """A struct of an IDL file; its subclasses are frozen dataclasses.

    Values are not checked until they are encoded.

    Attributes:
        idl_module: the IDL module the struct stands in.
        __match_args__: names of the fields, which the dataclass sets.
    """

    __slots__ = ()
    idl_module: ClassVar[str] = "RTC"
    __match_args__: ClassVar[tuple[str, ...]]

    @classmethod
    def idl_id(cls) -> str:
        """Return the repository ID, such as `IDL:RTC/TimedLong:1.0`."""
        return f"IDL:{cls.idl_module}/{cls.__name__}:1.0"
