from studio.app.model.actions import Action
from studio.app.model.keys import clashes, keys_of
from studio.app.model.settings import Settings, load_settings, save_settings


def test_settings_come_back(tmp_path):
    path = tmp_path / "settings.json"
    settings = Settings(theme="light", text_scale=1.3, keys={"a.b": "Ctrl+B"}).opened("lab")
    save_settings(settings, path)
    assert load_settings(path) == (settings, "")


def test_recent_scenes_are_in_order_once_and_few():
    settings = Settings()
    for name in [*(f"room {i}" for i in range(20)), "room 15"]:
        settings = settings.opened(name)
    assert settings.recent[:3] == ("room 15", "room 19", "room 18")
    assert len(settings.recent) == 12


def test_damaged_settings_are_put_aside(tmp_path):
    path = tmp_path / "settings.json"
    path.write_text("{")
    found, problem = load_settings(path)
    assert found == Settings()
    assert "settings.json.damaged" in problem
    assert (tmp_path / "settings.json.damaged").read_text() == "{"


def test_a_wrong_value_costs_only_itself(tmp_path):
    path = tmp_path / "settings.json"
    path.write_text('{"theme": "pink", "text_scale": 1.3, "layout": "%%%"}')
    found, problem = load_settings(path)
    assert (found.theme, found.text_scale, found.layout) == ("dark", 1.3, "")
    assert "theme" in problem
    assert "layout" in problem


def test_own_keys_come_before_the_preset_and_clashes_are_found():
    move = Action("view.tool_move", "Move", "View", lambda: None, keys="2")
    turn = Action("view.tool_turn", "Turn", "View", lambda: None, keys="3")
    blender = Settings(key_preset="blender")
    assert (keys_of(move, Settings()), keys_of(move, blender)) == ("2", "G")
    assert keys_of(move, Settings(key_preset="blender", keys={move.id: "M"})) == "M"
    assert clashes([move, turn], Settings()) == {}
    assert list(clashes([move, turn], Settings(keys={move.id: "3"}))) == ["3"]
