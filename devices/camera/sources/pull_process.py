"""The process that reads one camera by FFmpeg and sends its units to the studio.

It runs with one socket as standard input: the address comes in one line, messages of
`unit_line.py` go back. It leaves when that socket closes, whatever FFmpeg waits for.
"""

from __future__ import annotations

import resource
import socket

from devices.camera.address import CameraAddress, address_from_json
from devices.camera.container_units import ContainerUnits
from devices.camera.sources.unit_line import (
    Failed,
    LineError,
    encode_failed,
    encode_format,
    encode_opened,
    encode_unit,
)
from devices.camera.units import SourceError, StreamFormat
from scenes.workers.parent import end_with_parent

MAX_MEMORY_BYTES = 2 << 30
"""Address space that the process may take, bytes: what a hostile stream can cost. Reading 8K raw
pictures takes 0.6 GB of it, most of it for libraries."""

MAX_ADDRESS_BYTES = 4096
"""Longest address that is read."""


def main() -> None:
    """Read the camera until it ends or the studio hangs up."""
    line = socket.socket(fileno=0)
    resource.setrlimit(resource.RLIMIT_AS, (MAX_MEMORY_BYTES, MAX_MEMORY_BYTES))
    address = address_from_json(_first_line(line))
    end_with_parent(lambda: line.recv(4096), code=0)
    try:
        failed = _send_units(address, line)
    except OSError:
        return  # the studio hung up
    line.sendall(encode_failed(failed))


def _send_units(address: CameraAddress, line: socket.socket) -> Failed:
    """Send every unit; why it ended."""
    try:
        units = ContainerUnits(address)
    except SourceError as error:
        return Failed(str(error), error.is_final)
    line.sendall(encode_opened())
    form: StreamFormat | None = None
    try:
        for unit in units:
            if unit.format is not form:
                form = unit.format
                line.sendall(encode_format(form))
            line.sendall(encode_unit(unit))
    except SourceError as error:
        return Failed(str(error), error.is_final)
    except (MemoryError, LineError) as error:
        return Failed(f"{address.shown}: no room for it ({error})", is_final=False)
    return Failed(f"{address.shown}: the stream ended", is_final=False)


def _first_line(line: socket.socket) -> str:
    data = b""
    while not data.endswith(b"\n") and len(data) < MAX_ADDRESS_BYTES:
        more = line.recv(1)
        if not more:
            break
        data += more
    return data.decode().rstrip("\n")


if __name__ == "__main__":
    main()
