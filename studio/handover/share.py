"""One call that makes what is handed over after a rehearsal: film, viewer, sheet and archive."""

from __future__ import annotations

import shutil
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from pathlib import Path

import av
from av.error import FFmpegError
from PIL import Image

from devices.recorded.index import is_whole
from devices.recording import read_session
from devices.session_info import SessionInfo
from scenes.formats.storage.atomic import write_folder
from scenes.opening import open_scene
from scenes.package import ScenePackage
from studio.console.progress import Progress
from studio.handover.archive import write_archive
from studio.handover.moments import Moments, read_moments
from studio.handover.sheet import read_rows, sheet_html, sheet_markdown, sheet_of
from studio.handover.viewer_page import ViewerPage, write_viewer
from studio.session.opening import scene_hash
from studio.session.pipeline import CancelledError
from studio.session.records.outputs import FILM, RECORDING, REPORT_JSON
from studio.session.records.recorded_scene import recorded_scene
from studio.web.web_files import licences, web_modules

VIEWER, SHEET_MD, SHEET_HTML = "viewer.html", "session-sheet.md", "session-sheet.html"

PICTURES, ARCHIVE = "pictures", "archive.zip"

SHARED_NAMES = frozenset({FILM, VIEWER, SHEET_MD, SHEET_HTML, PICTURES, ARCHIVE})
"""Names in a folder of ours: only such a folder is replaced."""

VIEWER_BYTES = 25_000_000
"""Of the viewer at most, chosen: what most mail servers still take as an attachment."""

SHEET_BYTES = 5_000_000
"""More than both sheets and their pictures take, for the estimate of the disk space."""

CUT_OFF = "the recording was cut off; what was shared ends where it does"

STILLS = 4
"""Pictures on the session sheet, chosen: two rows of two fill the rest of its page."""

WIDTH_PX = 1200
"""Of the pictures, chosen: sharp in print on half a page."""

JPEG_QUALITY = 84


class Part(StrEnum):
    """Parts that can be handed over."""

    VIEWER = "viewer"
    FILM = "film"
    SHEET = "sheet"
    ARCHIVE = "archive"


ALL = frozenset(Part)


@dataclass(frozen=True, slots=True)
class Shared:
    """The files that were made.

    Attributes:
        folder: that holds all of it.
        film: the film.
        viewer: the page with the room and the moving objects.
        sheet: the session sheet as a page; the same as Markdown lies beside it.
        sheet_markdown: that one.
        archive: everything in one file.
        splats: in the viewer; 0 without one.
        of_splats: in the scene.
        parts: that were made.
        note: what to know of it, in words; empty if all is as it should be.
    """

    folder: Path
    film: Path
    viewer: Path
    sheet: Path
    sheet_markdown: Path
    archive: Path
    splats: int
    of_splats: int
    parts: frozenset[Part] = ALL
    note: str = ""

    @property
    def paths(self) -> tuple[Path, ...]:
        """All files that were made."""
        files = {
            self.film: Part.FILM,
            self.viewer: Part.VIEWER,
            self.sheet: Part.SHEET,
            self.sheet_markdown: Part.SHEET,
            self.archive: Part.ARCHIVE,
        }
        return tuple(path for path, part in files.items() if part in self.parts)

    @property
    def first(self) -> Path:
        """The file to open or to send: the viewer if it was made."""
        order = (Part.VIEWER, Part.SHEET, Part.FILM, Part.ARCHIVE)
        paths = (self.viewer, self.sheet, self.film, self.archive)
        return next(path for path, part in zip(paths, order, strict=True) if part in self.parts)


def share(
    folder: Path,
    out: Path,
    *,
    progress: Progress | None = None,
    cancelled: threading.Event | None = None,
    scene: str | None = None,
    viewer_bytes: int = VIEWER_BYTES,
    parts: frozenset[Part] = ALL,
) -> Shared:
    """Make everything that is handed over; `out` is complete in the end, or as it was.

    Args:
        folder: that a rehearsal or a fork left.
        out: the folder to make; an earlier one of the same kind is replaced.
        progress: shows how far it is.
        cancelled: set it from another thread to stop.
        scene: name or path of the scene, where it is no longer where the recording says.
        viewer_bytes: of the viewer at most; its room is thinned to that.
        parts: what is made.

    Raises:
        CancelledError: it was cancelled; nothing is left behind.
        ValueError: the folder is no rehearsal's, `out` holds something else, a file is damaged, or
            nothing is to be made.
        OSError: the scene or a library is missing, or the disk is too full.
    """
    progress = progress or Progress(lambda _text, _final: None)
    cancelled = cancelled or threading.Event()
    if not parts:
        raise ValueError(f"share: nothing to make; wanted some of {', '.join(Part)}")
    check_folders(folder, out)
    check_space(folder, out, viewer_bytes)
    made: list[ViewerPage | None] = []

    def fill(part: Path) -> None:
        made.append(
            _fill(
                folder,
                part,
                scene=scene,
                viewer_bytes=viewer_bytes,
                progress=progress,
                cancelled=cancelled,
                parts=parts,
            )
        )

    write_folder(out, fill, replace=True)
    return _shared(out, made[-1], parts, note="" if is_whole(folder / RECORDING) else CUT_OFF)


