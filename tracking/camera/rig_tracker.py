"""Locates the 360° camera from frame to frame, and learns how the room looks from there.

The pose is refined against the room's splats once the marker or the pictures say that the camera
moved; until then the pose and the background images are kept.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from devices.messages import Frame
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats
from scenes.splats import SplatCloud
from scenes.state import ObjectModel
from tracking.background.images import BackgroundImages, Exposure, LensExposures, render_background
from tracking.background.layers import LayerCache, window_of
from tracking.background.learning import (
    Band,
    Care,
    learn,
    learn_unscanned,
    looked_at,
    whole_lens,
)
from tracking.camera.calibration import MAX_CARRIED, Calibration, calibrate
from tracking.camera.rig_state import RigState, look_through, rig_state
from tracking.window.window import Layer


@dataclass(frozen=True, slots=True, eq=False)
class StandingObjects:
    """The movable objects as they are believed to stand in one frame.

    Attributes:
        models: their splats.
        poses: `world_from_object` by object id.
        layers: the objects rendered into the lens pictures.
        care: how carefully the background is learned beside them.
    """

    models: tuple[ObjectModel, ...]
    poses: Mapping[str, Pose]
    layers: LayerCache
    care: Care

    def posed(self) -> tuple[PosedSplats, ...]:
        """Their splats at their poses."""
        return tuple(PosedSplats(o.splats, self.poses[o.object_id]) for o in self.models)


class RigTracker:
    """Follows the pose of a camera in a known room.

    Args:
        room: the room's splats without the movable objects.
        renderer: renders splats.
    """

    def __init__(self, room: SplatCloud, renderer: NativeRenderer) -> None:
        self._room = room
        self._renderer = renderer

    def locate(
        self,
        known: RigState | None,
        frame: Frame,
        *,
        marker_world_from_rig: Pose,
        standing: StandingObjects,
        is_refined: bool,
    ) -> RigState:
        """Find the camera's pose and the background from there, or keep both while it stands.

        Args:
            known: state after the frame before; None in the first.
            frame: live pictures.
            marker_world_from_rig: the marker's pose of the camera.
            standing: the movable objects.
            is_refined: whether poses are refined against the room.
        """

        def refine(world_from_rig: Pose, *, is_near: bool = True) -> Calibration:
            if not is_refined:
                return Calibration.unrefined(world_from_rig)
            objects = standing.posed()
            return calibrate(
                frame, world_from_rig, self._room, self._renderer, objects=objects, is_near=is_near
            )

        if known is None:
            calibration = refine(marker_world_from_rig)
        elif not known.is_unmoved(marker_world_from_rig):
            # Where the marker went, the refined camera went too: a better start than it.
            marked = marker_world_from_rig @ known.marker_world_from_rig.inverse()
            calibration = refine(marked @ known.calibration.world_from_rig)
        else:
            known = look_through(known, frame)
            if known.motion is not None:
                calibration = known.calibration.carried_along(known.motion.then_from_now)
                if is_refined and calibration.carried > MAX_CARRIED:
                    refined = refine(calibration.world_from_rig)
                    calibration = refined if refined.trusted else calibration
            elif known.blind is not None and known.blind.is_due(frame.t_ns):
                calibration = refine(known.calibration.world_from_rig, is_near=False)
                if not calibration.trusted:
                    return replace(known, blind=replace(known.blind, tried_ns=frame.t_ns))
            else:
                return known
        return self._see_anew(frame, marker_world_from_rig, calibration, standing)

    def _see_anew(
        self,
        frame: Frame,
        marker_world_from_rig: Pose,
        calibration: Calibration,
        standing: StandingObjects,
    ) -> RigState:
        """The state of a camera that has just been located, its background learned at once.

        Until the objects are measured from there, they may be anywhere.
        """
        background = render_background(
            self._renderer, self._room, frame.rig, calibration.world_from_rig
        )
        ranges_m = background.ranges_m
        exposures = LensExposures(frame.images, background)
        standing = replace(standing, care=Care.WARY)
        for index, lens in enumerate(frame.rig.lenses):
            band, exposure = whole_lens(index, lens.height_px), exposures[index]
            background = self.learn(background, frame, standing, exposure=exposure, band=band)
        return rig_state(frame, marker_world_from_rig, calibration, background, ranges_m=ranges_m)

    def learn(
        self,
        background: BackgroundImages,
        frame: Frame,
        standing: StandingObjects,
        *,
        exposure: Exposure,
        band: Band,
    ) -> BackgroundImages:
        """Update the background images from a frame in a band, away from all objects.

        Args:
            background: so far.
            frame: live pictures.
            standing: the movable objects.
            exposure: of the band's lens in this frame.
            band: rows to learn from.
        """
        lens = frame.rig.lenses[band.lens]
        rows = looked_at(band, lens.width_px, lens.height_px)
        taken = self._taken(background, frame, standing=standing, lens=band.lens, rows=rows)
        return learn(background, frame, exposure, taken, band, care=standing.care)

    def learn_unscanned(
        self, rig: RigState, frame: Frame, *, standing: StandingObjects, exposures: LensExposures
    ) -> RigState:
        """Take what no photo of the scan showed from a frame, away from all objects.

        Args:
            rig: so far.
            frame: live pictures.
            standing: the movable objects.
            exposures: of the lenses in this frame.
        """
        background = rig.background
        for index, lens in enumerate(frame.rig.lenses):
            rows = slice(0, lens.height_px)
            taken = self._taken(background, frame, standing=standing, lens=index, rows=rows)
            background = learn_unscanned(
                background, frame, lens=index, exposure=exposures[index], taken=taken
            )
        return replace(rig, background=background)

    def _taken(
        self,
        background: BackgroundImages,
        frame: Frame,
        *,
        standing: StandingObjects,
        lens: int,
        rows: slice,
    ) -> list[Layer]:
        """The movable objects, drawn into some rows of a lens."""
        taken: list[Layer] = []
        for model in standing.models:
            pose, view = standing.poses[model.object_id], (frame.rig, background.world_from_rig)
            drawn, _ = window_of(model, pose, *view, lens=lens).part
            if drawn.start < rows.stop and rows.start < drawn.stop:
                layers = standing.layers
                taken.append(layers.layer(model, pose, *view, self._renderer, lens=lens))
        return taken
