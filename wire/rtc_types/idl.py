"""IDL types as Python annotations (OMG IDL to CDR, CORBA 3.0, chapter 15).

A struct is a class whose fields carry these annotations, in the order of the IDL file. Sequences
are tuples, but sequences of octets are bytes.

>>> class Speeds(Struct):
...     left: Double = 0.0
...     right: Double = 0.0
>>> Speeds(0.5), Speeds.idl_id()
(Speeds(left=0.5, right=0.0), 'IDL:RTC/Speeds:1.0')
"""

from __future__ import annotations

from dataclasses import FrozenInstanceError, dataclass
from enum import Enum
from typing import Annotated, Any, ClassVar, cast, dataclass_transform


class Primitive(Enum):
    """IDL types other than struct, sequence and enum."""

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


@dataclass_transform(frozen_default=True)
class _StructType(type):
    """Turns each struct into a value type with slots.

    `dataclass(frozen=True, slots=True)` takes five times as long for a class. The time matters for
    a command that loads 140 of these classes. This metaclass only enters the fields, for
    `dataclasses.replace`.
    """

    def __new__(mcs, name: str, bases: tuple[type, ...], namespace: dict[str, Any]) -> _StructType:
        if not bases:  # Struct itself
            return super().__new__(mcs, name, bases, namespace)
        hints: dict[str, object] = namespace.get("__annotations__", {})
        own = tuple(field for field, hint in hints.items() if "ClassVar" not in str(hint))
        zeros = {field: namespace.pop(field) for field in own}
        made: Any = super().__new__(mcs, name, bases, {**namespace, "__slots__": own})
        made = dataclass(init=False, repr=False, eq=False)(made)
        inherited = getattr(bases[0], "_zeros", {})
        made._zeros = {**inherited, **zeros}
        _define_methods(made)
        return cast(_StructType, made)


def _define_methods(kind: Any) -> None:
    """Define the methods that depend on the fields: `__init__`, and `_values`, which others use."""
    scope: dict[str, Any] = {}
    for name, zero in kind._zeros.items():
        scope[f"put_{name}"], scope[f"_{name}"] = getattr(kind, name).__set__, zero
    arguments = "".join(f", {name}=_{name}" for name in kind._zeros)
    puts = "".join(f"\n put_{name}(self, {name})" for name in kind._zeros) or " pass"
    values = "".join(f"self.{name}, " for name in kind._zeros)
    source = f"def __init__(self{arguments}):{puts}\ndef _values(self): return ({values})"
    define(source, scope)
    kind.__init__, kind._values = scope["__init__"], scope["_values"]


def define(source: str, scope: dict[str, Any]) -> None:
    """Execute generated source text that defines functions, such as the `__init__` of a struct.

    The caller generates the text from the names of the fields of the struct.

    Args:
        source: source text, which uses only names of fields and of `scope`.
        scope: globals of the functions. The defined functions are added to it by name.
    """
    exec(source, scope)


class Struct(metaclass=_StructType):
    """Base class of the structs of IDL files: immutable values that can be made without arguments.

    Values are not checked until they are encoded.

    Attributes:
        idl_module: IDL module that contains the struct.
        __match_args__: names of the fields, in the order of the IDL file.
    """

    __slots__ = ()
    idl_module: ClassVar[str] = "RTC"
    __match_args__: ClassVar[tuple[str, ...]]

    @classmethod
    def idl_id(cls) -> str:
        """Return the repository ID, such as `IDL:RTC/TimedLong:1.0`."""
        return f"IDL:{cls.idl_module}/{cls.__name__}:1.0"

    def _values(self) -> tuple[object, ...]:
        """Return the values of the fields in their order; each struct has its own method."""
        return ()

    def __setattr__(self, name: str, value: object) -> None:
        raise FrozenInstanceError(f"cannot assign to field {name!r}")

    def __delattr__(self, name: str) -> None:
        raise FrozenInstanceError(f"cannot delete field {name!r}")

    def __eq__(self, other: Any) -> bool:
        if other.__class__ is self.__class__:
            return bool(self._values() == other._values())
        return NotImplemented

    def __hash__(self) -> int:
        return hash(self._values())

    def __repr__(self) -> str:
        fields = zip(self.__match_args__, self._values(), strict=True)
        return f"{type(self).__qualname__}({', '.join(f'{n}={v!r}' for n, v in fields)})"

    def __reduce__(self) -> tuple[type, tuple[object, ...]]:
        return type(self), self._values()
