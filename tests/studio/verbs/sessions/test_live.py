"""The verb's flags: what goes together, and words for what does not."""

from __future__ import annotations

import argparse

import pytest

from devices.camera.address import AddressKind
from studio.cli import main
from studio.live.people.hosting import Hosting
from studio.live.setup import Place
from studio.verbs.flags.hololens import HOSTILE, check_hostile
from studio.verbs.sessions.live import add_arguments, hosting_of, setup_of


def parsed(*words):
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    return parser.parse_args(words)


def test_flags_become_a_setup():
    usual = setup_of(parsed())
    assert (usual.camera.kind, usual.camera.port) == (AddressKind.RTMP_LISTEN, 1935)
    assert usual.place is Place.FIND
    assert setup_of(parsed("--simulated")).camera.port == 0
    chosen = setup_of(parsed("--camera", "insta360://10.0.0.2", "--layout", "stacked 90 270"))
    assert chosen.camera.kind is AddressKind.INSTA360
    assert chosen.layout.turns == (1, 3)


def test_people_join_where_the_flags_say():
    assert hosting_of(parsed()) is None
    assert hosting_of(parsed("--people")) == Hosting()
    assert hosting_of(parsed("--people", "8443", "--invite", "3")) == Hosting(8443, invitations=3)
    assert hosting_of(parsed("--people-open")).is_open
    crowd = hosting_of(parsed("--clients", "64"))
    assert (crowd.invitations, crowd.is_open) == (0, False)
    assert crowd.max_people > 64


def test_simulated_people_are_measured_without_a_window(capsys, no_traceback):
    assert main(["live", "lab", "--simulated", "--clients", "2"]) == 3
    assert "--clients goes with --headless" in capsys.readouterr().err


def test_hostile_visits_come_only_where_all_is_simulated():
    simulated = ("--headless", "--simulated", "--hololens")
    for words, visits in (((), 0), (simulated, HOSTILE), ((*simulated, "--hostile", "0"), 0)):
        args = parsed(*words)
        check_hostile(args)
        assert args.hostile == visits
    for words in (("--hostile", "5"), (*simulated, "10.0.0.1", "--hostile", "5")):
        with pytest.raises(ValueError, match="real people and devices are not attacked"):
            check_hostile(parsed(*words))
    with pytest.raises(ValueError, match="wanted 0 to"):
        check_hostile(parsed(*simulated, "--hostile", "-1"))


def test_a_file_of_devices_is_read(tmp_path):
    path = tmp_path / "devices.toml"
    path.write_text('[camera]\naddress = "rtmp://:1999/a/b"\nplace = "scan"\n')
    assert setup_of(parsed("--devices", str(path))).place is Place.SCAN


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("--camera", "telegraph://x"), "telegraph"),
        (("--layout", "sideways"), "sideways"),
        (("--seconds", "0"), "--seconds 0"),
        (("--seed", "3"), "--simulated"),
        (("--devices", "nowhere.toml"), "nowhere.toml"),
        (("--people", "70000"), "--people 70000: wanted a port"),
        (("--people", "--invite", "17"), "--invite 17: wanted 0 to 16"),
    ],
)
def test_mistakes_are_one_line(words, named, capsys, tmp_path, monkeypatch, no_traceback):
    monkeypatch.chdir(tmp_path)
    assert main(["live", "lab", "--headless", *words]) != 0
    said = capsys.readouterr().err
    assert named in said
    assert "Traceback" not in said
