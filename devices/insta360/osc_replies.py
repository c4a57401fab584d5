"""Replies of the camera's HTTP interface (Open Spherical Camera, level 2): bytes to values.

Nothing here reads a socket. What a camera leaves out is empty or None; what it says in another type
than it should counts as left out.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, NoReturn, cast

from devices.insta360.errors import CameraProtocolError

MAX_BODY_BYTES = 4 << 20
"""Limit of a reply. A list of 500 files with thumbnails of 100 px is about 2 MB."""

MAX_FILES = 10_000
"""Entries of one list of files that are looked at."""

CommandState = Literal["done", "inProgress", "error"]


@dataclass(frozen=True, slots=True)
class OscInfo:
    """`/osc/info`: manufacturer, model, serial number, firmware; what it can do.

    Attributes:
        manufacturer, model, serial, firmware: in the camera's words.
        api: paths that it answers.
        api_levels: 1, 2.
        uptime_s: since it was switched on; None if unsaid.
    """

    manufacturer: str
    model: str
    serial: str
    firmware: str
    api: tuple[str, ...]
    api_levels: tuple[int, ...]
    uptime_s: float | None


@dataclass(frozen=True, slots=True)
class OscState:
    """`/osc/state`.

    Attributes:
        fingerprint: changes when anything of the state does.
        battery: 0 to 1; None if unsaid.
        card: "pass", "noCard", "noSpace", "invalidFormat", "writeProtect", "otherError".
        storage: where files are, as a URL.
    """

    fingerprint: str
    battery: float | None
    card: str
    storage: str


@dataclass(frozen=True, slots=True)
class OscCommand:
    """State of a command.

    Attributes:
        name: such as "camera.takePicture".
        state: done, in progress or failed.
        command_id: to ask again with; empty when done.
        completion: 0 to 1.
        results: as the camera gives them.
        error_code, error_text: in the camera's words.
    """

    name: str
    state: CommandState
    command_id: str
    completion: float
    results: Mapping[str, Any]
    error_code: str
    error_text: str


@dataclass(frozen=True, slots=True)
class OscFile:
    """A file on the camera's card.

    Attributes:
        name: of the file.
        url: where it can be fetched.
        size_bytes: 0 if unsaid.
        taken: date, time and zone in the camera's form.
        width_px, height_px: of the picture; 0 if unsaid.
    """

    name: str
    url: str
    size_bytes: int
    taken: str
    width_px: int
    height_px: int


def read_object(body: bytes) -> dict[str, Any]:
    """A reply's JSON object.

    Raises:
        CameraProtocolError: too long, no JSON, or something else than an object.
    """
    if len(body) > MAX_BODY_BYTES:
        raise CameraProtocolError(f"a reply of more than {MAX_BODY_BYTES} bytes")
    try:
        value = json.loads(body, parse_constant=_no_number)
    except (ValueError, RecursionError) as error:
        raise CameraProtocolError(
            f"{len(body)} bytes that are no JSON ({str(error)[:120] or 'nested too deep'})"
        ) from None
    if not isinstance(value, dict):
        raise CameraProtocolError(f"JSON of {type(value).__name__}, wanted an object")
    return cast(dict[str, Any], value)


def _no_number(word: str) -> NoReturn:
    raise ValueError(f"{word} is no number")


def read_info(body: bytes) -> OscInfo:
    """The reply to `/osc/info`.

    Raises:
        CameraProtocolError: no JSON object, or one without model and API: no such camera.
    """
    value = read_object(body)
    info = OscInfo(
        _text(value, "manufacturer"),
        _text(value, "model"),
        _text(value, "serialNumber"),
        _text(value, "firmwareVersion"),
        tuple(item for item in _list(value, "api") if isinstance(item, str)),
        tuple(item for item in _list(value, "apiLevel") if type(item) is int),
        _number(value, "uptime"),
    )
    if not info.model or not info.api:
        raise CameraProtocolError("JSON without model and api: no Open Spherical Camera")
    return info


def read_state(body: bytes) -> OscState:
    """The reply to `/osc/state`.

    Raises:
        CameraProtocolError: no JSON object.
    """
    value = read_object(body)
    state = _object(value, "state")
    battery = _number(state, "batteryLevel")
    return OscState(
        _text(value, "fingerprint"),
        None if battery is None else min(max(battery, 0.0), 1.0),
        _text(state, "_cardState"),
        _text(state, "storageUri"),
    )


def read_command(body: bytes) -> OscCommand:
    """The reply to `/osc/commands/execute` and `/osc/commands/status`.

    Raises:
        CameraProtocolError: no JSON object, or a state that does not exist.
    """
    value = read_object(body)
    error = _object(value, "error")
    said = _text(value, "state") or ("error" if error else "")
    if said not in ("done", "inProgress", "error"):
        raise CameraProtocolError(f"command in state {said[:40]!r}, wanted done or inProgress")
    completion = _number(_object(value, "progress"), "completion") or 0.0
    return OscCommand(
        _text(value, "name"),
        said,
        _text(value, "id"),
        1.0 if said == "done" else min(max(completion, 0.0), 1.0),
        _object(value, "results"),
        _text(error, "code").strip(),
        _text(error, "message"),
    )


def read_files(results: Mapping[str, Any]) -> tuple[OscFile, ...]:
    """Results of `camera.listFiles`; entries without a name are left out."""
    files: list[OscFile] = []
    for entry in _list(results, "entries")[:MAX_FILES]:
        if not isinstance(entry, dict):
            continue
        item = cast(dict[str, Any], entry)
        name = _text(item, "name")
        if name:
            files.append(
                OscFile(
                    name,
                    _text(item, "fileUrl"),
                    _size(item, "size"),
                    _text(item, "dateTimeZone"),
                    _size(item, "width"),
                    _size(item, "height"),
                )
            )
    return tuple(files)


def read_urls(results: Mapping[str, Any]) -> tuple[str, ...]:
    """Read the addresses of the pictures or videos that a command made."""
    urls = [item for item in _list(results, "fileUrls") if isinstance(item, str)]
    if not urls:
        urls = [item for item in _list(results, "_fileGroup") if isinstance(item, str)]
    single = _text(results, "fileUrl")
    return tuple(urls) or ((single,) if single else ())


def _text(value: Mapping[str, Any], key: str) -> str:
    found = value.get(key)
    return found if isinstance(found, str) else ""


def _number(value: Mapping[str, Any], key: str) -> float | None:
    """A finite number."""
    found = value.get(key)
    if isinstance(found, bool) or not isinstance(found, int | float):
        return None
    try:
        number = float(found)
    except OverflowError:
        return None
    return number if abs(number) < float("inf") else None


def _size(value: Mapping[str, Any], key: str) -> int:
    return max(0, int(_number(value, key) or 0))


def _list(value: Mapping[str, Any], key: str) -> list[Any]:
    found = value.get(key)
    return cast(list[Any], found) if isinstance(found, list) else []


def _object(value: Mapping[str, Any], key: str) -> dict[str, Any]:
    found = value.get(key)
    return cast(dict[str, Any], found) if isinstance(found, dict) else {}
