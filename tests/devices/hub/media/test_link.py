"""The process of media from the hub's side: begun once, begun again, ended with the hub."""

import time

import pytest

from devices.hub.media import frames
from devices.hub.media.link import AGAIN_NS, MediaLink

pytest.importorskip("aiortc")


@pytest.fixture
def link():
    said, deaths = [], []
    link = MediaLink(
        ["127.0.0.1"],
        took=lambda kind, data: said.append((kind, data)),
        died=lambda: deaths.append(1),
    )
    link.said, link.deaths = said, deaths
    yield link
    link.close()


def wait_for(wanted, seconds=120.0):
    deadline = time.monotonic() + seconds
    while not wanted():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def test_it_begins_once_answers_and_ends(link):
    link.send(b"before there is one, nothing goes anywhere")
    assert not link.is_running
    assert link.begin(0)
    assert link.begin(1)
    process = link.process_id
    wait_for(lambda: link.said)
    assert frames.read_order(link.said[0][1]) == {"say": "ready"}
    link.send(frames.pack_order({"do": "surfaces", "ids": ["wall"]}), is_order=True)
    wait_for(lambda: len(link.said) > 1)
    assert frames.read_order(link.said[1][1])["videos"][0] == "wall"
    assert link.process_id == process
    link.close()
    assert not link.is_running
    assert not link.begin(10**12), "it has ended for good"
    assert link.deaths == []


def test_one_that_dies_is_noticed_and_begins_again_but_not_at_once(link):
    link.begin(0)
    link._process.kill()
    wait_for(lambda: link.deaths)
    assert not link.is_running
    assert not link.begin(AGAIN_NS - 1)
    assert link.begin(AGAIN_NS)
