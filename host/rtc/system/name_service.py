"""Names of components, as rtshell writes them: `localhost/ConsoleIn0.rtc`."""

from __future__ import annotations

from typing import Generic, TypeVar

from tickrig.host.rtc.errors import RtcRefused

V = TypeVar("V")


class NameService(Generic[V]):
    """Objects by path; the parts of a path are its naming contexts and a name.

    In process: not emulated is the CORBA naming service, which others could ask.
    """

    def __init__(self) -> None:
        self._objects: dict[str, V] = {}

    def bind(self, path: str, value: V) -> None:
        """Give an object a path; RtcRefused if it is taken."""
        path = _plain(path)
        if path in self._objects:
            raise RtcRefused(f"{path} is taken")
        self._objects[path] = value

    def unbind(self, path: str) -> None:
        """Take a path away; one that is not there is no error."""
        self._objects.pop(_plain(path), None)

    def resolve(self, path: str) -> V:
        """Return the object at a path; RtcRefused if there is none."""
        path = _plain(path)
        if path not in self._objects:
            known = ", ".join(self._objects) or "none"
            raise RtcRefused(f"nothing at {path}; known: {known}")
        return self._objects[path]

    def names(self, context: str = "") -> tuple[str, ...]:
        """Return what stands in a naming context: names, and contexts with `/` at their end."""
        prefix = f"{_plain(context)}/" if _plain(context) else ""
        rests = (path.removeprefix(prefix) for path in self._objects if path.startswith(prefix))
        heads = (rest.partition("/") for rest in rests)
        return tuple(dict.fromkeys(head + slash for head, slash, _ in heads))


def _plain(path: str) -> str:
    return path.strip("/")
