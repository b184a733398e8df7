"""The name service of a manager: components by path."""

from __future__ import annotations

from tickrig.host.rtc.component import RtComponent
from tickrig.host.rtc.states import RtcRefused


class NameService:
    """Components by path, as rtshell writes them: `localhost/ConsoleIn0.rtc`.

    In process: not emulated is the CORBA naming service, which others could ask.
    """

    def __init__(self) -> None:
        self._components: dict[str, RtComponent] = {}

    def bind(self, path: str, component: RtComponent) -> None:
        """Give a component a path; RtcRefused if it is taken."""
        path = _plain(path)
        if path in self._components:
            raise RtcRefused(f"{path} is taken")
        self._components[path] = component

    def unbind(self, path: str) -> None:
        """Take a path away; one that is not there is no error."""
        self._components.pop(_plain(path), None)

    def resolve(self, path: str) -> RtComponent:
        """Return the component at a path; RtcRefused if there is none."""
        path = _plain(path)
        if path not in self._components:
            known = ", ".join(self._components) or "none"
            raise RtcRefused(f"nothing at {path}; known: {known}")
        return self._components[path]

    def names(self, context: str = "") -> tuple[str, ...]:
        """Return what stands in a naming context: names, and contexts with `/` at their end."""
        prefix = f"{_plain(context)}/" if _plain(context) else ""
        rests = (path.removeprefix(prefix) for path in self._components if path.startswith(prefix))
        heads = (rest.partition("/") for rest in rests)
        return tuple(dict.fromkeys(head + slash for head, slash, _ in heads))


def _plain(path: str) -> str:
    return path.strip("/")
