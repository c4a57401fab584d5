"""The page of the live room, as the files that the hub serves.

It grew out of the shared viewer and has modules, libraries and files of splats in common with it,
hence this room below both `studio/handover` and `studio/live`. The viewer is one file for the mail;
this page is many files that a server sends, the room's to people in the session alone.
"""

from __future__ import annotations

import hashlib
import html
import re
import threading
from collections.abc import Mapping
from pathlib import Path

from devices.hub.contract import Asset
from scenes.package import ScenePackage
from studio.view.fonts import FACES, WEIGHTS
from studio.web.figure_file import figure_file
from studio.web.room_files import MAX_SPLATS, write_room_files
from studio.web.web_files import STYLE, module_source, shared_sources

PAGE = Path(__file__).parent / "live"
"""The page's own files."""

ENTRIES = ("start.js", "check.js")
"""Modules that a page begins with."""

EARLY = "early.js"
"""A script that is no module, for browsers that know none."""

JAVASCRIPT, SPLATS, JSON = "text/javascript", "application/octet-stream", "application/json"
FIGURE = "model/mesh"
"""Types in HTTP answers."""

DIGEST_CHARACTERS = 10
"""Of a digest in a file's name: enough to differ, and the hub lets browsers keep such files."""

IMPORT = re.compile(r"""(\b(?:from|import)\s*\(?\s*)(["'])([^"'\n]{1,80})\2""")
"""An import of a module by its name; a page of a strict policy may not map names itself."""


def live_page(
    scene: ScenePackage,
    folder: Path,
    *,
    modules: Mapping[str, Path],
    licences: str = "",
    asks: str = "",
    max_splats: int = MAX_SPLATS,
    cancelled: threading.Event | None = None,
) -> dict[str, Asset]:
    """Return the files of the page by their path on the server, "/" the page itself.

    What was made for the same scene is taken as it lies in the folder.

    Args:
        scene: the room and its objects.
        folder: the caller's, which lives as long as the files are served.
        modules: library modules by the name they are imported under, see `web_files.web_modules`.
        licences: theirs, at `/assets/licences.txt`.
        asks: path of what a study asks those who are on the page; empty where there is none.
        max_splats: of room and objects together.
        cancelled: set it from another thread to stop.

    Raises:
        CancelledError: it was cancelled.
        OSError: the disk is full, or a file of the program is missing.
    """
    room = write_room_files(scene, folder / "room", max_splats=max_splats, cancelled=cancelled)
    own = {
        f"live/{path.relative_to(PAGE).as_posix()}": path
        for path in sorted(PAGE.rglob("*.js"))
        if path.name != EARLY
    }
    sources = {name: module_source(path) for name, path in {**modules, **own}.items()}
    sources |= shared_sources()
    addresses = _addresses(sources)
    assets = {
        addresses[name]: Asset(_with_addresses(source.decode(), addresses).encode(), JAVASCRIPT)
        for name, source in sources.items()
    }
    preloads = "\n".join(
        f'<link rel="modulepreload" href="{addresses[name]}">'
        for name in addresses
        if name not in {f"live/{entry}" for entry in ENTRIES}
    )
    figure_path, assets[figure_path] = _figure()
    filled = {"PRELOADS": preloads, "FIGURE": figure_path, "ASKS": asks}
    filled |= {f"LIVE/{entry}": addresses[f"live/{entry}"] for entry in ENTRIES}
    for path, name in (("/", "live.html"), ("/check", "check.html")):
        assets[path] = Asset(_filled(PAGE / name, filled), "text/html; charset=utf-8")
    assets["/assets/early.js"] = Asset((PAGE / EARLY).read_bytes(), JAVASCRIPT)
    for name, path in (("style.css", STYLE), ("live.css", PAGE / "live.css")):
        assets[f"/assets/{name}"] = Asset(path.read_bytes(), "text/css; charset=utf-8")
    for weight, name in WEIGHTS.items():
        assets[f"/assets/fonts/{weight}.ttf"] = Asset(FACES / name, "font/ttf")
    assets["/assets/licences.txt"] = Asset(licences.encode(), "text/plain; charset=utf-8")
    for name, path in room.items():
        kind = JSON if path.suffix == ".json" else SPLATS
        assets[f"/assets/room/{name}"] = Asset(path, kind, is_private=True)
    return assets


def _figure() -> tuple[str, Asset]:
    """Return the path of the figure of people, which changes with it, and the file."""
    figure = figure_file()
    path = f"/assets/figure-{hashlib.sha256(figure).hexdigest()[:DIGEST_CHARACTERS]}.bin"
    return path, Asset(figure, FIGURE)


def _addresses(sources: Mapping[str, bytes]) -> dict[str, str]:
    """Return the path of each module; all change where one does, as they name each other."""
    digest = hashlib.sha256()
    for name, source in sorted(sources.items()):
        digest.update(f"{name} {len(source)}\n".encode())
        digest.update(source)
    mark = digest.hexdigest()[:DIGEST_CHARACTERS]
    return {
        name: f"/assets/{name.removeprefix('@').removesuffix('.js')}-{mark}.js" for name in sources
    }


def _with_addresses(source: str, addresses: Mapping[str, str]) -> str:
    def replaced(found: re.Match[str]) -> str:
        before, quote, name = found.groups()
        return f"{before}{quote}{addresses.get(name, name)}{quote}"

    return IMPORT.sub(replaced, source)


def _filled(path: Path, texts: Mapping[str, str]) -> bytes:
    page = path.read_text(encoding="utf-8")
    for name, text in texts.items():
        page = page.replace(f"@@{name}@@", text if text.startswith("<") else html.escape(text))
    return page.encode()
