"""The site beside the files: its first page, pages of the root, and links as they are on GitHub.

Documents link to each other by their places in the repository. The site holds `docs/` at its root;
links are rewritten to that, and files outside that are linked to are copied.

The demonstration is part of the site if it has been built: `nox -s demonstration`.
"""

import posixpath
import re
from pathlib import Path

from mkdocs.structure.files import File
from mkdocs.structure.nav import Link

ROOT = Path(__file__).parents[2]
PAGES = {"README.md": "index.md"} | {
    name: name for name in ("REPRODUCTION.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md")
}
"""Pages of the repository's root, and their paths on the site; links to the README lead there."""

FIRST_PAGE = "docs/site/first-page.md"
"""The first page of the site in place of the README, which is the one of the repository."""

TRY_IT = '<a class="md-button md-button--primary" href="demonstration/index.html">Try it now</a>'

DEMONSTRATION = "demonstration/index.html"
BUILT = [ROOT / "build" / "demonstration" / name for name in ("acrobot.wasm", "pole.wasm")]
"""Modules for browsers, compiled by `nox -s demonstration`."""

WIDE = ("evidence/benchmarks.md",)
"""Pages whose tables would be cut on a screen of 1,280 pixels otherwise."""

_LINK = re.compile(r"(?<=\]\()(?!https?:|mailto:|#)([^)#\s]*)(#[^)\s]*)?(?=\))")


def on_files(files, config):
    """Add the root's pages, and what they and others link to outside `docs`."""
    for name, place in PAGES.items():
        source = FIRST_PAGE if place == "index.md" else name
        files.append(File.generated(config, place, content=(ROOT / source).read_text("utf-8")))
    for page in list(files.documentation_pages()):
        for link in _LINK.finditer(page.content_string):
            target = _target(page.src_uri, link[1])
            if target and target not in PAGES and not target.startswith("docs/"):
                source = ROOT / target
                if source.is_file() and files.get_file_from_path(target) is None:
                    files.append(File.generated(config, target, abs_src_path=str(source)))
    if has_demonstration():
        for source in (*(ROOT / "docs" / "site" / "demonstration").iterdir(), *BUILT):
            place = f"demonstration/{source.name}"
            files.append(File.generated(config, place, abs_src_path=str(source)))
    return files


def has_demonstration():
    """Return whether everything that browsers run has been built."""
    return all(path.is_file() for path in BUILT)


def on_nav(nav, config, files):
    """Link to the demonstration, after the first page."""
    if has_demonstration():
        nav.items.insert(1, Link("Try it", DEMONSTRATION))
    return nav


def on_page_markdown(markdown, page, config, files):
    """Rewrite links from places in the repository to places on the site.

    Pages with wide tables get the room of the table of contents.
    """
    if page.file.src_uri in WIDE:
        page.meta["hide"] = ["toc"]

    def rewritten(link):
        target = _target(page.file.src_uri, link[1])
        if target is None:
            return link[0]
        if (ROOT / target).is_dir():
            target = posixpath.join(target, "README.md")
        place = PAGES.get(target, target.removeprefix("docs/"))
        return posixpath.relpath(place, posixpath.dirname(page.file.src_uri)) + (link[2] or "")

    try_it = TRY_IT if has_demonstration() else ""
    return _LINK.sub(rewritten, markdown).replace("<!-- try it now -->", try_it)


def _target(page, link):
    """Give what a page of the site links to, as a path in the repository."""
    if not link:
        return None
    sources = {place: name for name, place in PAGES.items()} | {"index.md": FIRST_PAGE}
    source = sources.get(page, f"docs/{page}")
    return posixpath.normpath(posixpath.join(posixpath.dirname(source), link))
