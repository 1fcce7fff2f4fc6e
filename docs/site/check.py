"""Prove that the links of the built site hold and its reference is near: ``check.py SITE``.

Walks the HTML: every link to a page, file or heading of the site exists, every page is reached from
the start page, and the page of every command and every public function by two clicks at most.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

START = "docs/index.html"
CLICKS = 2


class Page(HTMLParser):
    """Names that can be linked to, and links, of an HTML page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.names: set[str] = set()
        self.links: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Collect ``id``, ``href`` and ``src``."""
        for name, value in attrs:
            if value and name == "id":
                self.names.add(value)
            elif value and ((tag, name) == ("a", "href") or name == "src"):
                self.links.append(value)


def read_site(site: Path) -> dict[str, Page]:
    """Parse all pages of a site, by path below it."""
    return {
        path.relative_to(site).as_posix(): Page(path.read_text(encoding="utf-8"))
        for path in sorted(site.rglob("*.html"))
        if "_static" not in path.parts and "_downloads" not in path.parts
    }


def inner_links(name: str, page: Page, site: Path) -> Iterable[tuple[str, str]]:
    """Yield path below the site and fragment of the links that stay in the site."""
    for link in page.links:
        parts = urlsplit(link)
        if parts.scheme or parts.netloc:
            continue
        path, fragment = unquote(parts.path), parts.fragment  # without `?v=…` of style sheets
        target = ((site / name).parent / path).resolve() if path else site / name
        if target.is_dir():
            target /= "index.html"
        yield target.relative_to(site).as_posix(), unquote(fragment)


def broken_links(site: Path, pages: dict[str, Page]) -> list[str]:
    """List links to files or headings that are not there."""
    broken = []
    for name, page in pages.items():
        for target, fragment in inner_links(name, page, site):
            if not (site / target).is_file():
                broken.append(f"{name}: {target} is not there")
            elif fragment and target in pages and fragment not in pages[target].names:
                broken.append(f"{name}: {target} has no #{fragment}")
    return broken


def clicks_from_start(site: Path, pages: dict[str, Page]) -> dict[str, int]:
    """Count the clicks that each page is away from the start page."""
    clicks = {START: 0}
    edge = [START]
    while edge:
        found = []
        for name in edge:
            for target, _ in inner_links(name, pages[name], site):
                if target in pages and target not in clicks:
                    clicks[target] = clicks[name] + 1
                    found.append(target)
        edge = found
    return clicks


def missing_from_reference(pages: dict[str, Page], names: Iterable[str], folder: str) -> list[str]:
    """List commands or functions that have no page of their own."""
    return [f"{name} has no page" for name in names if f"{folder}/{name}.html" not in pages]


def problems(site: Path, commands: Iterable[str], functions: Iterable[str]) -> list[str]:
    """List all that is wrong with a site that should document these commands and functions."""
    pages = read_site(site)
    clicks = clicks_from_start(site, pages)
    reference = "docs/reference"
    far = [
        f"{name} is {clicks.get(name, 'no number of')} clicks from the start"
        for name in pages
        if name.startswith(f"{reference}/") and clicks.get(name, CLICKS + 1) > CLICKS
    ]
    # What Sphinx makes beside the pages is reached by searching.
    made = {"index.html", "genindex.html", "search.html", "py-modindex.html"}
    lost = [f"{name} is not reached" for name in pages if name not in clicks and name not in made]
    return [
        *broken_links(site, pages),
        *far,
        *lost,
        *missing_from_reference(pages, commands, f"{reference}/commands"),
        *missing_from_reference(pages, functions, f"{reference}/api"),
    ]


def main() -> None:
    """Check a site; end with its problems, if there are any."""
    import reference

    import synfeal

    site = Path(sys.argv[1]).resolve()
    functions = [f"synfeal.{name}" for name in synfeal.__all__]
    found = problems(site, reference.command_parsers(), functions)
    if found:
        sys.exit("\n".join(found))
    print(f"{site}: links hold, and every command and function is within {CLICKS} clicks")


if __name__ == "__main__":
    main()
