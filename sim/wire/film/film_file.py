"""Films on the disk: a folder each, written whole or not at all, found again by what made them."""

from __future__ import annotations

import hashlib
import json
import mmap
import os
import shutil
import zipfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from tempfile import mkdtemp
from typing import IO, Any, cast

import numpy as np
from numpy.typing import NDArray

from devices.messages import Event
from scenes.pose import Pose
from sim.wire.film.film import Film, FilmFormat, PictureTruth

FORMAT_VERSION = 1
"""Of a film's folder and of how films are drawn; another one is drawn anew."""

CACHE_BYTES = 4 << 30
"""Most that a cache of films may hold, bytes: about twelve films of the longest built-in script at
2880 × 1440, 30 pictures a second and 24 Mbit a second, forward and backward. The oldest go."""

UNITS, INDEX, ABOUT = "pictures.h264", "film.npz", "film.json"
"""The folder's files: the access units (any player shows them), arrays, and the rest."""


class FilmError(ValueError):
    """A folder that holds no whole film: says what is wrong in it."""


class FilmWriter:
    """Collects units and truth; `open` gives the film.

    Args:
        folder: an existing one.
        name: what the film shows.
        form: how its pictures are.
    """

    def __init__(self, folder: Path, name: str, form: FilmFormat) -> None:
        self._folder, self._name, self._form = folder, name, form
        self._file: IO[bytes] = (folder / UNITS).open("wb")
        self._sizes: list[int] = []
        self._t_ns: list[int] = []
        self._keyframes: list[bool] = []
        self._shows: list[int] = []
        self._truth: list[PictureTruth] = []
        self._events: list[Event] = []

    def add_unit(self, data: bytes, *, t_ns: int, keyframe: bool, shows: int) -> None:
        """Append an access unit.

        Raises:
            OSError: the disk is full.
        """
        self._file.write(data)
        self._sizes.append(len(data))
        self._t_ns.append(t_ns)
        self._keyframes.append(keyframe)
        self._shows.append(shows)

    def add_picture(self, truth: PictureTruth) -> None:
        """The truth of the next picture."""
        self._truth.append(truth)

    def add_events(self, events: Sequence[Event]) -> None:
        """Append events."""
        self._events += events

    def close(self) -> None:
        """Close the file of access units; harmless when closed."""
        self._file.close()

    def finish(self, duration_ns: int) -> None:
        """Write the rest.

        Raises:
            OSError: the disk is full.
        """
        self._file.close()
        names = list(self._truth[0].world_from_object) if self._truth else []
        arrays = {
            "offsets": np.concatenate([[0], np.cumsum(self._sizes, dtype=np.int64)]),
            "t_ns": np.array(self._t_ns, np.int64),
            "keyframes": np.array(self._keyframes, np.bool_),
            "shows": np.array(self._shows, np.int64),
            **_truth_arrays(self._truth, names),
        }
        with (self._folder / INDEX).open("wb") as file:
            np.savez(file, allow_pickle=False, **arrays)
        about = {
            "version": FORMAT_VERSION,
            "name": self._name,
            "width_px": self._form.width_px,
            "height_px": self._form.height_px,
            "fps": self._form.fps,
            "layout": self._form.layout,
            "bitrate": self._form.bitrate,
            "duration_ns": duration_ns,
            "objects": names,
            "faults": {k: dict(t.faults) for k, t in enumerate(self._truth) if t.faults},
            "events": [[e.t_ns, e.source, e.kind, e.text] for e in self._events],
        }
        (self._folder / ABOUT).write_text(json.dumps(about), encoding="utf-8")


def film_digest(values: Mapping[str, object]) -> str:
    """Name of the film that those values make: 24 hexadecimal digits."""
    text = json.dumps({"format": FORMAT_VERSION, **values}, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:24]


