"""Making a movable object of a part of the room, and putting it back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scenes.cut import divide, restore
from scenes.harmonics import turned
from scenes.package import ScenePackage
from scenes.package.records import Stage
from scenes.prepare.cutout.coverage.in_photos import with_coverage
from scenes.prepare.cutout.labelling.above_ground import SOLID
from scenes.prepare.cutout.labelling.closed_body import closed_body
from scenes.prepare.cutout.labelling.marked_body import marked_body
from scenes.prepare.cutout.labelling.outlines import outlined
from scenes.prepare.cutout.labelling.separate import Separation, ViewVerdict, separate
from scenes.prepare.cutout.marks.masked_view import MaskedView
from scenes.prepare.cutout.marks.masks import GrabCutMasks, Masks
from scenes.prepare.cutout.marks.prompted_views import PromptedView, masked_views
from scenes.prepare.cutout.object.added import ADDED, require_free_id
from scenes.prepare.cutout.object.solid_parts import guessed_mass_kg, solid_parts
from scenes.prepare.cutout.object.upright_box import UprightBox, upright_box
from scenes.prepare.cutout.remainder.fill import fill_support
from scenes.prepare.cutout.remainder.floaters import FLOATERS
from scenes.prepare.cutout.remainder.foot_and_haze import beside_foot, hanging_off
from scenes.prepare.cutout.remainder.residual_splats import residual_splats
from scenes.prepare.cutout.remainder.shadows import without_shadow
from scenes.prepare.cutout.votes.seen_surface import SeenSurface, seen_surface
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud, concatenate
from scenes.state import ObjectModel

BoolArray = NDArray[np.bool_]
FloatArray = NDArray[np.float64]

REFINED, REGION = "refine", "region"
"""Stages of refinements are called so, of an object by its id or of a region of the room."""
MIN_SPLATS = 30
"""Splats below which nothing was found."""
MIN_PHOTOS = 3
"""Photos of a room from which on surfaces that they agree about say what an object is."""
BESIDE_BOX_M = 0.03
"""An object's splats farther outside its box than this float."""
BELOW_SUPPORT_M = 0.01
"""And those farther below what it stands on: they would leave its colours there."""
MAX_SHARE_BESIDE_BOX = 0.3
"""Of the object's opacity: more than this is no haze, and the box must be wrong."""


@dataclass(frozen=True, slots=True, eq=False)
class Cutout:
    """A package with one object more, and how it came about.

    Attributes:
        package: as it is now.
        item: the new object.
        box: around it.
        views: what became of each view.
        floaters: stray splats that were removed with it, and what it would have left behind.
        filled: splats laid where the support had never been seen.
        relit: splats of the support that were in its shadow.
        notes: doubts about the marks, in words.
    """

    package: ScenePackage
    item: ObjectModel
    box: UprightBox
    views: tuple[ViewVerdict, ...]
    floaters: int
    filled: int
    relit: int
    notes: tuple[str, ...] = ()


def cut_out(
    package: ScenePackage,
    views: Sequence[MaskedView],
    *,
    object_id: str,
    name: str,
    kind: str,
    renderer: NativeRenderer,
) -> Cutout:
    """Separate what the masks show from the room.

    Args:
        package: the scene; it is left as it is.
        views: the object's masks in one to three views.
        object_id: unique in the scene.
        name: shown to people.
        kind: shared by identical twins; empty if unique.
        renderer: draws the room.

    Raises:
        ValueError: the id is taken or unfit, or the masks show no object.
    """
    require_free_id(package, object_id)
    if len(package.views) > max(len(views), MIN_PHOTOS):
        found = marked_body(package.room, views, viewpoints=package.views, renderer=renderer)
    else:
        found = separate(package.room, views, renderer=renderer)
    if found.labels.sum() < MIN_SPLATS:
        raise ValueError(
            f"only {found.labels.sum()} splats were found, wanted {MIN_SPLATS}: there is no "
            "object in the boxes, or it is too small in these views; choose nearer ones"
        )
    return make_object(package, found, object_id=object_id, name=name, kind=kind, renderer=renderer)


