"""Shapes of a room and its site: made, given, moved and erased on either side, decided in one."""

import json
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.clock import ManualClock
from devices.hub.contract import HubSettings
from devices.hub.entities.drawn import Drawn
from devices.hub.protocol.messages import Do, Hello, Wish
from devices.hub.roles import Op, Role
from devices.hub.server import Hub
from devices.sites.about import RoomAbout
from devices.sites.channels import WISHES
from devices.sites.wishes import MAX_ASKED, pack_wish, read_answers
from devices.transport.followed import LogNews, News
from devices.transport.keys import site
from devices.transport.local import Exchange, LocalTransport
from devices.transport.wire import Entry
from scenes.pose import Pose
from scenes.state import SceneState, reduce_state
from studio.live.sites.deciding import SEEN_NS, Decisions
from studio.live.sites.joined_site import JoinedSite
from studio.live.sites.shared_room import SharedRoom
from tests.studio.live.sites.test_both_sides import play

BOX = {"shape": "box", "size": [0.3, 0.3, 0.3], "colour": [1, 0, 0]}
ROOM_EPOCH, SITE_EPOCH = 5, 6


def at(x):
    return {**BOX, "pose": [x, 0, 0, 0, 0, 0, 1]}


def placed(shapes):
    return {key: (it["by"], it["pose"][0]) for key, it in shapes.items()}


def test_a_shape_is_seen_and_given_on_both_sides(building):
    async def script(here, there, until):
        assert await here.answered(until, op="primitive", primitive="a", **at(1)) == "done"
        await until(lambda: placed(there.shapes) == {"lab.p1/a": ("lab.p1", 1)})
        await until(lambda: len(there.people) == len(here.people) == 2)
        # Ann gives it to Ben, who is at the site: he moves it, and she no longer.
        gift = {"op": "give", "primitive": "p1/a", "to": "north.p1"}
        assert await here.answered(until, **gift) == "done"
        await until(lambda: placed(there.shapes) == {"lab.p1/a": ("p1", 1)})
        moved = {"op": "primitive", "primitive": "lab.p1/a", **at(2)}
        assert await there.answered(until, **moved) == "done"
        assert placed(here.shapes) == {"p1/a": ("north.p1", 2)}
        refused = await here.answered(until, op="primitive", primitive="a", **at(3))
        assert refused == "Ben has it"
        # The site's page has the shape where it put it before it learns that it was done.
        assert placed(there.shapes_at_answers[1]) == {"lab.p1/a": ("p1", 2)}
        back = {"op": "give", "primitive": "lab.p1/a", "to": "lab.p1"}
        assert await there.answered(until, **back) == "done"
        assert await there.answered(until, **moved) == "Ann has it"
        known = building.state.primitives["p1/a"]
        assert (known.user_id, known.world_from_primitive.translation[0]) == ("p1", 2.0)

    play(building, script)


def test_a_shape_of_the_site_is_made_taken_back_and_erased(building):
    async def script(here, there, until):
        await until(lambda: len(there.people) == len(here.people) == 2)
        assert await there.answered(until, op="primitive", primitive="b", **at(1)) == "done"
        assert placed(there.shapes) == {"p1/b": ("p1", 1)}
        await until(lambda: placed(here.shapes) == {"north.p1/b": ("north.p1", 1)})
        await there.answered(until, op="primitive", primitive="b", drag=2, **at(4))
        assert await there.answered(until, op="undo") == "done"
        await until(lambda: placed(here.shapes) == {"north.p1/b": ("north.p1", 1)})
        assert await there.answered(until, op="undo") == "done"
        await until(lambda: not here.shapes and not there.shapes)
        assert await there.answered(until, op="undo") == "there is nothing to undo"
        assert not building.state.primitives

    play(building, script)


def test_shapes_of_a_site_that_is_away_go_to_whoever_asks_first(building):
    async def script(here, there, until):
        await until(lambda: len(there.people) == len(here.people) == 2)
        assert await there.answered(until, op="primitive", primitive="b", **at(1)) == "done"
        take = {"op": "give", "primitive": "north.p1/b", "to": "p1"}
        assert await here.answered(until, **take) == "Ben has it"
        site_turn, building.site.turn = building.site.turn, lambda: None
        await until(lambda: len(here.people) == 1)
        assert await here.answered(until, **take) == "done"
        building.site.turn = site_turn
        await until(lambda: placed(there.shapes) == {"p1/b": ("lab.p1", 1)})
        await until(lambda: len(here.people) == 2)
        moved = {"op": "primitive", "primitive": "b", **at(2)}
        assert await there.answered(until, **moved) == "Ann has it"

    play(building, script)