def _shared(out: Path, page: ViewerPage | None, parts: frozenset[Part], *, note: str) -> Shared:
    return Shared(
        folder=out,
        film=out / FILM,
        viewer=out / VIEWER,
        sheet=out / SHEET_HTML,
        sheet_markdown=out / SHEET_MD,
        archive=out / ARCHIVE,
        splats=0 if page is None else page.splats,
        of_splats=0 if page is None else page.of_splats,
        parts=parts,
        note=note,
    )


def check_folders(folder: Path, out: Path) -> None:
    """Refuse a folder that no rehearsal left, and a place that holds something else.

    Raises:
        ValueError: says which of them, and what to do.
    """
    for name in (RECORDING, REPORT_JSON, FILM):
        if not (folder / name).is_file():
            raise ValueError(
                f"{folder}: holds no {name}; wanted a folder that 'nexus rehearse' or "
                "'nexus fork' left"
            )
    inside, around = out.resolve(), folder.resolve()
    if inside == around or around in inside.parents or inside in around.parents:
        raise ValueError(
            f"{out}: is, holds or lies in the rehearsal's own folder; choose another one with --out"
        )
    if out.exists() and not out.is_dir():
        raise ValueError(f"{out}: is a file; choose another folder with --out")
    foreign = (
        sorted(e.name for e in out.iterdir() if e.name not in SHARED_NAMES) if out.exists() else []
    )
    if foreign:
        raise ValueError(
            f"{out}: holds {foreign[0]!r}, which 'nexus share' did not write; "
            "choose an empty folder with --out"
        )


def check_space(folder: Path, out: Path, viewer_bytes: int) -> None:
    """Refuse a disk without room for it all.

    Raises:
        OSError: says how much is needed and how much is free.
    """
    session = sum(file.stat().st_size for file in _session_files(folder).values())
    film = (folder / FILM).stat().st_size
    # The viewer once, its splats beside it while it is made, and once more in the archive.
    needed = session + film + 3 * viewer_bytes + SHEET_BYTES
    place = out.resolve()
    while not place.exists():
        place = place.parent
    free = shutil.disk_usage(place).free
    if free < needed:
        raise OSError(
            f"{out}: about {needed / 1e6:.0f} MB are needed there (archive "
            f"{(session + viewer_bytes) / 1e6:.0f}, viewer {2 * viewer_bytes / 1e6:.0f}, film "
            f"{film / 1e6:.0f}), {free / 1e6:.0f} MB are free; free some space or choose another "
            "folder with --out"
        )


def _fill(
    folder: Path,
    part: Path,
    *,
    scene: str | None,
    viewer_bytes: int,
    progress: Progress,
    cancelled: threading.Event,
    parts: frozenset[Part],
) -> ViewerPage | None:
    info = read_session(folder / RECORDING)
    progress.begin("reading the recording")
    moments = read_moments(
        folder / RECORDING,
        info.methods[0],
        cancelled=cancelled,
        reached=lambda t_ms: progress.advance(0.0, f"{t_ms / 1000:.0f} s"),
    )
    progress.finish(f"{moments.frames} frames, {moments.end_ms / 1000:.1f} s")

    progress.begin("opening the scene")
    package = recorded_scene(info) if scene is None else open_scene(scene)
    progress.finish()

    page: ViewerPage | None = None
    if Part.VIEWER in parts:
        progress.begin("making the viewer")
        page = write_viewer(
            part / VIEWER,
            scene=package,
            info=info,
            moments=moments,
            modules=web_modules(progress.begin),
            licences=licences(),
            most_bytes=viewer_bytes,
            cancelled=cancelled,
        )
        progress.finish(f"{page.splats} of {page.of_splats} splats, {page.size_bytes / 1e6:.1f} MB")

    progress.begin("writing film and session sheet")
    _stop_if(cancelled)
    if Part.FILM in parts:
        shutil.copyfile(folder / FILM, part / FILM)
    if Part.SHEET in parts:
        _write_sheets(folder, part, info=info, moments=moments, package=package, page=page)
    progress.finish()

    if Part.ARCHIVE in parts:
        progress.begin("packing the archive")
        write_archive(
            part / ARCHIVE,
            {**_session_files(folder), **_shared_files(part)},
            cancelled=cancelled,
            reached=progress.advance,
        )
        progress.finish(f"{(part / ARCHIVE).stat().st_size / 1e6:.1f} MB")
    return page


