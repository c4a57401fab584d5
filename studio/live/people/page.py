"""The page that people who join get, with the room that it shows."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from devices.hub.contract import Asset
from scenes.package import ScenePackage
from studio.session.opening import scene_hash
from studio.web.live_page import live_page
from studio.web.web_files import licences, web_modules

DIGEST_CHARACTERS = 24
"""Of a scene's digest in a folder's name: enough to differ."""


def page_assets(scene: ScenePackage, folder: Path, *, asks: str = "") -> Mapping[str, Asset]:
    """Return the files of the page by path; "/" is the page itself.

    Args:
        scene: the room.
        folder: for files that are made of it; it lives as long as they are served.
        asks: path of what a study asks those who are on the page; empty where there is none.

    Raises:
        OSError: the disk is full, or the page's libraries cannot be fetched.
    """
    return live_page(scene, folder, modules=web_modules(_drop), licences=licences(), asks=asks)


def _drop(_line: str) -> None:
    """Say nothing: the launcher has fetched the libraries before."""


def page_folder(scene: ScenePackage) -> Path:
    """Return the folder for a scene's page: in NEXUS_HOME where that is set, else in the cache."""
    import platformdirs

    named = os.environ.get("NEXUS_HOME")
    home = Path(named) if named else Path(platformdirs.user_cache_dir("gaussiannexus-studio"))
    return home / "pages" / scene_hash(scene)[:DIGEST_CHARACTERS]
