"""The process that draws and codes: takes a scene, then a picture at a time, and writes its bytes.

What arrives on standard input comes from this program on this machine; nothing from elsewhere is
ever unpickled. It ends at the end of its standard input.
"""

from __future__ import annotations

import os
import pickle
import struct
import sys
import time
from io import BufferedIOBase

import numpy as np
from numpy.typing import NDArray

from devices.hololens.wire.personal_video import VideoRequest
from scenes.workers.pipes import widen
from sim.hololens.drawing.encoder import Encoder, encoder_for
from sim.hololens.drawing.scenery import DrawnScene, Painter, Shot
from sim.hololens.drawing.time_code import burn

HEAD = struct.Struct("<IQ")
"""Before a picture: its bytes, and for how long it was drawn and coded, nanoseconds."""

NICENESS = 10
"""How much less urgent than a session on the same machine: it stands for another one, and draws
with what is left. On two cores that share all of it seven sessions of 30 to 60 s tracked 46 to 114
pictures with 0, four 72 to 156 with 10."""


def serve(orders: BufferedIOBase, pictures: BufferedIOBase) -> None:
    """Draw until there is an end of orders."""
    scene = pickle.load(orders)
    if not isinstance(scene, DrawnScene):
        raise TypeError(f"drawing: {type(scene).__name__}, wanted a scene first")
    encoder: Encoder | None = None
    easel = _Easel(scene)
    try:
        while True:
            try:
                order = pickle.load(orders)
            except EOFError:
                return
            if order is None or isinstance(order, VideoRequest):
                encoder = None if order is None else encoder_for(order)
                continue
            if not isinstance(order, Shot):
                raise TypeError(f"drawing: {type(order).__name__}, wanted a shot")
            began_ns = time.perf_counter_ns()
            picture = easel.draw(order)
            data = picture.data if encoder is None else encoder.encode(picture)
            took_ns = time.perf_counter_ns() - began_ns
            pictures.write(HEAD.pack(memoryview(data).nbytes, took_ns))
            pictures.write(data)
            pictures.flush()
    finally:
        easel.close()


class _Easel:
    """A painter of the size that is wanted."""

    def __init__(self, scene: DrawnScene) -> None:
        self._scene = scene
        self._painter: Painter | None = None
        self._size = (0, 0)

    def draw(self, shot: Shot) -> NDArray[np.uint8]:
        """Return a picture, (H, W, 3) uint8 RGB, with its time where one is to be burnt in."""
        wanted = shot.camera.width_px, shot.camera.height_px
        if self._painter is None or self._size != wanted:
            self.close()
            self._painter = Painter(self._scene, wanted[0], height_px=wanted[1])
            self._size = wanted
        drawn = self._painter.draw(shot.camera, shot.room_from_camera, poses=shot.poses)
        picture = np.ascontiguousarray(drawn)
        if shot.burnt_us is not None:
            burn(picture, shot.burnt_us)
        return picture

    def close(self) -> None:
        """Free what it holds on the graphics device."""
        if self._painter is not None:
            self._painter.close()
            self._painter = None


if __name__ == "__main__":
    # Whatever prints to standard output shall not get among the pictures.
    out = sys.stdout.buffer
    sys.stdout = sys.stderr
    widen(out.fileno())
    if hasattr(os, "nice"):
        os.nice(NICENESS)
    serve(sys.stdin.buffer, out)  # type: ignore[arg-type]
