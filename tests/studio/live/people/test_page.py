from studio.live.people.page import page_assets, page_folder


def test_there_is_a_page(tiny, tmp_path):
    assets = page_assets(tiny.scene, tmp_path)
    assert assets["/"].content_type.startswith("text/html")


def test_a_page_s_folder_is_the_scene_s(tiny, tmp_path, monkeypatch):
    monkeypatch.setenv("NEXUS_HOME", str(tmp_path))
    folder = page_folder(tiny.scene)
    assert folder.parent == tmp_path / "pages"
    assert folder == page_folder(tiny.scene)