def test_a_site_whose_room_is_away_refuses(building):
    async def script(here, there, until):
        await until(lambda: len(there.people) == len(here.people) == 2)
        building.room.turn = lambda: None
        await until(lambda: not building.site.status().is_reached)
        why = await there.answered(until, op="primitive", primitive="b", **at(1))
        assert why == "the room is not reached"
        assert not there.shapes

    play(building, script)


def test_shapes_over_a_router_whose_link_is_cut_and_healed(routed):
    building, network = routed

    async def script(here, there, until):
        await until(lambda: len(there.people) == len(here.people) == 2)
        assert await there.answered(until, op="primitive", primitive="b", **at(1)) == "done"
        assert await there.answered(until, op="primitive", primitive="c", **at(2)) == "done"
        await until(lambda: len(here.shapes) == 2)
        network.split()
        await there.do(id=99, op="primitive", primitive="b", **at(5))
        await until(lambda: len(here.people) == 1)
        take = {"op": "give", "primitive": "north.p1/b", "to": "p1"}
        assert await here.answered(until, **take) == "done"
        network.heal()
        await until(lambda: len(here.people) == 2 and 99 in there.answers)
        owners = {"p1/b": "hall-3.p1", "p1/c": "p1"}
        await until(lambda: {key: it["by"] for key, it in there.shapes.items()} == owners)
        assert here.shapes["north.p1/b"]["pose"] == there.shapes["p1/b"]["pose"]
        moved = {"op": "primitive", "primitive": "c", **at(7)}
        assert await there.answered(until, **moved) == "done"
        assert here.shapes["north.p1/c"]["pose"][0] == 7

    play(building, script)


def test_a_room_without_a_hub_decides_as_well(building):
    building.room._hub, building.room._inner = (lambda: None), None

    async def script(_here, there, until):
        building.turn()
        await until(lambda: building.site.status().is_reached)
        assert await there.answered(until, op="primitive", primitive="b", **at(1)) == "done"
        assert placed(there.shapes) == {"p1/b": ("p1", 1)}
        nobody = {"op": "give", "primitive": "b", "to": "lab.p9"}
        assert await there.answered(until, **nobody) == "nobody of that name is here"
        await there.answered(until, op="primitive", primitive="b", drag=2, **at(2))
        assert list(building.state.primitives) == ["north.p1/b"]

    play(building, script)


# What a site says, byte by byte


def box(x=1.0):
    size, pose = (0.3, 0.3, 0.3), Pose.from_yaw(0.0, (x, 0, 0))
    key = "north.p1/a"
    return Drawn(Op.PRIMITIVE, key, "", shape="box", size_m=size, room_from_entity=pose)


def wish(x=1.0, *, person="p1"):
    return pack_wish(Wish(person, Do(1, Op.PRIMITIVE, box(x))), room_epoch=ROOM_EPOCH)


def news(*items, is_whole=False):
    entries = tuple(Entry(n + 1, name, data) for n, (name, data) in enumerate(items))
    logs = {WISHES: LogNews(is_whole, entries)}
    return News(site("lab", "north"), False, False, {}, (1, 1), {}, logs, SITE_EPOCH)


class Room:
    """Decisions, and what was carried out."""

    def __init__(self):
        self.decisions, self.state, self.done = Decisions(ROOM_EPOCH), SceneState(), []

    def act(self, person_id, do):
        self.done.append((person_id, do.drawn.key))
        return replace(do.drawn, by=person_id)

    def take(self, *items, now_ns=0, **how):
        self.decisions.take(news(*items, **how), now_ns)
        self.decisions.carry_out(self.act, now_ns)
        said = self.decisions.answers(self.state, now_ns)
        return read_answers(said["north"]) if said else None


def test_each_wish_is_carried_out_once_and_answered_once_it_is_in_the_state():
    room = Room()
    first = ("1", wish())
    assert room.take(first, is_whole=True).done == 0
    assert room.done == [("north.p1", "north.p1/a")]
    assert room.take(first, is_whole=True) is None, "nothing new"
    room.state = reduce_state(room.state, replace(box(), by="north.p1").entity(), 1)
    assert room.take().done == 1
    assert room.take(("1", b"")) is None
    assert len(room.done) == 1
    # Another came before the session's next picture, and the state was never like it.
    room.take(("2", wish(2.0)))
    assert room.take(now_ns=SEEN_NS - 1) is None
    assert room.take(now_ns=SEEN_NS).done == 2


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (b"junk", "wish: no JSON"),
        (b"{}", "wish: room: wanted a text"),
        (wish().replace(b'"5"', b'"4"'), "the room has started again"),
        (wish().replace(b'"primitive","', b'"line","'), "wish"),
        (wish(person="p1/x"), "wish: by"),
        (wish(x=1e9), "wish: pose: a place is over"),
        (b"[" * 5000, "wish: 5000 bytes, at most 4096"),
    ],
)
def test_a_hostile_wish_is_refused_in_one_line(data, why):
    room = Room()
    answers = room.take(("1", data))
    assert answers.refused[1].startswith(why)
    assert "\n" not in answers.refused[1]
    assert room.done == []
    assert room.decisions.refused == 1
    assert room.take(("1", b"")).refused == {}
    room.take(("2", wish()))
    assert len(room.done) == 1


