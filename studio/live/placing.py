"""From a camera's first pictures to frames that can be tracked: layout, lenses, where it stands."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from devices.camera.lenses.layout import Arrangement, LensLayout
from devices.camera.lenses.lens_pictures import assumed_rig, own_lens_size_px, stream_images
from devices.camera.lenses.search import FoundLayout, find_layout
from devices.camera.received import Received
from devices.footage import read_camera
from devices.insta360.files.lens_rig import CarriedLenses
from devices.insta360.files.offsets import OffsetError
from devices.messages import Frame
from devices.session_info import LiveStream
from scenes.cameras import Rig
from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.render.renderer import PosedSplats, Renderer
from studio.live.camera_frames import STREAM_ID
from studio.live.setup import LiveSetup, Place
from tracking.camera.lens_fit import LensCalibration, calibrate_lenses

PICTURES = 3
"""Pictures that the lenses are fitted to: the fewest whose median forgets who walks by."""

CARRIED_LENSES = 2
"""Lenses of a 360° camera that carries its calibration, or sends a track a lens."""

SURE = 0.95
"""Probability of a layout from which nobody needs to be asked."""


class PlacingError(ValueError):
    """A camera that cannot be used yet: says what was seen and what to do."""


class Placed(Protocol):
    """Result of a search for the camera."""

    @property
    def world_from_rig(self) -> Pose:
        """The pose."""
        ...

    @property
    def refusal(self) -> str:
        """Why it is not to be used; empty if it is."""
        ...

    def described(self) -> str:
        """One line for people."""
        ...


Locate = Callable[[Frame, Pose | None], Placed]
"""Finds the camera in the room from one frame; the pose is where it was last, to be tried first."""

Say = Callable[[str], None]
"""Takes a sentence about what is being done."""


@dataclass(frozen=True, slots=True, eq=False)
class PlacedCamera:
    """A camera that is ready to be tracked with.

    Attributes:
        stream: how its pictures become lens pictures.
        rig: its lenses.
        world_from_rig: where it stands.
        calibration: how well both are known; None where they were not fitted.
        found: one line: how the camera was found.
        t_ns: session time of the last picture that was used.
        searched_world_from_rig: what the search gave, before the fit; None without a search.
    """

    stream: LiveStream
    rig: Rig
    world_from_rig: Pose
    calibration: LensCalibration | None
    found: str
    t_ns: int
    searched_world_from_rig: Pose | None = None


def stream_of(received: Received, layout: LensLayout, setup: LiveSetup) -> LiveStream:
    """How pictures of this kind become lens pictures under a layout."""
    size = setup.lens_size_px or own_lens_size_px(received.pictures[0], layout)
    return LiveStream(layout, size, len(received.pictures))


def layout_of(received: Received) -> FoundLayout:
    """The layout of a camera's picture, and how sure it is."""
    return find_layout(received.pictures[0])


def place_camera(
    pictures: Sequence[Received],
    layout: LensLayout,
    setup: LiveSetup,
    scene: ScenePackage,
    *,
    renderer: Renderer,
    locate: Locate,
    say: Say,
    carried: CarriedLenses | None = None,
) -> PlacedCamera:
    """Lenses and pose of a camera, from pictures of a moment in which it stands still.

    Args:
        pictures: one or more, oldest first.
        layout: how they hold the lenses.
        setup: what is known beforehand.
        scene: the room that it stands in.
        renderer: draws splats.
        locate: finds the pose.
        say: progress.
        carried: lenses as the camera itself says they are; a camera file goes before them.

    Raises:
        PlacingError: it is not found, or its lenses are not.
        FootageError, OSError: the camera file is bad.
    """
    stream = stream_of(pictures[0], layout, setup)
    rig, said = _first_lenses(stream, setup, carried=carried)
    frames = [_frame(received, stream, rig) for received in pictures]
    placed = PlacedCamera(
        stream, rig, scene.world_from_rig, None, f"at the scan's place{said}", pictures[-1].t_ns
    )
    if setup.place is Place.FIND:
        say("looking for the camera in the room")
        located = find_in_room(frames[-1], scene, locate=locate)
        where = located.world_from_rig
        placed = replace(
            placed,
            world_from_rig=where,
            found=f"{located.described()}{said}",
            searched_world_from_rig=where,
        )
    if not setup.calibrates:
        return placed
    calibration = fit_to_room(
        frames,
        scene,
        world_from_rig=placed.world_from_rig,
        renderer=renderer,
        say=say,
        layout=layout,
    )
    return replace(
        placed,
        rig=calibration.rig,
        world_from_rig=calibration.world_from_rig,
        calibration=calibration,
    )


