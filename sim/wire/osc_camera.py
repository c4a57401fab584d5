"""A simulated Insta360 camera over HTTP: options, pictures, recordings, files.

Requests in, replies out; no socket, no thread. Values and errors are those of the vendor's page of
its Open Spherical Camera interface.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, cast

from devices.clock import Clock
from devices.insta360.commands import CameraInfo

FOLDER = "/DCIM/Camera01/"
"""Folder of the camera's files."""

MAX_FILES = 256
"""Files on the simulated card; the oldest goes when another one is made."""

MAX_COMMANDS = 16
"""Commands in progress that are remembered."""

_READ_ONLY = frozenset({"_sysTimestamp", "_batteryCapacity", "remainingSpace", "totalSpace"})


class _RefusedError(ValueError):
    """The camera's error: its code, and words."""

    def __init__(self, code: str, words: str) -> None:
        super().__init__(words)
        self.code = code


@dataclass(slots=True)
class _Picture:
    """A picture that is being taken."""

    ready_ns: int
    begun_ns: int
    name: str


@dataclass(slots=True)
class OscCamera:
    """A camera's state; one request at a time.

    Attributes:
        clock: session time: how long pictures take, and the camera's own clock.
        info: what it says of itself.
        picture: contents of every picture, JPEG.
        picture_s: how long a picture takes.
        has_card: without one, pictures are refused.
    """

    clock: Clock
    info: CameraInfo
    picture: bytes = b""
    picture_s: float = 1.0
    has_card: bool = True
    _options: dict[str, Any] = field(default_factory=lambda: _first_options())
    _files: dict[str, bytes] = field(default_factory=lambda: cast(dict[str, bytes], {}))
    _taking: dict[str, _Picture] = field(default_factory=lambda: cast(dict[str, _Picture], {}))
    _recording: str = ""
    _count: int = 0

    def answer(self, path: str, value: dict[str, Any], base_url: str) -> tuple[int, dict[str, Any]]:
        """HTTP status and JSON of a reply.

        Args:
            path: such as "/osc/state".
            value: JSON of the request.
            base_url: "http://HOST:PORT", for the URLs of files.
        """
        if path == "/osc/info":
            return 200, self._info()
        if path == "/osc/state":
            return 200, self._state(base_url)
        if path not in ("/osc/commands/execute", "/osc/commands/status"):
            return 404, {"error": {"code": "unknownPath", "message": path[:100]}}
        name = value.get("name") if path.endswith("execute") else "camera.takePicture"
        try:
            if path.endswith("status"):
                return 200, self._status(value.get("id"), base_url)
            parameters = value.get("parameters")
            given = cast(dict[str, Any], parameters) if isinstance(parameters, dict) else {}
            return 200, self._execute(name, given, base_url)
        except _RefusedError as error:
            reply = {"code": error.code, "message": str(error)}
            return 400, {"name": name, "state": "error", "error": reply}

    def file(self, path: str) -> bytes | None:
        """Contents of a file by its path; None if there is none."""
        return self._files.get(path.removeprefix(FOLDER)) if path.startswith(FOLDER) else None

    def _info(self) -> dict[str, Any]:
        return {
            "manufacturer": "Arashi Vision",
            "model": self.info.camera_type,
            "serialNumber": self.info.serial,
            "firmwareVersion": self.info.firmware,
            "supportUrl": "",
            "gps": False,
            "gyro": True,
            "uptime": self.clock.now_ns() // 1_000_000_000,
            "api": ["/osc/info", "/osc/state", "/osc/commands/execute", "/osc/commands/status"],
            "apiLevel": [2],
        }

    def _state(self, base_url: str) -> dict[str, Any]:
        state = {
            "_cardState": "pass" if self.has_card else "noCard",
            "batteryLevel": 1.0 if self.info.battery is None else self.info.battery,
            "storageUri": base_url + FOLDER,
        }
        return {"fingerprint": f"FPR_{self._count}", "state": state}

    def _execute(self, name: object, given: dict[str, Any], base_url: str) -> dict[str, Any]:
        match name:
            case "camera.getOptions":
                return _done(name, {"options": self._asked(given.get("optionNames"))})
            case "camera.setOptions":
                self._set(given.get("options"))
                return _done(name)
            case "camera.takePicture":
                return self._take_picture()
            case "camera.startCapture":
                self._start()
                return _done(name)
            case "camera.stopCapture":
                return _done(name, self._stop(base_url))
            case "camera.listFiles":
                return _done(name, self._list(given, base_url))
            case _:
                raise _RefusedError("unknownCommand", f"{str(name)[:60]} is not supported.")

    def _asked(self, names: object) -> dict[str, Any]:
        if not isinstance(names, list):
            raise _RefusedError("missingParameter", "optionNames is missing.")
        now = {"_sysTimestamp": self.clock.now_ns() // 1000}
        known = self._options | now
        wanted = [str(name) for name in cast(list[object], names)[:100]]
        missing = [name for name in wanted if name not in known]
        if missing:
            raise _RefusedError("invalidParameterName", f"{missing[0][:60]} is not supported.")
        return {name: known[name] for name in wanted}

    def _set(self, options: object) -> None:
        if not isinstance(options, dict):
            raise _RefusedError("missingParameter", "options is missing.")
        new = cast(dict[str, Any], options)
        for name in new:
            if name not in self._options or name in _READ_ONLY:
                raise _RefusedError("invalidParameterName", f"unsupported option {name[:60]}.")
        if new.get("captureMode", "image") not in ("image", "video"):
            raise _RefusedError("invalidParameterValue", "captureMode is image or video.")
        self._options |= new
        self._count += 1

    def _take_picture(self) -> dict[str, Any]:
        if self._options["captureMode"] != "image":
            raise _RefusedError("disabledCommand", "Currently camera is not working in image mode")
        if not self.has_card:
            raise _RefusedError("disabledCommand", "no card")
        if len(self._taking) >= MAX_COMMANDS:
            self._taking.pop(next(iter(self._taking)))
        self._count += 1
        now_ns = self.clock.now_ns()
        command_id = f"{self._count:06d}"
        name = f"IMG_20260101_000000_00_{self._count:03d}.insp"
        self._taking[command_id] = _Picture(now_ns + round(1e9 * self.picture_s), now_ns, name)
        return _in_progress(command_id, 0.0)

    def _status(self, command_id: object, base_url: str) -> dict[str, Any]:
        picture = self._taking.get(command_id) if isinstance(command_id, str) else None
        if picture is None or not isinstance(command_id, str):
            raise _RefusedError("invalidParameterValue", "there is no command of that id.")
        now_ns = self.clock.now_ns()
        if now_ns < picture.ready_ns:
            whole_ns = picture.ready_ns - picture.begun_ns
            return _in_progress(command_id, (now_ns - picture.begun_ns) / whole_ns)
        del self._taking[command_id]
        self._store(picture.name, self.picture)
        url = base_url + FOLDER + picture.name
        results = {"fileUrl": url, "_fileGroup": [url], "_localFileGroup": [FOLDER + picture.name]}
        return _done("camera.takePicture", results)

    def _start(self) -> None:
        if self._options["captureMode"] != "video" or self._recording or not self.has_card:
            raise _RefusedError("disabledCommand", "not in video mode, recording, or no card")
        self._count += 1
        self._recording = f"VID_20260101_000000_00_{self._count:03d}.insv"

    def _stop(self, base_url: str) -> dict[str, Any]:
        if not self._recording:
            raise _RefusedError("disabledCommand", "not recording")
        name, self._recording = self._recording, ""
        self._store(name, b"")
        return {"fileUrls": [base_url + FOLDER + name], "_localFileUrls": [FOLDER + name]}

    def _store(self, name: str, data: bytes) -> None:
        while len(self._files) >= MAX_FILES:
            self._files.pop(next(iter(self._files)))
        self._files[name] = data

    def _list(self, given: dict[str, Any], base_url: str) -> dict[str, Any]:
        kind, most = given.get("fileType"), given.get("entryCount")
        if kind not in ("image", "video", "all") or type(most) is not int or most < 1:
            raise _RefusedError("invalidParameterValue", "fileType or entryCount.")
        prefix = {"image": "IMG", "video": "VID", "all": ""}[kind]
        names = [name for name in reversed(self._files) if name.startswith(prefix)]
        entries = [
            {
                "name": name,
                "fileUrl": base_url + FOLDER + name,
                "_localFileUrl": FOLDER + name,
                "size": len(self._files[name]),
                "dateTimeZone": "2026:01:01 00:00:00+00:00",
                "isProcessed": True,
                "previewUrl": "",
            }
            for name in names[:most]
        ]
        return {"entries": entries, "totalEntries": len(names)}


def _first_options() -> dict[str, Any]:
    return {
        "captureMode": "image",
        "captureModeSupport": ["image", "video"],
        "hdr": "off",
        "hdrSupport": ["off", "hdr"],
        "iso": 100,
        "exposureProgram": 2,
        "whiteBalance": "auto",
        "photoStitching": "none",
        "photoStitchingSupport": ["none"],
        "remainingSpace": 64_000_000_000,
        "totalSpace": 128_000_000_000,
        "_dateTime": "2026:01:01 00:00:00",
        "_batteryCapacity": {"powerType": 0, "powerLevel": 100},
    }


def _done(name: object, results: dict[str, Any] | None = None) -> dict[str, Any]:
    reply: dict[str, Any] = {"name": name, "state": "done"}
    return reply | ({"results": results} if results is not None else {})


def _in_progress(command_id: str, completion: float) -> dict[str, Any]:
    return {
        "name": "camera.takePicture",
        "state": "inProgress",
        "id": command_id,
        "progress": {"completion": completion},
    }
