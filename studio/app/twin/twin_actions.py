"""Actions of the twin by hand: what buttons, keys, the palette and scripts do."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from scenes.pose import Pose
from studio.app.model.actions import Action
from studio.app.model.documents.added_mesh import Axis
from studio.app.model.documents.document import Document
from studio.app.model.workbench import Workbench
from studio.app.twin import additions, edits, sizes
from studio.app.twin.edits import EditError, Stance
from studio.app.twin.hand import TwinPhysics
from studio.app.twin.items import scanned_poses
from studio.app.twin.mesh_file import MeshJob, Up

GROUP = "Twin"
CAMERA_HEIGHT_M = 1.4
"""Of a camera that is added without a place: on a tripod."""

READING = "mesh files"
"""Names the reading of meshes in `Workbench.busy`."""
MAX_FILES = 16
"""Meshes that are read at a time, a thread each: as many as one drops at once."""

Point = Sequence[float]


class TwinEditing:
    """The edits of the twin as steps of undo. Methods without an item take what is selected.

    Args:
        bench: whose document is edited.
        physics: throws.
        ask_mesh: asks the user for a mesh's file; "" if they choose none.
    """

    def __init__(self, bench: Workbench, physics: TwinPhysics, ask_mesh: Callable[[], str]) -> None:
        self._bench, self._physics, self._ask_mesh = bench, physics, ask_mesh
        self._meshes: list[MeshJob] = []

    @property
    def scanned(self) -> Mapping[str, Pose]:
        """The scan's poses of its objects."""
        return scanned_poses(self._bench.scene)

    def move(self, item: str = "", place: Point | None = None) -> None:
        """Put an item at a place (x, y, z), metres."""
        item, to = self._item(item), _given(place, "twin.move", "place = [x, y, z] in m")
        self._change(
            f"Move {self._bench.name_of(item)}", edits.moved(self._document, self.scanned, item, to)
        )

    def turn(self, item: str = "", yaw_deg: float | None = None) -> None:
        """Turn an item to a heading, degrees."""
        item, yaw = self._item(item), _given(yaw_deg, "twin.turn", "yaw_deg")
        self._change(
            f"Turn {self._bench.name_of(item)}",
            edits.turned(self._document, self.scanned, item, math.radians(float(yaw))),
        )

    def tilt(self, item: str = "", x_deg: float = 0.0, y_deg: float = 0.0) -> None:
        """Lean an item about its own x and y axes, degrees."""
        item = self._item(item)
        self._change(
            f"Tilt {self._bench.name_of(item)}",
            edits.tilted(self._document, self.scanned, item, float(x_deg), float(y_deg)),
        )

    def place(
        self,
        item: str = "",
        x: float = 0.0,
        y: float = 0.0,
        z: float = 0.0,
        yaw_deg: float = 0.0,
        tilt_x_deg: float = 0.0,
        tilt_y_deg: float = 0.0,
    ) -> None:
        """Put an item at a place with a heading and a tilt, metres and degrees."""
        item = self._item(item)
        numbers = (float(v) for v in (yaw_deg, tilt_x_deg, tilt_y_deg))
        stance = Stance((float(x), float(y), float(z)), *numbers)
        self._change(
            f"Move {self._bench.name_of(item)}",
            edits.placed(self._document, self.scanned, item, stance),
        )

    def put(self, poses: Mapping[str, Any] | None = None) -> None:
        """Put several items at poses, (4, 4) `world_from_item` by id."""
        there = {
            key: Pose.from_matrix(matrix)
            for key, matrix in _given(poses, "twin.put", "poses by id").items()
        }
        self._change(
            f"Put {', '.join(map(self._bench.name_of, there))}",
            edits.put_all(self._document, self.scanned, there),
        )

    def reset(self, item: str = "") -> None:
        """Put an object back to where the scan has it."""
        item = self._item(item)
        self._change(
            f"Reset {self._bench.name_of(item)}", edits.reset(self._document, self.scanned, item)
        )

    def rename(self, item: str = "", name: str = "") -> None:
        """Give an item another name; "" gives it its own again."""
        item = self._item(item)
        self._change(
            f"Rename {self._bench.name_of(item)}",
            edits.renamed(self._document, self.scanned, item, name),
        )

    def resize(self, item: str = "", size: Point | None = None) -> None:
        """Give a body or mesh other sides (x, y, z), metres."""
        item, sides = self._item(item), _given(size, "twin.resize", "size = [x, y, z] in m")
        self._change(
            f"Resize {self._bench.name_of(item)}", sizes.resized(self._document, item, sides)
        )

    def scale(self, item: str = "", factor: float = 1.0) -> None:
        """Make a mesh so many times as large as its file has it."""
        item = self._item(item)
        document = sizes.scaled(self._document, item, float(factor))
        self._change(f"Scale {self._bench.name_of(item)}", document)

    def mesh_unit(self, item: str = "", unit: str = "m") -> None:
        """Take a mesh's lengths to be in another unit: m, cm, mm, in or ft."""
        item = self._item(item)
        document = sizes.read_in_unit(self._document, item, unit)
        self._change(f"Unit of {self._bench.name_of(item)}", document)

    def mesh_up(self, item: str = "", up: Axis = "z") -> None:
        """Take another axis of a mesh's file to be up: y or z."""
        item = self._item(item)
        document = sizes.read_with_up(self._document, item, up)
        self._change(f"Upper axis of {self._bench.name_of(item)}", document)

    def remove(self, item: str = "") -> None:
        """Take something away that was added."""
        item = self._item(item)
        self._change(
            f"Remove {self._bench.name_of(item)}", edits.removed(self._document, self.scanned, item)
        )
        if self._bench.selection == item:
            self._bench.select("")

    def add_primitive(
        self,
        shape: Any = "box",
        place: Point | None = None,
        size: Point = (0.3, 0.3, 0.3),
        yaw_deg: float = 0.0,
    ) -> None:
        """Add a box, ball or cylinder; without a place in the middle of the floor."""
        document, item = additions.primitive_added(
            self._document,
            self.scanned,
            shape=shape,
            place=self._middle() if place is None else place,
            size_m=size,
            yaw_rad=math.radians(yaw_deg),
        )
        self._added(item, document)

    def add_mesh(
        self,
        path: str = "",
        place: Point | None = None,
        yaw_deg: float = 0.0,
        unit: str = "",
        up: Up = "",
    ) -> None:
        """Add the mesh of a file, read on a thread; without a place in the middle of the floor."""
        chosen = path or self._ask_mesh()
        if not chosen:
            return
        file = Path(chosen)
        if len(self._meshes) >= MAX_FILES:
            raise EditError(f"{file.name}: {MAX_FILES} meshes are being read; add it after them")
        fallback = additions.COLOURS[len(self._document.twin.meshes) % len(additions.COLOURS)]
        job = MeshJob(
            file,
            place=edits.checked_place(file.name, self._middle() if place is None else place),
            yaw_rad=math.radians(yaw_deg),
            unit=unit,
            up=up,
            fallback=fallback,
        )
        self._meshes.append(job)
        self._bench.busy.add(READING)
        self._bench.say("info", f"reading {file.name} …")

    def poll(self) -> None:
        """Add the meshes that were read since the last time."""
        for job in tuple(self._meshes):
            read = job.result.take()
            if read is None:
                continue
            self._meshes.remove(job)
            if read.geometry is None:
                self._bench.say("error", read.text)
                continue
            document, item = additions.mesh_added(
                self._document,
                self.scanned,
                read.geometry,
                source=read.path.name,
                place=read.place,
                yaw_rad=read.yaw_rad,
                unit=read.unit,
                up=read.up,
            )
            self._added(item, document)
            self._bench.say("info", f"added {read.text}")
        if not self._meshes:
            self._bench.busy.discard(READING)

    def add_avatar(
        self, place: Point | None = None, facing_deg: float = 0.0, role: str = "remote"
    ) -> None:
        """Add a person, local or remote; without a place in the middle of the floor."""
        document, item = additions.avatar_added(
            self._document,
            self.scanned,
            place=self._middle() if place is None else place,
            facing_rad=math.radians(facing_deg),
            role=role,
        )
        self._added(item, document)

    def add_camera(self, place: Point | None = None, looks_at: Point | None = None) -> None:
        """Add a camera; without a place at the edge of the floor, looking to its middle."""
        x, y, z = self._middle()
        eye = (x, self._edge(), z + CAMERA_HEIGHT_M) if place is None else place
        target = (x, y, z + 0.5 * CAMERA_HEIGHT_M) if looks_at is None else looks_at
        document, item = additions.camera_added(
            self._document, self.scanned, place=eye, looks_at=target
        )
        self._added(item, document)

    def add_surface(self, corners: Sequence[Point] | None = None, eye: Point | None = None) -> None:
        """Add a live surface of four corners; with an eye they may come in any order."""
        picks = _given(corners, "twin.add_surface", "four corners; pick them in the view")
        self._added(
            *_swapped(additions.surface_added(self._document, self.scanned, picks, eye=eye))
        )

    def drag_corner(
        self, item: str = "", corner: int | None = None, place: Point | None = None
    ) -> None:
        """Move one corner (0 to 3) of a live surface."""
        item = self._item(item)
        number = _given(corner, "twin.drag_corner", "corner = 0 to 3")
        to = _given(place, "twin.drag_corner", "place = [x, y, z] in m")
        document = additions.corner_dragged(self._document, item, number, to)
        self._change(f"Drag a corner of {item}", document)

    def annotate(self, points: Sequence[Point] | None = None) -> None:
        """Draw a line through points (x, y, z)."""
        line = _given(points, "twin.annotate", "points; draw them in the view")
        self._added(*_swapped(additions.annotated(self._document, self.scanned, line)))

    def run_physics(self) -> None:
        """Let physics go on, or stand still."""
        if self._physics.is_busy and not self._physics.is_paused:
            self._physics.pause()
        else:
            self._physics.resume()

    def throw(self, item: str = "", velocity: Point | None = None) -> None:
        """Throw an object with a velocity (x, y, z), m/s."""
        self._physics.throw(
            self._item(item), _given(velocity, "twin.throw", "velocity = [x, y, z] in m/s")
        )

    @property
    def _document(self) -> Document:
        return self._bench.document

    def _item(self, item: str) -> str:
        chosen = item or self._bench.selection
        if not chosen:
            raise EditError("twin: nothing is selected; select an item, or name one")
        return chosen

    def _change(self, label: str, document: Document) -> None:
        self._bench.change(label, document)

    def _added(self, item: str, document: Document) -> None:
        self._change(f"Add {item}", document)
        self._bench.select(item)

    def _middle(self) -> tuple[float, float, float]:
        scene = self._bench.scene
        if scene is None:
            return (0.0, 0.0, 0.0)
        x, y = scene.footprint_m.mean(axis=0).tolist()
        return (x, y, 0.0)

    def _edge(self) -> float:
        scene = self._bench.scene
        return -2.0 if scene is None else float(scene.footprint_m[0, 1]) + 0.2