def cut_marked(
    package: ScenePackage,
    views: Sequence[PromptedView],
    *,
    object_id: str,
    name: str,
    kind: str,
    renderer: NativeRenderer,
    masks: Masks | None = None,
) -> Cutout:
    """Separate what somebody marked from the room.

    Where there are only clicks, that is the body which was clicked on; a model for masks, if one is
    given, knows better what a click means. Boxes and strokes become masks.

    Args:
        package: the scene; it is left as it is.
        views: with marks on one object, in one to three views.
        object_id: unique in the scene.
        name: shown to people.
        kind: shared by identical twins; empty if unique.
        renderer: draws the room.
        masks: finds an object in a picture; GrabCut if not given.

    Raises:
        ValueError: the marks show no object, or the id is taken or unfit.
    """
    require_free_id(package, object_id)
    prompts = [view.prompt for view in views]
    are_clicks = all(p.box_px is None and not len(p.outside_px) for p in prompts)
    if are_clicks and package.views and masks is None:
        body = closed_body(package.room, views, viewpoints=package.views, renderer=renderer)
        return make_object(
            package, body, object_id=object_id, name=name, kind=kind, renderer=renderer
        )
    masked = masked_views(package.room, views, masks=masks or GrabCutMasks(), renderer=renderer)
    return cut_out(package, masked, object_id=object_id, name=name, kind=kind, renderer=renderer)


def make_object(
    package: ScenePackage,
    found: Separation,
    *,
    object_id: str,
    name: str,
    kind: str,
    renderer: NativeRenderer,
) -> Cutout:
    """The package after the found splats became an object; see `cut_out`."""
    found, box = _bound(package, _outlined(package, found, renderer), renderer)
    splats = package.room.select(found.labels)
    mended = _mend_support(package.room, found, box)
    room, cut = divide(
        package.room,
        found.labels,
        object_id=object_id,
        floaters=found.floaters | mended.shaded,
        fill=concatenate([mended.lit, mended.fill]),
    )
    own = turned(splats, box.world_from_box.inverse())
    parts = solid_parts(own, box.size_m)
    item = ObjectModel(
        object_id=object_id,
        name=name,
        kind=kind,
        splats=own,
        box_m=box.size_m,
        support_z_m=box.support_z_m,
        world_from_object=box.world_from_box,
        parts=parts,
        guessed_mass_kg=guessed_mass_kg(parts, box.size_m),
    )
    stray, relit, filled = int(found.floaters.sum()), len(mended.lit), len(mended.fill)
    stage = Stage(
        f"cut {object_id}",
        f"{len(splats)} splats, {stray} floaters removed, {filled} filled in below, {relit} taken "
        "out of its shadow",
    )
    changed = replace(
        package,
        room=room,
        objects=(*package.objects, item),
        cuts=(*package.cuts, cut),
        stages=(*package.stages, stage),
    )
    changed = with_coverage(changed, object_id, renderer=renderer)
    item = changed.objects[-1]
    return Cutout(changed, item, box, found.views, stray, filled, relit, found.notes)


@dataclass(frozen=True, slots=True, eq=False)
class _Mended:
    """Support of an object, mended after the object is taken out.

    Attributes:
        shaded: (N,) the room's splats in the object's shadow.
        lit: what comes in their place.
        fill: laid where the support had never been seen.
    """

    shaded: BoolArray
    lit: SplatCloud
    fill: SplatCloud


def _mend_support(room: SplatCloud, found: Separation, box: UprightBox) -> _Mended:
    """The support of what was found, as it is without it."""
    gone = found.labels | found.floaters
    shaded, nothing = np.zeros_like(gone), room.select(np.zeros_like(gone))
    if not box.supported:
        return _Mended(shaded, nothing, nothing)
    left, footprint = room.select(~gone), room.means[found.labels].astype(np.float64)
    in_shadow, lit = without_shadow(left, footprint, box.support_z_m)
    shaded[np.flatnonzero(~gone)[in_shadow]] = True
    fill = fill_support(concatenate([left.select(~in_shadow), lit]), footprint, box)
    return _Mended(shaded, lit, fill if fill is not None else nothing)


def _outlined(package: ScenePackage, found: Separation, renderer: NativeRenderer) -> Separation:
    """The object by its outlines in the room's photos, if it was found in another way."""
    if len(found.own) or len(package.views) <= MIN_PHOTOS or not found.labels.any():
        return found
    outline = outlined(package.room, found.labels, viewpoints=package.views, renderer=renderer)
    return outline if outline.labels.sum() >= MIN_SPLATS else found


