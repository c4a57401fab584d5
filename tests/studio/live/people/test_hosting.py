import urllib.request

import pytest

from devices.clock import WallClock
from devices.hub.roles import Person, Role
from studio.live.people.hosting import (
    Hosting,
    certificate_folder,
    hosted,
    invitations_for,
    join_line,
    who_words,
)


def test_people_join_on_this_computer_with_a_code(tiny):
    hosting, said = Hosting(invitations=2), []
    with hosted(hosting, tiny.scene, clock=WallClock(), say=said.append) as hub:
        invitations = invitations_for(hub, hosting)
        line = join_line(hub, hosting, invitations=invitations)
        assert len({invitation.code for invitation in invitations}) == 2
        assert hub.url.startswith("http://127.0.0.1:")
        assert hub.url in line
        assert all(invitation.code in line for invitation in invitations)
        assert "for this computer alone" in line
        with urllib.request.urlopen(hub.url, timeout=5) as page:
            assert b"<title>" in page.read()
        assert "code" not in join_line(hub, hosting, invitations=())
    assert not any(code in text for text in said for code in (i.code for i in invitations))


def test_the_network_is_let_in_over_tls(tiny, tmp_path, monkeypatch):
    monkeypatch.setenv("NEXUS_HOME", str(tmp_path))
    hosting = Hosting(is_open=True)
    assert certificate_folder() == tmp_path / "certificates"
    with hosted(hosting, tiny.scene, clock=WallClock(), say=lambda _line: None) as hub:
        assert hub.url.startswith("https://")
        assert "open to the network, over TLS" in join_line(hub, hosting, invitations=())
    assert any((tmp_path / "certificates").iterdir())


def test_who_is_here_is_said_in_a_line():
    ann = Person("p1", 1, "Ann", Role.REMOTE)
    ben = Person("p2", 2, "Ben", Role.SPECTATOR, is_muted=True)
    cem = Person("p3", 3, "Cem", Role.REMOTE, is_connected=False)
    assert who_words(()) == ""
    assert who_words((ann,)) == "1 person here: Ann"
    many = tuple(Person(f"p{n}", n, f"P{n}", Role.REMOTE) for n in range(9))
    assert who_words(many) == "9 people here: P0, P1, P2, P3, P4, P5, 3 more"
    assert who_words((cem, ben, ann)) == "3 people here: Ann, Ben (spectator, muted), Cem (away)"


@pytest.mark.parametrize(("values", "said"), [((70000,), "port"), ((0, False, 17), "0 to 16")])
def test_numbers_have_limits(values, said):
    with pytest.raises(ValueError, match=said):
        Hosting(*values)
