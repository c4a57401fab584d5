"""Hostile clients at the hub's port: nothing breaks, and somebody friendly is served."""

from benchmarks.wire import attack_hub as module
from benchmarks.wire.attack_hub import attack_hub, resident_bytes


def test_hostile_streams_break_nothing():
    counts = attack_hub(200, first_seed=1)
    assert (counts.streams, counts.crashes) == (200, 0)
    assert counts.refused > 20
    assert counts.growth_mb < 50
    assert resident_bytes() > 1e6


def test_a_defect_is_counted(monkeypatch, capsys):
    def fail(*_args, **_kwargs):
        raise ZeroDivisionError

    monkeypatch.setattr("devices.hub.session.Session.see_body", fail)
    assert attack_hub(100).crashes > 0
    assert "defect in the hub: ZeroDivisionError" in capsys.readouterr().err


def test_a_hub_that_serves_nobody_is_counted(monkeypatch, capsys):
    monkeypatch.setattr(module, "attack", lambda *_args: None)

    def check(_address):
        raise OSError("gone")

    monkeypatch.setattr(module, "_check_page", check)
    assert attack_hub(50, first_seed=7).crashes == 1
    assert "the hub after seed 7: gone" in capsys.readouterr().err
