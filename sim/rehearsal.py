"""A whole simulated session: physics, people, camera, sensor and video, frame by frame."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from devices.messages import EncodedFrame, Event, Frame
from devices.recording_codec import RecordedTruth
from devices.video import H264Decoder, H264Encoder
from scenes.cameras import Rig
from scenes.mesh import PhysicalRoom
from scenes.pose import Pose, rotation_from_vector
from scenes.state import Annotation, Avatar
from sim.bodies import Placement, body_of_object
from sim.camera.camera360 import Camera360, CameraView, default_rig
from sim.camera.sensor import Sensor
from sim.faults.device import Bump, Freeze, HeadsetOff
from sim.faults.fault import LightFault, Passage, WayFault
from sim.faults.occluder import Occluder, panel_body, panel_id, panel_placement
from sim.faults.settings import changes_in_words
from sim.faults.twins import Twins, with_twins
from sim.people.actors import TICK_NS, Actor, introduce
from sim.people.figure import person_body
from sim.people.posture import part_poses
from sim.people.remote import remote_annotations, remote_avatar
from sim.physics.any_room import physics_of
from sim.reality.scanned import Scanned
from sim.scenarios.scenario import Scenario, validate_scenario
from sim.scenarios.switch import Switch, validate_switches
from sim.truth import GroundTruth, IdMasks, PersonTruth, has_moved

STREAM_ID = "camera-360"
NANOSECONDS = 1_000_000_000
Delivered = tuple[tuple[NDArray[np.uint8], ...], CameraView]
"""The pictures of one frame, one a lens, and what they show."""


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedStep:
    """One camera frame, what arrives with it, and the ground truth beside it.

    Attributes:
        frame: decoded pictures and the camera's pose as a marker would give it.
        packet: the same pictures as they left the encoder.
        truth: what no device would deliver.
        avatars: local and remote people.
        events: what has happened since the frame before.
        annotations: lines that have been drawn or have grown since the frame before.
        taken: what the sensor gave, before the encoder: (H, W, 3) uint8, one a lens.
    """

    frame: Frame
    packet: EncodedFrame
    truth: GroundTruth
    avatars: tuple[Avatar, ...]
    events: tuple[Event, ...]
    annotations: tuple[Annotation, ...] = ()
    taken: tuple[NDArray[np.uint8], ...] = ()


def simulate(
    room: PhysicalRoom,
    scenario: Scenario,
    *,
    seed: int,
    scanned: Scanned | None = None,
    then: Sequence[Switch] = (),
    keyframe_interval: int | None = None,
) -> Iterator[SimulatedStep]:
    """Play a scenario. Frames come in time order; those lost on the way don't come.

    Args:
        room: the physical room.
        scenario: what happens.
        seed: decides everything random; the same one gives the same bytes.
        scanned: needed for a room that is made of splats.
        then: other scenarios that the session goes on with, in order of time. Frames before an
            instant are the same bytes as without its switch.
        keyframe_interval: pictures from one keyframe of the video to the next; None as the encoder
            has it.

    Raises:
        ScenarioError: a scenario doesn't fit the room, or cannot go on from the one before.
    """
    validate_scenario(scenario, room)
    validate_switches(scenario, then, room)
    room = with_twins(room, scenario.faults.of(Twins))
    session = _Session(room, scenario, seed, scanned, then, keyframe_interval=keyframe_interval)
    return session.steps()


class _Session:
    def __init__(
        self,
        room: PhysicalRoom,
        scenario: Scenario,
        seed: int,
        scanned: Scanned | None,
        then: Sequence[Switch],
        *,
        keyframe_interval: int | None,
    ) -> None:
        # More streams may be added at the end: those before keep theirs.
        streams = np.random.default_rng(seed).spawn(5)
        pose_rng, sensor_rng, self._fault_rng, people_rng, world_rng = streams
        self._look = None if scanned is None else scanned.look(room)
        error = None if scanned is None else scanned.error
        self._error = None if error is None else error(world_rng)
        self._room = room
        self._scenario = scenario
        self._then = deque(then)
        self._frame_count = (then[-1].scenario if then else scenario).frame_count
        settings = scenario.camera
        self._rig: Rig = default_rig(settings.lens_size_px)
        self._true_rig = room.world_from_rig
        self._known_rig = off_by(
            self._in_reality(self._true_rig),
            pose_rng,
            settings.pose_error_deg,
            settings.pose_error_cm,
        )
        self._actors = _cast(scenario, room)
        self._world = physics_of(room, {a.person_id: a.target() for a in self._actors})
        figures = [person_body(actor.person_id, people_rng) for actor in self._actors]
        self._figures = dict(zip((a.person_id for a in self._actors), figures, strict=True))
        scenarios = (scenario, *(switch.scenario for switch in then))
        hidden = {f.object: None for each in scenarios for f in each.faults.of(Occluder)}
        panels = [panel_body(panel_id(name), room.object_by_id(name)) for name in hidden]
        bodies = [*(body_of_object(item) for item in room.objects), *figures, *panels]
        self._bodies = bodies
        self._camera = Camera360(room, self._rig, self._true_rig, bodies, look=self._look)
        self._sensor = Sensor(self._rig, sensor_rng)
        self._encoder = H264Encoder(
            2 * settings.lens_size_px,
            settings.lens_size_px,
            settings.fps,
            round(settings.bitrate_mbps * 1e6),
            keyframe_interval=keyframe_interval,
        )
        self._decoder = H264Decoder()
        self._first_poses = self._world.object_poses()
        self._bumps = _in_order(scenario.faults.of(Bump))
        self._last_delivered: Delivered | None = None
        self._known_faults: Mapping[str, None] = {}
        self._drawn_s = -1.0
        self._pictured_ns = -1

    def steps(self) -> Iterator[SimulatedStep]:
        """Frame by frame; while one is drawn, that before is encoded and the one before decoded."""
        waiting: Callable[[], SimulatedStep] | None = None
        events = [Event(0, "physics", "note", note) for note in self._world.notes]
        # The window must go on the thread that drew in it, and a session may run on any.
        with (
            closing(self),
            ThreadPoolExecutor(max_workers=1) as sender,
            ThreadPoolExecutor(max_workers=1) as receiver,
        ):
            for seq in range(self._frame_count):
                t_ns = round(seq * NANOSECONDS / self._scenario.camera.fps)
                events += self._advance(t_ns) + self._go_on(t_ns)
                events += self._bump(t_ns)
                known = self._scenario.faults.described(t_ns / NANOSECONDS)
                changes = changes_in_words(self._known_faults, known)
                events += [Event(t_ns, STREAM_ID, "fault", words) for words in changes]
                self._known_faults = known
                self._pictured_ns = t_ns
                images, view = self._picture(t_ns)
                passage = self._fate(seq, t_ns)
                if passage.is_lost:
                    text = f"frame {seq} lost on the way"
                    events.append(Event(t_ns, STREAM_ID, "dropped", text))
                    continue
                packed = sender.submit(self._send, images, seq, passage.stamp_ns)
                sent = receiver.submit(self._receive, packed, len(images))
                ready, waiting = waiting, self._step(sent, images, passage, view, tuple(events))
                events = []
                if ready is not None:
                    yield ready()
            if waiting is not None:
                yield waiting()

    def close(self) -> None:
        """Free the camera's window, on the thread that drew."""
        self._camera.close()

    def _bump(self, t_ns: int) -> list[Event]:
        """Put the camera where it stands after every bump whose time has come."""
        events: list[Event] = []
        while self._bumps and t_ns >= self._bumps[0].at_s * NANOSECONDS:
            bump = self._bumps.pop(0)
            self._true_rig = off_by(self._true_rig, self._fault_rng, bump.deg, bump.cm)
            self._camera.close()
            self._camera = Camera360(
                self._room, self._rig, self._true_rig, self._bodies, look=self._look
            )
            text = f"camera bumped: turned by {bump.deg:g}°, shifted by {bump.cm:g} cm"
            events.append(Event(t_ns, STREAM_ID, "bumped", text))
        return events

    def _in_reality(self, pose: Pose) -> Pose:
        """A pose of the simulation, which runs in the scan's world, where it really is."""
        return pose if self._error is None else self._error.moved(pose)

    def _go_on(self, now_ns: int) -> list[Event]:
        """Follow the next scenario, if its instant has come."""
        events: list[Event] = []
        while self._then and self._then[0].t_ns <= now_ns:
            scenario = self._scenario = self._then.popleft().scenario
            # A bump that was due by the frame before is past, whether it took place or not.
            due = scenario.faults.of(Bump)
            self._bumps = _in_order(
                [bump for bump in due if bump.at_s * NANOSECONDS > self._pictured_ns]
            )
            events.append(Event(now_ns, "session", "switched", f"goes on as {scenario.name}"))
            actions = {person.person_id: person.actions for person in scenario.people}
            for actor in self._actors:
                said = actor.go_on_with(actions.get(actor.person_id, ()))
                if said is not None:
                    events.append(Event(now_ns, actor.person_id, "action", said))
        return events

    def _picture(self, t_ns: int) -> Delivered:
        """Take the pictures of a moment, and those without a sensor."""
        faults, t_s = self._scenario.faults, t_ns / NANOSECONDS
        view = self._camera.view(self._placements(t_s))
        pictures: tuple[NDArray[np.uint8], ...] = tuple(lens.rgb for lens in view.lenses)
        for fault in faults.at(LightFault, t_s):
            pictures = fault.seen(pictures, t_s)
        dt_s = 1.0 / self._scenario.camera.fps
        delivered = self._sensor.expose(pictures, dt_s), view
        if faults.at(Freeze, t_s) and self._last_delivered is not None:
            return self._last_delivered
        self._last_delivered = delivered
        return delivered

    def _fate(self, seq: int, t_ns: int) -> Passage:
        """When and how a frame arrives, if it does."""
        passage = Passage(seq, t_ns, t_ns)
        for fault in self._scenario.faults.of(WayFault):
            passage = fault.passed(passage, self._fault_rng)
        return passage

    def _step(
        self,
        sent: Future[tuple[EncodedFrame, tuple[NDArray[np.uint8], ...]]],
        taken: tuple[NDArray[np.uint8], ...],
        passage: Passage,
        view: CameraView,
        events: tuple[Event, ...],
    ) -> Callable[[], SimulatedStep]:
        """Everything of a frame as it is now; call the result when its pictures are wanted."""
        truth, avatars = self._truth(passage, view), self._avatars(passage.t_ns)
        annotations = self._annotations(passage.t_ns)
        received_ns = passage.t_ns + passage.delay_ns
        known = self._known_rig if passage.is_posed else None

        def finish() -> SimulatedStep:
            packet, images = sent.result()
            stamp = passage.seq, passage.stamp_ns, received_ns
            frame = Frame(STREAM_ID, *stamp, images, self._rig, known)
            return SimulatedStep(frame, packet, truth, avatars, events, annotations, taken)

        return finish

    def _advance(self, t_ns: int) -> list[Event]:
        """Let people and physics go on until `t_ns`."""
        events: list[Event] = []
        while self._world.t_ns < t_ns:
            events += self._go_on(self._world.t_ns)
            for actor in self._actors:
                said = actor.tick(self._world)
                if said is not None:
                    events.append(Event(self._world.t_ns, actor.person_id, "action", said))
            self._world.move_people({actor.person_id: actor.target() for actor in self._actors})
            self._world.step(TICK_NS)
        return events

    def _placements(self, t_s: float) -> Mapping[str, Placement]:
        placements = {
            object_id: Placement((pose,), self._world.support_height(pose.translation))
            for object_id, pose in self._world.object_poses().items()
        }
        for actor in self._actors:
            poses = part_poses(actor.posture(self._world))
            placements[actor.person_id] = Placement(poses, 0.0)
        shares: dict[str, float] = {}
        for fault in self._scenario.faults.at(Occluder, t_s):
            shares[fault.object] = max(fault.size_at(t_s), shares.get(fault.object, 0.0))
        for object_id, share in shares.items():
            item, pose = self._room.object_by_id(object_id), self._world.object_pose(object_id)
            placements[panel_id(object_id)] = panel_placement(
                item, pose, self._rig, self._true_rig, share=share
            )
        return placements

    def _send(self, images: tuple[NDArray[np.uint8], ...], seq: int, t_ns: int) -> EncodedFrame:
        packet = self._encoder.encode(np.hstack(images), seq, t_ns)[0]
        return replace(packet, stream_id=STREAM_ID)

    def _receive(
        self, packed: Future[EncodedFrame], lenses: int
    ) -> tuple[EncodedFrame, tuple[NDArray[np.uint8], ...]]:
        packet = packed.result()
        picture = self._decoder.decode(packet)
        if picture is None:
            raise ValueError(f"{STREAM_ID} frame {packet.seq}: the decoder returned no picture")
        return packet, tuple(np.hsplit(picture, lenses))

    def _truth(self, passage: Passage, view: CameraView) -> GroundTruth:
        poses = self._world.object_poses()
        names = {name: 1 + k for k, name in enumerate(self._camera.body_ids)}
        numbers = {object_id: names[object_id] for object_id in poses}
        recorded = RecordedTruth(
            passage.seq,
            passage.stamp_ns,
            {object_id: self._in_reality(pose) for object_id, pose in poses.items()},
            {object_id: view.visible_fraction[object_id] for object_id in poses},
            frozenset(n for n, pose in poses.items() if has_moved(self._first_poses[n], pose)),
            self._in_reality(self._true_rig),
            self._scenario.faults.sizes(passage.t_ns / NANOSECONDS),
            passage.t_ns if passage.stamp_ns != passage.t_ns else None,
        )
        people = {
            actor.person_id: PersonTruth(
                self._figures[actor.person_id], part_poses(actor.posture(self._world))
            )
            for actor in self._actors
        }
        masks = IdMasks([lens.ids for lens in view.lenses], numbers)
        return GroundTruth(recorded, masks, people)

    def _avatars(self, t_ns: int) -> tuple[Avatar, ...]:
        without = {f.person for f in self._scenario.faults.at(HeadsetOff, t_ns / NANOSECONDS)}
        local = [actor for actor in self._actors if actor.person_id not in without]
        avatars = [actor.avatar(self._world) for actor in local]
        fraction = t_ns / (self._scenario.duration_s * NANOSECONDS)
        poses = self._world.object_poses()
        for remote in self._scenario.remote:
            now_s = t_ns / NANOSECONDS
            avatars.append(remote_avatar(remote, fraction, poses, self._true_rig, t_s=now_s))
        return tuple(avatars)

    def _annotations(self, t_ns: int) -> tuple[Annotation, ...]:
        """Return what was drawn since this was asked last."""
        since_s, now_s = self._drawn_s, t_ns / NANOSECONDS
        self._drawn_s = now_s
        local = (line for actor in self._actors for line in actor.new_annotations())
        remote = (
            line
            for settings in self._scenario.remote
            for line in remote_annotations(settings, since_s=since_s, t_s=now_s)
        )
        return (*local, *remote)


def _cast(scenario: Scenario, room: PhysicalRoom) -> list[Actor]:
    """The people of a scenario, who know each other."""
    actors = [
        Actor(
            person.person_id,
            room,
            start=person.start,
            yaw=math.radians(person.facing_deg),
            actions=person.actions,
            camera_xy=room.world_from_rig.translation[:2],
        )
        for person in scenario.people
    ]
    introduce(actors)
    return actors


def _in_order(bumps: Sequence[Bump]) -> list[Bump]:
    return sorted(bumps, key=lambda bump: bump.at_s)


def off_by(
    world_from_rig: Pose, rng: np.random.Generator, error_deg: float, error_cm: float
) -> Pose:
    """A pose off by `error_deg` about a random axis and `error_cm` in a random direction."""
    axis, direction = rng.standard_normal((2, 3))
    axis /= np.linalg.norm(axis)
    direction /= np.linalg.norm(direction)
    rotation = rotation_from_vector(math.radians(error_deg) * axis) @ world_from_rig.rotation
    return Pose(rotation, world_from_rig.translation + 0.01 * error_cm * direction)
