"""The page that people who join get, with the room that it shows."""

from __future__ import annotations

from collections.abc import Mapping

from devices.hub.server import Asset
from scenes.package import ScenePackage


def page_assets(scene: ScenePackage) -> Mapping[str, Asset]:
    """Return the files of the page by path; "/" is the page itself."""
    return {"/": Asset(f"<!doctype html><title>{scene.name}</title>".encode(), "text/html")}