def cached_film(
    cache: Path, digest: str, fill: Callable[[Path], None], *, max_bytes: int = CACHE_BYTES
) -> tuple[Film, bool]:
    """The film of a digest, from the cache or made now, and whether it was there.

    Args:
        cache: folder of films; made if there is none.
        digest: from `film_digest`.
        fill: writes a film into the folder it is given; whatever it raises leaves nothing behind.
        max_bytes: of all films; the ones that were used longest ago are removed.

    Raises:
        OSError: the folder cannot be written.
    """
    path = cache / digest
    try:
        film = read_film(path)
    except FilmError:
        shutil.rmtree(path, ignore_errors=True)
    except FileNotFoundError:
        pass
    else:
        os.utime(path)
        return film, True
    cache.mkdir(parents=True, exist_ok=True)
    part = Path(mkdtemp(prefix=f"{digest}.", suffix=".part", dir=cache))
    try:
        fill(part)
        _moved_into_place(part, path)
    finally:
        shutil.rmtree(part, ignore_errors=True)
    _make_room(cache, path, max_bytes)
    return read_film(path), False


def read_film(folder: Path) -> Film:
    """A film from its folder; its access units stay on the disk until they are sent.

    Raises:
        FileNotFoundError: there is no such folder.
        FilmError: what is in it is no whole film of this version.
        OSError: it cannot be read.
    """
    if not folder.is_dir():
        raise FileNotFoundError(folder)
    try:
        about = cast("dict[str, Any]", json.loads((folder / ABOUT).read_text(encoding="utf-8")))
        _check_version(about["version"], folder)
        form = FilmFormat(
            about["width_px"],
            about["height_px"],
            about["fps"],
            about["layout"],
            about.get("bitrate", 0),
        )
        with np.load(folder / INDEX, allow_pickle=False) as arrays:
            values = {name: np.asarray(arrays[name]) for name in arrays.files}
        return Film(
            about["name"],
            form,
            data=_mapped(folder / UNITS),
            offsets=values["offsets"],
            t_ns=values["t_ns"],
            duration_ns=int(about["duration_ns"]),
            keyframes=values["keyframes"],
            shows=values["shows"],
            truth=_truth(about, values),
            events=[Event(*event) for event in about["events"]],
        )
    except FilmError:
        raise
    except (OSError, ValueError, KeyError, TypeError, IndexError, zipfile.BadZipFile) as error:
        raise FilmError(f"{folder}: no whole film ({type(error).__name__}: {error})") from None


def _check_version(version: object, folder: Path) -> None:
    if version != FORMAT_VERSION:
        raise FilmError(f"{folder}: version {version}, wanted {FORMAT_VERSION}")


def _mapped(path: Path) -> memoryview:
    with path.open("rb") as file:
        return memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))


def _truth_arrays(
    truth: Sequence[PictureTruth], names: Sequence[str]
) -> dict[str, NDArray[np.generic]]:
    count = len(truth)
    poses, visible = np.empty((count, len(names), 4, 4)), np.empty((count, len(names)))
    rigs = np.empty((count, 4, 4))
    for picture, each in enumerate(truth):
        rigs[picture] = each.world_from_rig.matrix()
        for number, name in enumerate(names):
            poses[picture, number] = each.world_from_object[name].matrix()
            visible[picture, number] = each.visible_fraction[name]
    times = np.array([each.t_ns for each in truth], np.int64)
    return {"poses": poses, "visible": visible, "rigs": rigs, "picture_t_ns": times}


def _truth(about: Mapping[str, Any], values: Mapping[str, NDArray[Any]]) -> list[PictureTruth]:
    names = [str(name) for name in about["objects"]]
    faults = cast("dict[str, dict[str, float]]", about["faults"])
    return [
        PictureTruth(
            int(t_ns),
            dict(zip(names, map(Pose.from_matrix, values["poses"][k]), strict=True)),
            dict(zip(names, map(float, values["visible"][k]), strict=True)),
            Pose.from_matrix(values["rigs"][k]),
            faults.get(str(k), {}),
        )
        for k, t_ns in enumerate(values["picture_t_ns"])
    ]


def _moved_into_place(part: Path, path: Path) -> None:
    """Rename; where somebody else has made the same film meanwhile, theirs stays."""
    try:
        part.rename(path)
    except OSError:
        if not path.is_dir():
            raise


def _make_room(cache: Path, kept: Path, max_bytes: int) -> None:
    """Remove the films that were used longest ago until the rest fits."""
    films = [folder for folder in cache.iterdir() if folder.is_dir() and not folder.suffix]
    films.sort(key=lambda folder: folder.stat().st_mtime, reverse=True)
    held = 0
    for folder in films:
        held += sum(file.stat().st_size for file in folder.iterdir())
        if held > max_bytes and folder != kept:
            shutil.rmtree(folder, ignore_errors=True)
