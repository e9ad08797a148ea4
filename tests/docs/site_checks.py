"""Checks of the built documentation site: ``python -m tests.docs.site_checks build/docs``.

Links and files without a browser; errors, loading from the network, sideways scrolling and
accessibility (axe-core, from the package ``axe-playwright-python``) with one.
"""

import sys
import tempfile
from collections.abc import Iterable, Iterator
from html.parser import HTMLParser
from importlib.util import find_spec
from pathlib import Path
from urllib.parse import unquote, urlsplit

from tests.browser import NAMES, Browser, PageError, find

API, SHARE = "docs/api/generated", 10
"""Folder of the API reference, whose pages have one template, and the share of them for a browser:
one in ten, since loading and checking a page takes a second or more."""
PHONE = (390, 844)
"""Width and height of a phone [CSS pixels]."""
TOO_WIDE = """(() => {
  const root = document.documentElement, width = root.clientWidth;
  if (root.scrollWidth <= width) return "";
  const wide = [...document.querySelectorAll("article *")]
    .filter((one) => one.getBoundingClientRect().right > width + 1);
  return `${root.scrollWidth} pixels wide instead of ${width}: `
    + wide.slice(0, 3).map((one) => one.outerHTML.slice(0, 80)).join(" | ");
})()"""
"""Expression: the first elements beyond the right edge, empty if the page does not scroll."""

AXE = """axe.run(document, {preload: false, resultTypes: ["violations"]}).then((found) =>
  found.violations.map((one) => `${one.id} (${one.nodes.length}): ${one.help}: `
    + one.nodes[0].html.slice(0, 120)))"""
"""Expression: the violations that axe finds, one sentence for each rule."""


def axe_script() -> str | None:
    """Return the source of axe-core, None if it is not installed."""
    found = find_spec("axe_playwright_python")
    if found is None or found.origin is None:
        return None
    return Path(found.origin).with_name("axe.min.js").read_text(encoding="utf-8")


class Links(HTMLParser):
    """Anchors of a page, its links, and the files that it loads."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.feed(page.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Collect the attributes of an element."""
        given = {name: value for name, value in attrs if value}
        self.anchors.update(given[key] for key in ("id", "name") if key in given)
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        loads = [given.get("src"), given.get("href") if tag == "link" else None]
        self.loaded += [address for address in loads if address]


def pages(folder: Path) -> list[Path]:
    """Return the pages of a site."""
    return sorted(folder.rglob("*.html"))


def for_browser(folder: Path) -> list[Path]:
    """Return the pages of a site that a browser loads: all, but of the API reference a share."""
    found = pages(folder)
    api = [page for page in found if page.is_relative_to(folder / API)]
    left_out = set(api) - set(api[::SHARE])
    return [page for page in found if page not in left_out]


def broken_links(folder: Path) -> Iterator[str]:
    """Return the links to files or anchors that do not exist, and what is loaded from elsewhere."""
    found = {page: Links(page) for page in pages(folder)}
    for page, links in found.items():
        shown = page.relative_to(folder)
        for address in links.loaded:
            if urlsplit(address).scheme in ("http", "https") or address.startswith("//"):
                yield f"{shown} loads {address} from the network"
        for address in [*links.links, *links.loaded]:
            parts = urlsplit(address)
            if parts.scheme or parts.netloc:
                continue
            target = (page.parent / unquote(parts.path)).resolve() if parts.path else page
            if not target.is_file():
                yield f"{shown} links to {address}, which does not exist"
            elif parts.fragment and target.suffix == ".html":
                there = found[target] if target in found else Links(target)
                if unquote(parts.fragment) not in there.anchors:
                    yield f"{shown} links to {address}, which has no such anchor"


def faults_in_browser(chosen: Iterable[Path], program: str) -> Iterator[str]:
    """Return console errors, violations of accessibility and sideways scrolling on a phone."""
    axe = axe_script()
    with (
        tempfile.TemporaryDirectory() as folder,
        Browser(program, Path(folder) / "profile") as browser,
    ):
        for path in chosen:
            try:
                with browser.page(path.as_uri()) as page:
                    if axe is not None:
                        page.evaluate(f"{axe}; 0")
                        yield from (f"{path}: {fault}" for fault in page.evaluate(AXE))
                    page.resize(*PHONE)
                    if wide := page.evaluate(TOO_WIDE):
                        yield f"{path}: {wide}"
            except PageError as error:
                yield f"{path}: {error}"


def main() -> None:
    """Check a built site; exit with the list of its faults."""
    folder = Path(sys.argv[1]).resolve()
    faults = list(broken_links(folder))
    program = find()
    if axe_script() is None:
        print("no axe here: pip install --no-deps axe-playwright-python to check accessibility")
    if program is None:
        print(f"no browser here: install one of {', '.join(NAMES)} to check the pages in it")
    else:
        chosen = for_browser(folder)
        print(f"loading {len(chosen)} pages in {program}, some seconds each", flush=True)
        faults += faults_in_browser(chosen, program)
    print(f"{len(pages(folder))} pages, {len(faults)} faults", *faults, sep="\n")
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
