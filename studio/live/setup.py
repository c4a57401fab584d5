"""Devices of a live session and their settings: a TOML file that a person writes.

[camera]
address = "rtmp://:1935/live/room"
layout = "auto"
place = "find"

A table [hololens] may follow, see `studio/live/hololens/address.py`.
"""

from __future__ import annotations

import json
import time
import tomllib
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from devices.camera.address import AddressError, CameraAddress, parse_address
from devices.camera.lenses.layout import LENSES, Arrangement, LensLayout
from devices.camera.lenses.lens_pictures import USUAL_LENS_DISTANCE_M
from sim.tables import ScenarioError, Table
from studio.live.hololens.address import read_worn, worn_text
from studio.live.hololens.worn import WornPlan

AUTO = "auto"
"""Word for what is found from the pictures."""


class Place(StrEnum):
    """Ways for a session to learn the camera's pose."""

    FIND = "find"
    """Searched for in the room's splats, anywhere."""
    SCAN = "scan"
    """About where the scan says that it stands, to some 2° and 10 cm."""


class SetupError(ValueError):
    """A file of devices that cannot be used: names the file, the key, the value and what to do."""


@dataclass(frozen=True, slots=True)
class LiveSetup:
    """The devices of a live session.

    Attributes:
        camera: where the pictures come from.
        layout: how they hold the lenses; None to find it in the first picture.
        lens_size_px: side of the lens pictures that are tracked; None for the stream's own.
        camera_file: lenses as they were calibrated, JSON; None to begin with usual ones.
        lens_distance_m: between the lenses of a camera without camera file, along their axis.
        place: how the camera's pose is found.
        calibrates: whether lenses and pose are fitted to the room before going live.
        hololens: of the local user; None where there is none.
    """

    camera: CameraAddress
    layout: LensLayout | None = None
    lens_size_px: int | None = None
    camera_file: Path | None = None
    lens_distance_m: float = USUAL_LENS_DISTANCE_M
    place: Place = Place.FIND
    calibrates: bool = True
    hololens: WornPlan | None = None


def read_setup(path: Path) -> LiveSetup:
    """The setup in a file.

    Raises:
        SetupError: something in it is wrong.
        OSError: it cannot be read.
    """
    try:
        values = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise SetupError(f"{path}: no TOML: {error}") from None
    try:
        top = Table(values, str(path), "")
        camera = top.table("camera")
        setup = LiveSetup(
            camera=_address(camera),
            layout=_layout(camera),
            lens_size_px=_lens_size_px(camera),
            camera_file=_beside(path, camera.optional_text("lenses")),
            lens_distance_m=camera.number(
                "lens_distance_m", USUAL_LENS_DISTANCE_M, low=0.0, high=0.2
            ),
            place=_place(camera),
            calibrates=camera.text("calibration", AUTO) != "off",
            hololens=read_worn(top.table("hololens")) if "hololens" in values else None,
        )
        camera.done()
        top.done()
    except ScenarioError as error:
        raise SetupError(str(error)) from None
    return setup


def setup_text(setup: LiveSetup) -> str:
    """The file that `read_setup` reads the same setup from; a password of the address is in it."""
    usual = LiveSetup(setup.camera)
    values: dict[str, str | float] = {
        "address": address_text(setup.camera),
        "layout": layout_text(setup.layout),
        "place": str(setup.place),
    }
    if setup.lens_size_px is not None:
        values["lens_size_px"] = setup.lens_size_px
    if setup.camera_file is not None:
        values["lenses"] = str(setup.camera_file.resolve())
    if setup.lens_distance_m != usual.lens_distance_m:
        values["lens_distance_m"] = setup.lens_distance_m
    if not setup.calibrates:
        values["calibration"] = "off"
    # What JSON writes of a text or a number, TOML reads the same.
    text = "[camera]\n" + "".join(f"{key} = {json.dumps(value)}\n" for key, value in values.items())
    return text if setup.hololens is None else text + worn_text(setup.hololens)


def address_text(address: CameraAddress) -> str:
    """Return the text of an address for `parse_address`; a password is in it."""
    if address.udp_transport:
        return "rtsp+udp://" + address.text.partition("://")[2]
    return address.text


def layout_text(layout: LensLayout | None) -> str:
    """A layout in the words that `parse_layout` reads."""
    if layout is None:
        return AUTO
    return " ".join([layout.arrangement, *(str(90 * turn) for turn in layout.turns)])


def parse_layout(text: str) -> LensLayout | None:
    """A layout in words, such as `side_by_side 90 270` (degrees clockwise); None for `auto`.

    Raises:
        ValueError: it is none.
    """
    words = text.replace(",", " ").split()
    wanted = (
        f"wanted {AUTO}, or one of {', '.join(Arrangement)} with each picture's turn in degrees "
        "clockwise, such as side_by_side 0 0"
    )
    if words == [AUTO]:
        return None
    try:
        arrangement = Arrangement(words[0])
        turns = tuple(int(word) for word in words[1:]) or (0,) * LENSES[arrangement]
        # A turn that is no multiple of 90° is no quarter, which the layout refuses.
        quarters = tuple(-1 if turn % 90 else turn // 90 % 4 for turn in turns)
        return LensLayout(arrangement, quarters)
    except (ValueError, IndexError):
        raise ValueError(f"layout {text!r}: {wanted}") from None


def _address(camera: Table) -> CameraAddress:
    try:
        return parse_address(camera.text("address"))
    except AddressError as error:
        raise SetupError(str(error)) from None


def _layout(camera: Table) -> LensLayout | None:
    text = camera.text("layout", AUTO)
    try:
        return parse_layout(text)
    except ValueError as error:
        raise camera.error("layout", text, str(error).partition("wanted ")[2]) from None


def _lens_size_px(camera: Table) -> int | None:
    size = camera.integer("lens_size_px", 0, low=0, high=4096)
    if size and (size < 64 or size % 2):
        raise camera.error("lens_size_px", size, "an even number of at least 64, or 0")
    return size or None


def _place(camera: Table) -> Place:
    text = camera.text("place", Place.FIND)
    try:
        return Place(text)
    except ValueError:
        raise camera.error("place", text, f"one of {', '.join(Place)}") from None


def _beside(path: Path, name: str | None) -> Path | None:
    return None if name is None else path.parent / name


def recording_in(folder: Path) -> Path:
    """A new recording's path in a folder, named by the local time; nothing is made yet."""
    stem = time.strftime("live-%Y%m%d-%H%M%S")
    path = folder / f"{stem}.mcap"
    number = 2
    while path.exists() or path.with_name(path.name + ".part").exists():
        path = folder / f"{stem}-{number}.mcap"
        number += 1
    return path
