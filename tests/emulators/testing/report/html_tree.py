"""A page as a browser would take it apart: elements with their attributes and text."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from html.parser import HTMLParser

VOID = {"meta", "input", "br", "hr", "img", "link"}


@dataclass
class Element:
    tag: str
    attributes: dict[str, str] = field(default_factory=dict)
    children: list[Element | str] = field(default_factory=list)

    def all(self, tag: str = "", **attributes: str) -> list[Element]:
        """Return the elements below it, in order."""
        return [
            element
            for element in self.below()
            if (not tag or element.tag == tag)
            and all(
                element.attributes.get(name.rstrip("_")) == value
                for name, value in attributes.items()
            )
        ]

    def below(self) -> Iterator[Element]:
        for child in self.children:
            if isinstance(child, Element):
                yield child
                yield from child.below()

    def by_class(self, name: str) -> list[Element]:
        return [one for one in self.below() if name in one.attributes.get("class", "").split()]

    @property
    def text(self) -> str:
        texts = (child if isinstance(child, str) else child.text for child in self.children)
        return "".join(texts)

    @property
    def words(self) -> str:
        """The text as people read it, elements apart from each other."""
        texts = (child if isinstance(child, str) else child.words for child in self.children)
        return " ".join(" ".join(texts).split())


class _Builder(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.open = [Element("page")]

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        element = Element(tag, {name: value or "" for name, value in attrs})
        assert len(element.attributes) == len(attrs), f"an attribute is there twice: {attrs}"
        self.open[-1].children.append(element)
        if tag not in VOID:
            self.open.append(element)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        element = self.open.pop()
        assert element.tag == tag, f"<{element.tag}> is ended by </{tag}>"

    def handle_data(self, data: str) -> None:
        self.open[-1].children.append(data)


def parse_page(text: str) -> Element:
    """Take a page apart; AssertionError if an element is not closed."""
    builder = _Builder()
    builder.feed(text)
    builder.close()
    assert [element.tag for element in builder.open] == ["page"]
    return builder.open[0]
