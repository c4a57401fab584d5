"""A room and its site: objects, people, lines, surfaces and pictures, both ways."""

import asyncio
import json

import aiohttp
import numpy as np

from devices.hub.elsewhere import Elsewhere
from devices.hub.protocol.wire import PICTURE_KIND, Body, encode_body, unpack_bodies
from devices.hub.roles import Person, Role
from scenes.pose import Pose
from scenes.state import Annotation, LiveSurface, TrackedObject, TrackState

CORNERS = np.array([[0, 0, 1], [1, 0, 1], [1, 0, 0], [0, 0, 0]], dtype=float)
BODY = encode_body(Body(1, 2, Pose.from_yaw(0.3, (1, 2, 3))))


def tracked(name, x, t_ns=1):
    pose = Pose.from_yaw(0.0, (x, 0, 0))
    return TrackedObject(name, t_ns, pose, np.eye(4), 1.0, TrackState.TRACKED, 1.0, t_ns)


class Client:
    """Somebody at a hub, with all that they were sent."""

    def __init__(self):
        self.objects, self.lines, self.surfaces, self.shapes = {}, {}, {}, {}
        self.answers, self.shapes_at_answers = {}, {}
        self.people, self.bodies, self.pictures = [], {}, {}

    async def join(self, http, hub, name):
        code = hub.invite(Role.REMOTE).code
        async with http.post(f"{hub.url}pair", json={"code": code, "name": name}) as reply:
            token = (await reply.json())["token"]
        self.socket = await http.ws_connect(f"{hub.url}people")
        await self.socket.send_json({"kind": "hello", "token": token})
        self.reading = asyncio.ensure_future(self._read())
        return self

    async def do(self, **fields):
        await self.socket.send_json({"kind": "do", "id": 1, **fields})

    async def answered(self, until, **fields):
        """Do something; return the answer in words, "done" where it was done."""
        number = len(self.answers) + 1
        await self.do(id=number, **fields)
        await until(lambda: number in self.answers)
        return self.answers[number]

    async def _read(self):
        async for message in self.socket:
            if message.type is aiohttp.WSMsgType.BINARY:
                self._binary(message.data)
                continue
            fields = json.loads(message.data)
            kind = fields["kind"]
            if kind == "welcome":
                self.objects = fields["state"]["objects"]
                self.lines = fields["state"]["lines"]
                self.surfaces = fields["state"]["surfaces"]
                self.shapes = fields["state"]["primitives"]
            if "people" in fields:
                self.people = fields["people"]
            if kind == "state":
                self.objects |= fields["objects"]
                await self.socket.send_json({"kind": "seen", "version": fields["version"]})
            if kind in ("done", "refused"):
                self.answers[fields["id"]] = fields.get("why", "done")
                self.shapes_at_answers[fields["id"]] = dict(self.shapes)
            if kind == "log":
                kinds = {"line": self.lines, "surface": self.surfaces, "primitive": self.shapes}
                items, key = kinds[fields["op"]], fields[fields["op"]]
                items[key] = fields
                if not any(fields.get(field) for field in ("points", "corners", "shape")):
                    del items[key]

    def _binary(self, data):
        if data[1] == PICTURE_KIND:
            length = int.from_bytes(data[2:4], "little")
            self.pictures[data[4 : 4 + length].decode()] = data[4 + length :]
        else:
            self.bodies |= dict(unpack_bodies(data))

    @property
    def names(self):
        return {person["id"]: person["name"] for person in self.people}


def play(building, script):
    """Run a script of people at both hubs, while the session goes on."""

    async def until(happened):
        end = asyncio.get_running_loop().time() + 15.0
        while not happened():
            assert asyncio.get_running_loop().time() < end, "it did not happen in time"
            building.turn()
            await asyncio.sleep(0.01)

    async def run():
        async with aiohttp.ClientSession() as http:
            here = await Client().join(http, building.room_hub, "Ann")
            there = await Client().join(http, building.site_hub, "Ben")
            await until(lambda: here.people and there.people)
            await script(here, there, until)
            for each in (here, there):
                await each.socket.close()
                await each.reading

    asyncio.run(run())


def test_objects_move_at_the_site(building):
    async def script(_here, there, until):
        building.change(tracked("chair", 1.0))
        await until(lambda: "chair" in there.objects)
        assert there.objects["chair"][0] == 1.0
        building.change(tracked("chair", 2.5, t_ns=2), t_ns=2)
        await until(lambda: there.objects["chair"][0] == 2.5)
        assert there.objects["chair"][7] == "tracked"

    play(building, script)


