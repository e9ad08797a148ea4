"""Reader of a report page."""

from html.parser import HTMLParser

SECTIONS = {
    "replay": {"replay", "zoom"},
    "residual": {"residual", "structure", "scatter"},
    "loops": {"loops"},
    "rivals": {"rivals"},
    "kinds": {"kinds"},
    "effects": {"effects"},
    "isolability": {"isolability"},
    "details": set(),
    "provenance": set(),
}
"""Sections of the page, and the figures of a complete one."""
VOID = {"meta", "br", "img", "link", "input", "hr"}


class Page(HTMLParser):
    """Reads a page: ids, addresses, figures by section, text; complains of what does not close."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.addresses: list[str] = []
        self.tags: set[str] = set()
        self.attributes: set[str] = set()
        self.figures: dict[str, set[str]] = {}
        self.labels: list[str] = []
        self.captions = 0
        self.section = ""
        self.text = ""
        self.feed(html)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = {k: v or "" for k, v in attrs}
        self.handle_startendtag(tag, attrs)
        if tag not in VOID:
            self.open.append(tag)
        if tag == "section":
            self.section = found["id"]
            self.figures[self.section] = set()
        if tag == "figure":
            self.figures[self.section].add(found["id"].removeprefix("figure-"))
        if tag == "svg":
            self.labels.append(found["aria-label"])
        self.captions += tag == "figcaption"

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.attributes |= {name for name, _ in attrs}
        for name, value in attrs:
            if name == "id":
                self.ids.append(value or "")
            if name in ("href", "src", "xlink:href", "action", "data"):
                self.addresses.append(value or "")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data
