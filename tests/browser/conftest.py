"""A local server of the demonstration's pages, and Chromium to open them."""

import functools
import http.server
import shutil
import threading
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace

import pytest

ROOT = Path(__file__).parents[2]
PAGES = ROOT / "docs" / "site" / "demonstration"
BUILT = [ROOT / "build" / "demonstration" / name for name in ("acrobot.wasm", "pole.wasm")]


class QuietHandler(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


@pytest.fixture(scope="session")
def folder(tmp_path_factory, skip_unless_ci):
    """The folder of the demonstration as on the site."""
    if not all(path.is_file() for path in BUILT):
        skip_unless_ci("needs the demonstration: nox -s demonstration (pip install nox ziglang)")
    folder = tmp_path_factory.mktemp("site") / "demonstration"
    shutil.copytree(PAGES, folder)
    for path in BUILT:
        shutil.copy(path, folder)
    return folder


@pytest.fixture(scope="session")
def address(folder):
    handler = functools.partial(QuietHandler, directory=folder)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()
        thread.join()


@pytest.fixture
def visit(chromium, address):
    """Opens a page in a new context; afterwards it must have had no error or outside request."""
    contexts, problems = [], []

    def _visit(name, **options):
        options.setdefault("viewport", {"width": 1280, "height": 900})
        context = chromium.new_context(**options)
        contexts.append(context)
        page = context.new_page()
        page.on("pageerror", lambda error: problems.append(f"error: {error}"))
        page.on("console", lambda message: note(message.type, message.text))
        page.on("requestfailed", lambda request: problems.append(f"failed: {request.url}"))
        page.on("request", lambda request: note_request(request.url))
        page.goto(f"{address}/{name}")
        return page

    def note(severity, text):
        if severity in ("error", "warning"):
            problems.append(f"{severity}: {text}")

    def note_request(url):
        if not url.startswith((address, "data:")):
            problems.append(f"outside request: {url}")

    yield _visit
    for context in contexts:
        with suppress(Exception):
            context.close()
    assert problems == []


@pytest.fixture
def controls():
    """Functions that use a page's controls as a person does."""

    def slide(page, name, value):
        page.locator(f"#{name}").fill(str(value))

    def speed_up(page):
        slide(page, "speed", 4)

    return SimpleNamespace(slide=slide, speed_up=speed_up)