def add_twin_actions(
    bench: Workbench, physics: TwinPhysics, ask_mesh: Callable[[], str] = str
) -> TwinEditing:
    """Add what the Twin menu holds; `ask_mesh` asks for a file, by default for none."""
    do = TwinEditing(bench, physics, ask_mesh)
    rows = (
        ("move", "Move to a place", do.move, "item, place", "", "mdi6.cursor-move"),
        ("turn", "Turn to a heading", do.turn, "item, yaw_deg", "", "mdi6.rotate-3d-variant"),
        ("tilt", "Tilt", do.tilt, "item, x_deg, y_deg", "", "mdi6.angle-acute"),
        ("place", "Put something at a place", do.place,
         "item, x, y, z, yaw_deg, tilt_x_deg, tilt_y_deg", "", ""),
        ("put", "Put items at poses", do.put, "poses", "", ""),
        ("reset", "Reset to the scan", do.reset, "item", "", "mdi6.restore"),
        ("rename", "Rename", do.rename, "item, name", "", ""),
        ("resize", "Give other sides", do.resize, "item, size", "", ""),
        ("scale", "Scale a mesh", do.scale, "item, factor", "", ""),
        ("mesh_unit", "Unit of a mesh", do.mesh_unit, "item, unit", "", ""),
        ("mesh_up", "Upper axis of a mesh", do.mesh_up, "item, up", "", ""),
        ("remove", "Remove", do.remove, "item", "", "mdi6.delete-outline"),
        ("add_primitive", "Add a box, ball or cylinder", do.add_primitive,
         "shape, place, size, yaw_deg", "", "mdi6.cube-outline"),
        ("add_mesh", "Add a mesh from a file", do.add_mesh, "path, place, yaw_deg, unit, up", "",
         "mdi6.vector-triangle"),
        ("add_avatar", "Add a person", do.add_avatar, "place, facing_deg, role", "",
         "mdi6.account-outline"),
        ("add_camera", "Add a camera", do.add_camera, "place, looks_at", "",
         "mdi6.video-outline"),
        ("add_surface", "Add a live surface", do.add_surface, "corners, eye", "",
         "mdi6.vector-square"),
        ("drag_corner", "Drag a corner of a live surface", do.drag_corner,
         "item, corner, place", "", ""),
        ("annotate", "Annotate", do.annotate, "points", "", "mdi6.draw"),
        ("physics", "Run or pause physics", do.run_physics, "", "", "mdi6.play-pause"),
        ("throw", "Throw", do.throw, "item, velocity", "", "mdi6.hand-back-left-outline"),
    )  # fmt: skip
    for name, title, run, arguments, keys, icon in rows:
        bench.actions.add(
            Action(
                f"twin.{name}",
                title,
                GROUP,
                run,
                (run.__doc__ or "").split(".")[0],
                keys,
                tuple(arguments.split(", ")) if arguments else (),
                icon=icon,
            )
        )
    return do


def _given(value: Any, action: str, wanted: str) -> Any:
    if value is None:
        raise EditError(f"{action}: wanted {wanted}")
    return value


def _swapped(pair: tuple[Document, str]) -> tuple[str, Document]:
    return pair[1], pair[0]
