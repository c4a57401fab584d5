"""A live recording never takes an earlier one's name, finished or not."""

from __future__ import annotations

from studio.live.setup import recording_in


def test_names_do_not_repeat(tmp_path, monkeypatch):
    monkeypatch.setattr("time.strftime", lambda form: form.replace("%Y%m%d-%H%M%S", "20261125"))
    first = recording_in(tmp_path)
    assert first.name == "live-20261125.mcap"
    first.write_bytes(b"")
    second = recording_in(tmp_path)
    second.with_name(second.name + ".part").write_bytes(b"")
    assert recording_in(tmp_path).name == "live-20261125-3.mcap"