def _bound(
    package: ScenePackage, found: Separation, renderer: NativeRenderer
) -> tuple[Separation, UprightBox]:
    """The object without the room's splats that are in it, and the box around it.

    Outlines in many photos leave nothing of the room in it.
    """
    surface, box = _box(package, found, renderer)
    if not len(found.own):
        found, box = _without_ground(package, found, box, surface, renderer)
    return (_add_residual_splats(package.room, found, box) if box.supported else found), box


def _without_ground(
    package: ScenePackage,
    found: Separation,
    box: UprightBox,
    surface: SeenSurface,
    renderer: NativeRenderer,
) -> tuple[Separation, UprightBox]:
    """The object without the ground around its foot and what hangs beside it; and its box."""
    room = package.room
    if box.supported:
        beside = beside_foot(room, found.labels, box.support_z_m)
        found = replace(found, labels=found.labels & ~beside)
        surface, box = _box(package, found, renderer)
    beside = found.labels & found.outliers
    on = _on_object(room, found.labels & ~found.outliers, surface)
    found = replace(found, labels=found.labels & ~hanging_off(room, beside, on))
    return _remove_haze(room, found, box, surface), box


def _on_object(room: SplatCloud, labels: BoolArray, surface: SeenSurface) -> FloatArray:
    """(K, 3) points on an object: those that views agree about, and its solid splats."""
    solid = labels & (room.opacities >= SOLID)
    return np.concatenate([surface.own, room.means[solid].astype(np.float64)])


def _box(
    package: ScenePackage, found: Separation, renderer: NativeRenderer
) -> tuple[SeenSurface, UprightBox]:
    """Return the surface that the room's views show of the found splats, and its box.

    Of a large object few views frame the whole: there the cells that it was found by say more.
    """
    room = package.room
    own = found.labels & ~found.outliers
    surface = seen_surface(room, own, package.views, renderer=renderer)
    surface = replace(
        surface,
        own=np.concatenate([surface.own, found.own]),
        around=found.around if len(found.around) else surface.around,
    )
    gone = found.labels | found.floaters
    return surface, upright_box(room.select(own), room.select(~gone), surface, found.masks)


def _remove_haze(
    room: SplatCloud, found: Separation, box: UprightBox, surface: SeenSurface
) -> Separation:
    """Splats that paint the object but hang well outside its box or below its support float."""
    outside = found.labels & ~box.holds(room.means.astype(np.float64), BESIDE_BOX_M)
    below = found.labels & (room.means[:, 2] < box.support_z_m - BELOW_SUPPORT_M)
    beside = hanging_off(room, outside, surface.own) | below
    if room.opacities[beside].sum() > MAX_SHARE_BESIDE_BOX * room.opacities[found.labels].sum():
        return found
    return replace(found, labels=found.labels & ~beside, floaters=found.floaters | beside)


def _add_residual_splats(room: SplatCloud, found: Separation, box: UprightBox) -> Separation:
    """Add the residual splats that would stay on the object's support, as floaters."""
    left = residual_splats(room, found.labels | found.floaters, box.support_z_m)
    return replace(found, floaters=found.floaters | left)


def undo_cut(package: ScenePackage) -> ScenePackage:
    """The package before its last cut or refinement; its splats are equal in every bit.

    Raises:
        ValueError: nothing was cut.
    """
    if not package.cuts:
        raise ValueError(f"scene {package.name!r}: there is no cut to undo")
    last = package.cuts[-1]
    names = {f"{how} {last.object_id or FLOATERS}" for how in ("cut", ADDED)}
    if last.replaced is not None:
        names = {f"{REFINED} {last.object_id}"}
    elif not last.object_id:
        names.add(f"{REFINED} {REGION}")
    stages = list(package.stages)
    for index in reversed(range(len(stages))):
        if stages[index].name in names:
            del stages[index]
            break
    objects = [item for item in package.objects if item.object_id != last.object_id]
    if last.replaced is not None:
        before = package.object_by_id(last.object_id)
        before = replace(before, splats=last.replaced, coverage=last.replaced_coverage)
        objects = [before if item.object_id == last.object_id else item for item in package.objects]
    return replace(
        package,
        room=restore(package.room, last),
        objects=tuple(objects),
        cuts=package.cuts[:-1],
        stages=tuple(stages),
    )