def test_people_see_each_other_and_enter_the_session(building):
    async def script(here, there, until):
        await until(lambda: len(here.people) == 2 and len(there.people) == 2)
        assert here.names == {"p1": "Ann", "north.p1": "Ben"}
        assert there.names == {"p1": "Ben", "lab.p1": "Ann"}
        await here.socket.send_bytes(BODY)
        await there.socket.send_bytes(BODY)
        await until(lambda: here.bodies and there.bodies)
        index = {person["id"]: person["index"] for person in here.people}
        assert here.bodies == {index["north.p1"]: BODY}
        await until(lambda: set(building.state.avatars) == {"p1", "north.p1"})

    play(building, script)


def test_the_wearer_of_a_headset_is_seen_at_the_site(building):
    wearer = Person("hololens", 0, "Ana", Role.LOCAL, is_yielding=True)

    async def script(_here, there, until):
        building.room_hub.meet([Elsewhere(wearer, BODY)], way="hololens")
        await until(lambda: there.names.get("lab.hololens") == "Ana" and there.bodies)
        assert [p["yields"] for p in there.people if p["id"] == "lab.hololens"] == [True]
        assert building.room.turn() is None, "sites do not see it twice"
        assert len(there.people) == 3

    play(building, script)


def test_lines_go_both_ways_and_are_erased(building):
    async def script(here, there, until):
        line = {"points": [[0, 0, 0], [1, 1, 1]], "colour": [1, 0, 0]}
        await there.do(op="line", line="abc", **line)
        await until(lambda: "north.p1/abc" in building.state.annotations)
        assert building.state.annotations["north.p1/abc"].user_id == "north.p1"
        await until(lambda: "north.p1/abc" in here.lines)
        await here.do(op="line", line="abc", **line)
        await until(lambda: "lab.p1/abc" in there.lines)
        assert set(there.lines) == {"p1/abc", "lab.p1/abc"}
        await there.do(op="undo")
        await until(lambda: set(here.lines) == {"p1/abc"})
        assert set(building.state.annotations) == {"p1/abc"}
        gone = Annotation("p1/abc", "p1", np.zeros((0, 3)), (1, 1, 1))
        building.change(gone)
        await until(lambda: not there.lines)

    play(building, script)


def test_what_the_room_takes_away_goes_at_the_site(building):
    async def script(_here, there, until):
        await there.do(op="surface", surface="s", corners=CORNERS.tolist())
        await until(lambda: "north.p1/s" in building.state.surfaces)
        assert set(there.surfaces) == {"p1/s"}
        building.change(LiveSurface("north.p1/s", np.zeros((0, 3)), (0, 0), ""))
        await until(lambda: not there.surfaces)

    play(building, script)


def test_a_live_surface_shows_its_picture_at_the_site(building):
    async def script(_here, there, until):
        jpeg = b"\xff\xd8\xff picture"
        building.change(LiveSurface("board", CORNERS, (64, 64), "camera-360"))
        building.turn()
        building.room.show("board", jpeg)
        await until(lambda: there.pictures == {"lab.board": jpeg})
        await until(lambda: "lab.board" in there.surfaces)
        building.change(LiveSurface("board", np.zeros((0, 3)), (0, 0), ""))
        await until(lambda: not there.surfaces)

    play(building, script)


def test_somebody_who_joins_late_gets_all_of_it(building):
    building.change(tracked("chair", 1.0))
    building.change(Annotation("note", "operator", np.eye(3), (1.0, 1.0, 1.0)))
    building.until(lambda: building.site.status().objects == 1)

    async def script(_here, there, until):
        await until(lambda: there.objects and there.lines)
        assert set(there.objects) == {"chair"}
        assert set(there.lines) == {"lab.note"}

    play(building, script)
    assert building.site.status().about.scene == "lab"


def test_a_room_that_is_not_heard_is_lost_until_it_is_heard_again(building):
    async def script(here, there, until):
        building.change(tracked("chair", 1.0))
        await until(lambda: "chair" in there.objects and len(there.people) == 2)
        end = asyncio.get_running_loop().time() + 5.0
        while there.objects["chair"][7] != "lost":
            assert asyncio.get_running_loop().time() < end, "it did not happen in time"
            building.site.turn()
            await asyncio.sleep(0.01)
        assert not building.site.status().is_reached
        assert "the room is not reached" in building.said
        building.site.turn()
        await until(lambda: there.objects["chair"][7] == "tracked" and len(there.people) == 2)
        assert building.site.status().is_reached
        assert here.names == {"p1": "Ann", "north.p1": "Ben"}

    play(building, script)
