"""People over real sockets in a live session: what they show and make is replayed to the bit."""

from __future__ import annotations

import asyncio

from devices.recorded.people import (
    RecordedAnnotation,
    RecordedAvatar,
    RecordedPrimitive,
    RecordedProposal,
    RecordedSurface,
)
from devices.recording import read_recording, read_session
from scenes.workers.task import Task
from sim.headset.connection import HubAddress
from sim.headset.crowd import CrowdPlan, run_crowd
from studio.live.people.hosting import Hosting, hosted
from studio.session.pipeline import PEOPLE, recorded_messages
from studio.session.plan import SessionPlan


def seen(output):
    """People, their entities and version of the state after a picture, as plain numbers."""
    state = output.state
    entities = {
        key: (
            entity.user_id,
            entity.shape,
            entity.size_m,
            entity.world_from_primitive.matrix().tolist(),
        )
        for key, entity in state.primitives.items()
    }
    entities |= {
        key: (entity.object_id, entity.user_name, entity.world_from_object.matrix().tolist())
        for key, entity in state.proposals.items()
    }
    entities |= {
        key: (entity.corners_in_world.tolist(), entity.size_px, entity.seen_in_world.tolist())
        for key, entity in state.surfaces.items()
    }
    people = {
        key: (
            a.name,
            a.world_from_head.matrix().tolist(),
            [hand.tolist() for hand in a.hands],
            None if a.ray is None else a.ray.tolist(),
        )
        for key, a in state.avatars.items()
    }
    lines = {key: item.points_in_world.tolist() for key, item in state.annotations.items()}
    events = [event.text for event in output.input.events if event.source == PEOPLE]
    return state.version, people, lines, entities, events


def handed(states):
    """Names of boxes that Ann has of Ben, and those of them that are gone again."""
    owners = [{key: shape[0] for key, shape in it[3].items()} for it in list(states.values())]
    found = {
        key for shown in owners for key, by in shown.items() if key[:3] == "p2/" and by == "p1"
    }
    return found, {key for key in found if key not in owners[-1]}


def has_everything(states):
    """Whether lines, rays, proposals, carried surfaces and boxes that were handed on were seen."""
    every = list(states.values())
    entities = [entity for it in every for entity in it[3].values()]
    return bool(
        any(it[2] for it in every)
        and any(person[3] is not None for it in every for person in it[1].values())
        and any(len(entity) == 3 and isinstance(entity[0], str) for entity in entities)
        and any(isinstance(entity[0], list) and entity[0] != entity[2] for entity in entities)
        and any(len(it[3]) >= 2 for it in every)
        and handed(states)[1]
    )


def test_two_people_in_a_session_are_recorded_and_replayed_to_the_bit(live, tiny, monkeypatch):
    monkeypatch.setattr("sim.headset.client.DRAW_EVERY_S", 0.7)
    monkeypatch.setattr("sim.headset.client.DRAW_S", 0.4)
    states = {}
    with hosted(Hosting(), tiny.scene, clock=live.clock, say=lambda _line: None) as hub:
        session = live.session(people=hub)
        played = live.run(session, lambda o: states.update({o.input.frame.seq: seen(o)}))
        live.push(session)
        live.until(lambda: len(states) >= 3)

        async def codes():
            for _ in range(2):
                yield hub.invite().code

        async def join():
            over = asyncio.Event()

            async def ending():
                while not has_everything(states):
                    await asyncio.sleep(0.2)
                over.set()

            ended = asyncio.create_task(ending())
            plan = CrowdPlan(HubAddress(hub.url), 2, 120.0)
            tally = await run_crowd(plan, codes(), over=over)
            ended.cancel()
            return tally

        tally = Task("two people", lambda _task: asyncio.run(join())).start().outcome()
        # They have left: two seconds later nobody shows them any more.
        live.until(lambda: not list(states.values())[-1][1])
        session.end()
        played.thread.join(120)
    assert played.error is None
    assert tally.failures == []
    assert tally.states > 10
    assert tally.done > 5
    assert tally.state.percentile(95) < 1000

    path = live.folder / "live.mcap"
    values = list(read_recording(path))
    avatars = [value.avatar for value in values if isinstance(value, RecordedAvatar)]
    assert {avatar.user_id for avatar in avatars} == {"p1", "p2"}
    assert {hand.shape for avatar in avatars for hand in avatar.hands} == {(25, 3)}
    assert any(avatar.ray is not None for avatar in avatars)
    assert {avatar.name for avatar in avatars} == {"Ann 1", "Ben 2"}
    assert any(isinstance(value, RecordedAnnotation) for value in values)
    assert any(isinstance(value, RecordedPrimitive) for value in values)
    assert any(isinstance(value, RecordedProposal) for value in values)
    # A box goes from one to the other, who takes it away: the states had it with either.
    taken, gone = handed(states)
    assert gone
    owners = [{key: shape[0] for key, shape in it[3].items()} for it in states.values()]
    assert {shown[key] for shown in owners for key in taken & shown.keys()} == {"p1", "p2"}
    events = " ".join(text for it in states.values() for text in it[4])
    assert any(f"Ben 2 (p2) gave {key} to Ann 1" in events for key in taken)
    surfaces = [value.surface for value in values if isinstance(value, RecordedSurface)]
    assert any(surface.carried_to is not None for surface in surfaces)
    assert max(len(people) for _, people, *_ in states.values()) == 2
    assert max(len(entities) for _, _, _, entities, _ in states.values()) >= 2

    info, again = read_session(path), {}
    replay = tiny.session(
        SessionPlan(methods=("own",)),
        inputs=lambda: recorded_messages(path, info),
        methods={"own": tiny.tracker(0.0)},
    )
    replay.run(lambda output: again.update({output.input.frame.seq: seen(output)}))
    assert again == states