def _write_sheets(
    folder: Path,
    part: Path,
    *,
    info: SessionInfo,
    moments: Moments,
    package: ScenePackage,
    page: ViewerPage | None,
) -> None:
    notes: list[tuple[str, str]] = (
        [] if page is None else [("viewer", f"{page.splats} of {page.of_splats} splats")]
    )
    if not is_whole(folder / RECORDING):
        notes.append(("note", f"{CUT_OFF}, at {moments.end_ms / 1000.0:.1f} s"))
    if scene_hash(package) != info.scene_hash:
        notes.append(("note", "the scene has changed since; the viewer shows the newer one"))
    sheet = sheet_of(
        info,
        read_rows(folder / REPORT_JSON),
        recorded=datetime.fromtimestamp((folder / RECORDING).stat().st_mtime).astimezone(),
        seconds=moments.end_ms / 1000.0,
        frames=moments.frames,
        events=moments.events,
        pictures=write_stills(folder / FILM, part / PICTURES, STILLS),
        notes=notes,
    )
    (part / SHEET_MD).write_text(sheet_markdown(sheet), encoding="utf-8")
    (part / SHEET_HTML).write_text(sheet_html(sheet), encoding="utf-8")


def _session_files(folder: Path) -> dict[str, Path]:
    """Everything that the rehearsal left, by its name in the archive."""
    return _files(folder, "session")


def _shared_files(part: Path) -> dict[str, Path]:
    """Return the files that were made, but the film, which the rehearsal's files hold."""
    left_out = {f"shared/{ARCHIVE}", f"shared/{FILM}"}
    return {name: path for name, path in _files(part, "shared").items() if name not in left_out}


def _files(folder: Path, name: str) -> dict[str, Path]:
    return {
        f"{name}/{path.relative_to(folder).as_posix()}": path
        for path in folder.rglob("*")
        if path.is_file() and not path.is_symlink()
    }


def _stop_if(cancelled: threading.Event) -> None:
    if cancelled.is_set():
        raise CancelledError


def write_stills(film: Path, folder: Path, count: int) -> list[tuple[float, Path]]:
    """Write JPEG files `1.jpg`, `2.jpg`, ... and give the second of the film that each shows.

    Args:
        film: a video file.
        folder: made if it is missing.
        count: how many; fewer where the film has fewer pictures.

    Raises:
        ValueError: the film cannot be decoded.
        OSError: a file cannot be read or written.
    """
    folder.mkdir(exist_ok=True)
    found: list[tuple[float, Path]] = []
    try:
        for number, (t_s, picture) in enumerate(_pictures(film, count), start=1):
            height = max(1, round(picture.height * WIDTH_PX / picture.width))
            path = folder / f"{number}.jpg"
            smaller = picture.resize((WIDTH_PX, height), Image.Resampling.LANCZOS)
            smaller.save(path, "JPEG", quality=JPEG_QUALITY)
            found.append((t_s, path))
    except FFmpegError as error:
        raise ValueError(f"{film}: damaged film: {error}; make it again by rehearsing") from None
    return found


def _pictures(film: Path, count: int) -> Iterator[tuple[float, Image.Image]]:
    """In the middle of `count` equal spans; the film is gone to there, not read through."""
    with av.open(str(film)) as container:
        if not container.streams.video:
            raise ValueError(f"{film}: holds no video; make it again by rehearsing")
        stream = container.streams.video[0]
        span_s = float((container.duration or 0) / av.time_base)
        last = -1.0
        for index in range(count):
            wanted_s = span_s * (index + 0.5) / count
            container.seek(int(wanted_s * av.time_base))
            for frame in container.decode(stream):
                at_s = frame.time or 0.0
                if at_s + 1e-3 >= wanted_s:
                    if at_s > last:
                        yield at_s, frame.to_image()
                        last = at_s
                    break
