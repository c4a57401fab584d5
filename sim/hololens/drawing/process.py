"""The process that draws: is told a scene, then a picture at a time, and writes its pixels.

What arrives on standard input comes from this program on this machine; nothing from elsewhere is
ever unpickled. It ends at the end of its standard input.
"""

from __future__ import annotations

import pickle
import sys
from io import BufferedIOBase

import numpy as np

from scenes.workers.pipes import widen
from sim.hololens.drawing.scenery import DrawnScene, Painter, Shot


def serve(orders: BufferedIOBase, pictures: BufferedIOBase) -> None:
    """Draw until there is an end of orders."""
    scene = pickle.load(orders)
    if not isinstance(scene, DrawnScene):
        raise TypeError(f"drawing: {type(scene).__name__}, wanted a scene first")
    painter: Painter | None = None
    size = (0, 0)
    try:
        while True:
            try:
                shot = pickle.load(orders)
            except EOFError:
                return
            if not isinstance(shot, Shot):
                raise TypeError(f"drawing: {type(shot).__name__}, wanted a shot")
            wanted = shot.camera.width_px, shot.camera.height_px
            if painter is None or size != wanted:
                if painter is not None:
                    painter.close()
                painter, size = Painter(scene, wanted[0], height_px=wanted[1]), wanted
            picture = painter.draw(shot.camera, shot.room_from_camera, poses=shot.poses)
            pictures.write(np.ascontiguousarray(picture).data)
            pictures.flush()
    finally:
        if painter is not None:
            painter.close()


if __name__ == "__main__":
    # Whatever prints to standard output shall not get among the pictures.
    out = sys.stdout.buffer
    sys.stdout = sys.stderr
    widen(out.fileno())
    serve(sys.stdin.buffer, out)  # type: ignore[arg-type]