def test_wishes_have_limits():
    room = Room()
    answers = room.take(*((str(n), wish()) for n in range(1, 2 * MAX_ASKED)))
    assert len(room.done) == MAX_ASKED
    assert set(answers.refused.values()) == {"your site changes too many shapes at once"}
    assert len(answers.refused) <= MAX_ASKED
    room.take(("word", wish()), ("-1", wish()), ("1" * 400, wish()))
    assert room.decisions.refused == MAX_ASKED - 1 + 3


# Whatever the order


class Together:
    """A room with two people and a site with two, turned by hand; no socket."""

    def __init__(self):
        exchange, self.clock = Exchange(), ManualClock()
        self.hubs = [Hub(HubSettings(), {}, clock=self.clock) for _ in range(2)]
        self.room = SharedRoom(
            LocalTransport(exchange),
            "lab",
            about=RoomAbout("lab", "abc"),
            inner=self.hubs[0],
            hub=lambda: self.hubs[0],
            clock=self.clock,
            epoch=1,
            say=print,
        )
        self.site = JoinedSite(
            LocalTransport(exchange),
            session="lab",
            name="north",
            hub=self.hubs[1],
            clock=self.clock,
            epoch=1,
            say=print,
        )
        self.state, self.visits, self.count = SceneState(), [], 0
        for hub in self.hubs:
            for name in ("Ann", "Ben"):
                code = hub.invite(Role.REMOTE).code
                token = hub._session.pair(code, name=name, address="a", now_ns=0)
                self.visits.append(
                    (hub, hub._session.enter(Hello(token, None, None), address="a", now_ns=0))
                )
        self.settle()

    def frame(self):
        arrived = self.room.take()
        for change in arrived.placed:
            self.state = reduce_state(self.state, change, self.clock.now_ns())
        self.room.publish(self.state)

    def step(self, which):
        self.clock.sleep_until(self.clock.now_ns() + 3_000_000)
        (self.frame, self.room.turn, self.site.turn)[which]()
        for hub in self.hubs:
            hub._publish()

    def settle(self):
        for _ in range(12):
            for which in range(3):
                self.step(which)

    def ask(self, who, **fields):
        hub, visit = self.visits[who]
        self.count += 1
        text = json.dumps({"kind": "do", "id": self.count, **fields})
        hub._session.hear(visit, text, now_ns=self.clock.now_ns())
        visit.outbox.see(0)

    def here(self):
        return shapes_of(self.hubs[0])

    def there(self):
        """The site's shapes by their names in the room."""
        name = self.site._own.name_there
        found = shapes_of(self.hubs[1])
        return {name(key): {**it, "by": name(it["by"])} for key, it in found.items()}


def shapes_of(hub):
    return hub._session.deciding.board.whole()["primitives"]


WHO, WHAT, WHERE = st.integers(0, 3), st.integers(0, 2), st.integers(0, 5)
MOVES = st.one_of(
    st.tuples(st.just("put"), WHO, WHAT, WHERE),
    st.tuples(st.just("give"), WHO, WHAT, WHO),
    st.tuples(st.just("erase"), WHO, WHAT, WHO),
    st.tuples(st.just("undo"), WHO, WHAT, WHO),
    st.tuples(st.just("step"), st.integers(0, 2), WHAT, WHO),
)
IN_ROOM = ("p1", "p2", "north.p1", "north.p2")


@settings(max_examples=60, deadline=None)
@given(st.lists(MOVES, max_size=40))
def test_both_sides_end_in_the_same_state_whatever_the_order(moves):
    together = Together()
    # Shape number n was made by person n, whoever has it by now.
    for kind, who, what, more in moves:
        if kind == "step":
            together.step(who)
            continue
        at_site = who >= 2
        name_here = together.site._own.name_here if at_site else str
        key = name_here(f"{IN_ROOM[what + 1]}/s")
        if kind == "put":
            together.ask(who, op="primitive", primitive=key, **at(float(more)))
        elif kind == "erase":
            together.ask(who, op="primitive", primitive=key)
        elif kind == "give":
            together.ask(who, op="give", primitive=key, to=name_here(IN_ROOM[more]))
        else:
            together.ask(who, op="undo")
    together.settle()
    assert together.there() == together.here()
    in_state = {key: it.user_id for key, it in together.state.primitives.items()}
    assert in_state == {key: it["by"] for key, it in together.here().items()}
    assert not together.site._asking._asked, "every wish is answered"
