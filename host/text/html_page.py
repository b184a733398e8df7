"""Self-contained HTML pages from Jinja2 templates (extra `report`).

A template passes each value through `harmless` and escapes it. Only the style sheet and the script
of the page are marked as safe. The page allows only a style sheet and a script with their hashes.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files
from typing import Any, Final

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from tickrig.host.text import page_text
from tickrig.host.text.values import counted, format_time

_FOLDER: Final = "template"
_STYLE: Final = "page.css"


class PageTemplate:
    """Jinja2 template for a self-contained HTML page, from the folder `template` of a package.

    Args:
        package: name of the package.
        names: filters and globals that the template uses, in addition to the common ones.
        script: file name of the JavaScript of the page, empty if it has none.
        page: file name of the template.
    """

    def __init__(
        self, package: str, names: Mapping[str, Any], script: str = "", page: str = "page.html"
    ) -> None:
        folder = files(package).joinpath(_FOLDER)
        self._style = folder.joinpath(_STYLE).read_text("utf-8")
        self._script = folder.joinpath(script).read_text("utf-8") if script else ""
        environment = Environment(
            loader=PackageLoader(package, _FOLDER),
            autoescape=True,
            finalize=page_text.harmless,
            undefined=StrictUndefined,
            trim_blocks=True,
            lstrip_blocks=True,
        )
        environment.filters |= {
            "duration": page_text.duration,
            "size": page_text.size,
            "seconds": page_text.seconds,
            "time": format_time,
            "counted": counted,
        }
        environment.filters |= {name: each for name, each in names.items() if name.islower()}
        environment.globals |= names
        self._template = environment.get_template(page)

    def render(self, **values: Any) -> str:
        """Return the HTML page with the given values. Equal values always give the same page."""
        policy = page_text.content_policy(self._style, self._script)
        return self._template.render(
            style=Markup(self._style), script=Markup(self._script), policy=policy, **values
        )