def fit_to_room(
    frames: Sequence[Frame],
    scene: ScenePackage,
    *,
    world_from_rig: Pose,
    renderer: Renderer,
    say: Say,
    layout: LensLayout | None = None,
) -> LensCalibration:
    """Return lenses and pose that fit the room, from frames of a moment and a pose close by.

    Args:
        frames: with the lenses to begin with.
        scene: the room that it stands in.
        world_from_rig: the pose to begin with.
        renderer: draws splats.
        say: progress.
        layout: how the stream holds the lenses, for a message.

    Raises:
        PlacingError: they do not fit.
    """
    say("fitting lenses and pose to the room")
    objects = tuple(PosedSplats(item.splats, item.world_from_object) for item in scene.objects)
    calibration = calibrate_lenses(frames, world_from_rig, scene.room, renderer, objects=objects)
    if not calibration.trusted:
        held = "" if layout is None else f", the layout ({layout.shown})"
        raise PlacingError(
            f"lenses and place do not fit the room: {calibration.refusal}. Check the scene{held} "
            "and that nothing covers the lenses"
        )
    return calibration


def find_in_room(frame: Frame, scene: ScenePackage, *, locate: Locate) -> Placed:
    """Search for the camera.

    Raises:
        PlacingError: it is not found.
    """
    located = locate(frame, scene.world_from_rig)
    if located.refusal:
        raise PlacingError(
            f"the camera was not found in {scene.name} ({located.refusal}): switch the lights "
            'on, see that the lenses are free, or set place = "scan" if it stands where the '
            "scan has it"
        )
    return located


def _first_lenses(
    stream: LiveStream, setup: LiveSetup, *, carried: CarriedLenses | None
) -> tuple[Rig, str]:
    """Return the lenses to begin with, and what is to be said about them."""
    rig, said = None, ""
    if carried is not None and setup.camera_file is None:
        rig, said = _carried_lenses(stream, carried)
    return rig or _assumed_lenses(stream, setup), said


def _carried_lenses(stream: LiveStream, carried: CarriedLenses) -> tuple[Rig | None, str]:
    """Return the lenses as the camera says they are, None if unfit, and what is to be said."""
    turns = stream.layout.turns * stream.tracks
    is_sphere = stream.layout.arrangement is Arrangement.EQUIRECTANGULAR
    if is_sphere or len(turns) != CARRIED_LENSES:
        return None, "; the camera's own lens calibration is for two lenses, not for this picture"
    try:
        rig = carried.rig(stream.lens_size_px, turns=(turns[0], turns[1]))
    except OffsetError as error:
        return None, f"; not used: the camera's own {error}"
    return rig, f"; lenses as {carried.camera or 'the camera'} itself has calibrated them"


def _assumed_lenses(stream: LiveStream, setup: LiveSetup) -> Rig:
    if setup.camera_file is None:
        # A track a lens is two lenses, as if they lay side by side in one.
        held = stream.layout
        if held.arrangement is Arrangement.ONE_LENS and stream.tracks == CARRIED_LENSES:
            held = LensLayout(Arrangement.SIDE_BY_SIDE, held.turns * stream.tracks)
        return assumed_rig(held, stream.lens_size_px, lens_distance_m=setup.lens_distance_m)
    given = read_camera(setup.camera_file).rig
    count = len(assumed_rig(stream.layout, stream.lens_size_px).lenses) * stream.tracks
    if len(given.lenses) != count:
        raise PlacingError(
            f"{setup.camera_file}: {len(given.lenses)} lenses, the stream has {count} "
            f"({stream.layout.shown}); give the file of this camera"
        )
    size = stream.lens_size_px
    return Rig(tuple(lens.resized(size, size) for lens in given.lenses), given.rig_from_lens)


def _frame(received: Received, stream: LiveStream, rig: Rig) -> Frame:
    images = stream_images(received.pictures, stream)
    return Frame(STREAM_ID, received.seq, received.t_ns, received.decoded_ns, images, rig, None)
