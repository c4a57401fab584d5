"""Contents of a dataset folder: photos of a room, 360° pictures of it, and the truth of both.

The form is described in docs/datasets.md. Poses are 4 × 4 row-major `a_from_b` matrices, cameras
have OpenCV's axes, the world is right-handed with Z up, lengths are metres.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.evaluate.answers import Visibility
from benchmarks.evaluate.dataset.json_field import Field, existing, read_json
from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose

STILLS = ("room", "table")
SEQUENCE = "sequence"
START = "start"
"""Stills whose name begins so show every object where the capture showed it."""

DEFAULT_STILL_NS = 1_000_000_000
"""Time between stills that carry no time of their own."""


@dataclass(frozen=True, slots=True, eq=False)
class DatasetObject:
    """A movable object.

    Attributes:
        object_id: its name.
        kind: what it is, such as "chair".
        mesh: file of its triangle mesh, in its own frame.
        box_m: (3,) extents along its own axes.
        world_from_object: where it stands in the capture; the frame's origin is in its base.
        symmetry: how many yaws in a turn look the same; 0 if all do.
    """

    object_id: str
    kind: str
    mesh: Path
    box_m: NDArray[np.float64]
    world_from_object: Pose
    symmetry: int


@dataclass(frozen=True, slots=True, eq=False)
class Still:
    """One picture of the 360° camera.

    Attributes:
        name: of the picture.
        picture: its file.
        labels: its label picture.
        t_ns: capture time from the first picture of the set.
        world_from_object: true poses by object.
        visible: by object.
        world_from_person: where somebody stands, origin between the feet, X ahead; None if nobody.
    """

    name: str
    picture: Path
    labels: Path
    t_ns: int
    world_from_object: Mapping[str, Pose]
    visible: Mapping[str, Visibility]
    world_from_person: Pose | None = None


@dataclass(frozen=True, slots=True, eq=False)
class StillSet:
    """Pictures of one camera on one stand.

    Attributes:
        name: "room", "table" or "sequence".
        lens: of the camera.
        world_from_camera: where it truly stands.
        moving: the objects that move in it.
        stills: in order of time.
    """

    name: str
    lens: Fisheye
    world_from_camera: Pose
    moving: tuple[str, ...]
    stills: tuple[Still, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Dataset:
    """A room with exact truth.

    Attributes:
        folder: where it lies.
        camera: of the capture's photos; None in a data set that has pictures of the 360° camera
            only.
        world_from_camera: true pose of each photo, by file name.
        photo_visible: by photo and object.
        label_of: label value of each object.
        label_scale: photo pixels per label pixel, each way.
        objects: by id.
        code_side_m: printed side of the codes.
        code_corners_m: (4, 3) by payload: top left, top right, bottom right, bottom left.
        check_codes: payloads that are kept out of the alignment where another can do without them.
        room_mesh: what never moves.
        sets: by name.
    """

    folder: Path
    camera: Pinhole | None
    world_from_camera: Mapping[str, Pose]
    photo_visible: Mapping[str, Mapping[str, Visibility]]
    label_of: Mapping[str, int]
    label_scale: int
    objects: Mapping[str, DatasetObject]
    code_side_m: float
    code_corners_m: Mapping[str, NDArray[np.float64]]
    check_codes: tuple[str, ...]
    room_mesh: Path
    sets: Mapping[str, StillSet]

    @property
    def photos(self) -> Path:
        """Folder of the capture's photos."""
        return self.folder / "capture" / "images"

    def photo_camera(self) -> Pinhole:
        """Camera of the photos.

        Raises:
            ValueError: the data set has none, so that nothing can be prepared from it.
        """
        if self.camera is None:
            raise ValueError(
                f"{self.folder / 'capture'}: no photos of the room, so it cannot be prepared; "
                "only the 360° camera's pictures and their truth are there"
            )
        return self.camera

    def photo_labels(self, photo: str) -> NDArray[np.uint8]:
        """(H, W) label picture of a photo, `label_scale` times smaller.

        Raises:
            ValueError: it is missing or no picture.
        """
        return read_labels(self.folder / "capture" / "masks" / f"{Path(photo).stem}.png")


def read_dataset(folder: Path) -> Dataset:
    """Read a dataset's descriptions; pictures are only looked for, not opened.

    Raises:
        ValueError: a file or a field is missing or damaged; names both.
    """
    objects, codes = read_json(folder / "objects.json"), read_json(folder / "qr.json")
    corners = {name: code.get("corners_world").array(4, 3) for name, code in codes.get("codes")}
    checks = [name for name, code in codes.get("codes") if code.optional("role") == "check"]
    items = {name: _object(folder, name, item) for name, item in objects.get("objects")}
    sets = {
        name: _still_set(folder, name, read_json(folder / "fisheye" / name / "truth.json"))
        for name in (*STILLS, SEQUENCE)
        if (folder / "fisheye" / name / "truth.json").is_file()
    }
    if not sets:
        raise ValueError(f"{folder / 'fisheye'}: no set with a truth.json; wanted room, table, …")
    captured = (folder / "capture").is_dir()
    camera, poses = _captured(folder) if captured else (None, {})
    seen, labels, scale = _labelled(folder) if captured else _labelled_in(folder, next(iter(sets)))
    return Dataset(
        folder=folder,
        camera=camera,
        world_from_camera=poses,
        photo_visible=seen,
        label_of=labels,
        label_scale=scale,
        objects=items,
        code_side_m=codes.get("side_m").number(),
        code_corners_m=corners,
        check_codes=tuple(checks),
        room_mesh=existing(folder / "room.obj"),
        sets=sets,
    )


