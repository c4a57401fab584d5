"""The page's files: what is public, what imports what, and nothing from elsewhere."""

import re

from studio.web.live_page import IMPORT, PAGE, live_page


def text(asset):
    content = asset.content
    return content.decode() if isinstance(content, bytes) else content.read_text(encoding="utf-8")


def test_the_room_is_for_people_in_the_session_and_the_page_for_everybody(assets):
    private = {path for path, asset in assets.items() if asset.is_private}

    assert private == {path for path in assets if path.startswith("/assets/room/")}
    assert {"/", "/check"} <= set(assets)


def test_modules_import_each_other_by_addresses_that_are_served(assets):
    scripts = {path: text(asset) for path, asset in assets.items() if path.endswith(".js")}
    own = {p: s for p, s in scripts.items() if p.startswith(("/assets/live/", "/assets/shared/"))}

    named = {found[2] for source in own.values() for found in IMPORT.findall(source)}
    assert len(named) > 15
    assert named <= set(scripts)
    pages = text(assets["/"]) + text(assets["/check"])
    linked = set(re.findall(r'(?:src|href)="(/[^"]*)"', pages))
    assert linked <= set(assets)
    assert "@@" not in pages


def test_nothing_is_asked_of_another_place(assets):
    for path in ("/", "/check"):
        assert "http" not in text(assets[path])
    for source in PAGE.rglob("*.js"):
        assert "https://" not in source.read_text(encoding="utf-8")


def test_a_changed_module_has_another_address(box_room, modules, tmp_path, assets):
    changed = tmp_path / "OrbitControls.js"
    name = "three/addons/controls/OrbitControls.js"
    changed.write_text(modules[name].read_text() + "\n// changed\n")

    others = live_page(box_room, tmp_path / "live", modules={**modules, name: changed})

    assert not {p for p in others if p.endswith(".js")} & {
        p for p in assets if p.endswith(".js") and "early" not in p
    }