def _captured(folder: Path) -> tuple[Pinhole, Mapping[str, Pose]]:
    """The photos' camera, and where each was taken."""
    capture = read_json(folder / "capture/cameras.json")
    poses = {
        Path(frame.get("file").text()).name: frame.get("world_from_camera").pose()
        for frame in capture.get("frames").items()
    }
    return _pinhole(capture), poses


Labelled = tuple[Mapping[str, Mapping[str, Visibility]], Mapping[str, int], int]


def _labelled(folder: Path) -> Labelled:
    """Return the objects in each photo, their labels, and photo pixels per label pixel."""
    seen = read_json(folder / "capture/visible.json")
    visible = {
        Path(photo).name: {name: _visibility(value) for name, value in objects_seen}
        for photo, objects_seen in seen.get("frames")
    }
    labels = seen.get("labels")
    ids = {name: int(value.number()) for name, value in labels.get("ids")}
    return visible, ids, int(labels.get("scale").number())


def _labelled_in(folder: Path, name: str) -> Labelled:
    """The labels of a data set without photos, as a set of its own states them."""
    labels = read_json(folder / "fisheye" / name / "truth.json").get("labels")
    return {}, {name: int(value.number()) for name, value in labels}, 1


def read_labels(path: Path) -> NDArray[np.uint8]:
    """(H, W) label picture.

    Raises:
        ValueError: it is missing or no picture.
    """
    return _opened(path, cv2.IMREAD_GRAYSCALE)


def read_rgb(path: Path) -> NDArray[np.uint8]:
    """(H, W, 3) picture.

    Raises:
        ValueError: it is missing or no picture.
    """
    return np.ascontiguousarray(_opened(path, cv2.IMREAD_COLOR)[..., ::-1])


def _opened(path: Path, mode: int) -> NDArray[np.uint8]:
    picture = cv2.imread(str(existing(path)), mode | cv2.IMREAD_IGNORE_ORIENTATION)
    if picture is None:
        raise ValueError(f"{path}: no picture that can be decoded; copy the dataset again")
    return np.asarray(picture, dtype=np.uint8)


def _pinhole(camera: Field) -> Pinhole:
    width, height = (int(camera.get(side).number()) for side in ("width", "height"))
    fx, fy, cx, cy = (camera.get(name).number() for name in ("fx", "fy", "cx", "cy"))
    return Pinhole(width, height, fx, fy, cx, cy)


def _object(folder: Path, name: str, item: Field) -> DatasetObject:
    low, high = item.get("box_min").array(3), item.get("box_max").array(3)
    return DatasetObject(
        object_id=name,
        kind=item.get("type").text(),
        mesh=existing(folder / item.get("mesh").text()),
        box_m=high - low,
        world_from_object=item.get("world_from_object").pose(),
        symmetry=_symmetry(item),
    )


def _symmetry(item: Field) -> int:
    """The number of like yaws: given as one, or in words ("repeat every 120 deg").

    Raises:
        ValueError: neither.
    """
    given = item.optional("symmetry")
    if given is None:
        return 1
    if isinstance(given, int) and given >= 0:
        return given
    found = re.search(r"every (\d+(?:\.\d+)?) ?deg", str(given))
    if found and float(found[1]) > 0:
        return round(360.0 / float(found[1]))
    if "any yaw" in str(given) or "round" in str(given):
        return 0
    raise item.get("symmetry").wrong(f"{given!r}, wanted a number or 'every N deg'")


def _still_set(folder: Path, name: str, truth: Field) -> StillSet:
    camera = truth.get("camera")
    lens = Fisheye(
        width_px=int(camera.get("width").number()),
        height_px=int(camera.get("height").number()),
        f_px=camera.get("f_px").number(),
        cx=camera.get("cx").number(),
        cy=camera.get("cy").number(),
        max_angle=math.radians(camera.get("fov_deg").number()) / 2,
    )
    stills = []
    for index, frame in enumerate(truth.get("frames").items()):
        seconds = frame.optional("time_s")
        t_ns = index * DEFAULT_STILL_NS if seconds is None else round(1e9 * float(seconds))
        file = folder / "fisheye" / name / frame.get("file").text()
        if file.suffix == ".mp4":
            raise frame.get("file").wrong(f"{file.name} is a video; write it with --pictures png")
        stills.append(
            Still(
                name=frame.get("name").text(),
                picture=existing(file),
                labels=file.parent.with_name("masks") / f"{file.stem}.png",
                t_ns=t_ns,
                world_from_object={
                    object_id: pose.pose() for object_id, pose in frame.get("world_from_object")
                },
                visible={
                    object_id: _visibility(value) for object_id, value in frame.get("visible")
                },
                world_from_person=(
                    frame.get("world_from_person").pose()
                    if frame.optional("world_from_person") is not None
                    else None
                ),
            )
        )
    moving = tuple(item.text() for item in truth.get("moving").items() if item.text() != "person")
    return StillSet(name, lens, truth.get("world_from_camera").pose(), moving, tuple(stills))


def _visibility(value: Field) -> Visibility:
    box = value.optional("box_unoccluded")
    width = 0.0 if box is None else float(box[2] - box[0])
    return Visibility(value.get("fraction").number(), width)
