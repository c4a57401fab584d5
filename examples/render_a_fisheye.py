"""Draw a room through a 200° fisheye lens and mark the objects in its picture.

    .venv/bin/python examples/render_a_fisheye.py lab --out fisheye.png

Every camera model has `project` and `unproject`; a renderer takes any of them. The marks are the
objects' centres, projected: a camera is a function from points in its frame (x right, y down,
z forward, metres) to pixels.
"""

import argparse
import math
from pathlib import Path

import cv2
import numpy as np

from scenes.cameras import Fisheye
from scenes.opening import open_scene
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", nargs="?", default="lab")
    parser.add_argument("--out", type=Path, required=True, metavar="PICTURE.png")
    parser.add_argument("--size", type=int, default=960, help="side of the picture, px")
    args = parser.parse_args()

    scene = open_scene(args.scene)
    lens = Fisheye.from_fov(args.size, math.radians(200.0))
    world_from_lens = scene.world_from_rig  # a rig's axes are those of its front lens
    drawn = NativeRenderer().render(
        [
            PosedSplats(scene.room, Pose.identity()),
            *(PosedSplats(item.splats, item.world_from_object) for item in scene.objects),
        ],
        lens,
        world_from_lens,
    )
    picture = np.clip(255 * drawn.rgb[..., ::-1] + 0.5, 0, 255).astype(np.uint8)

    for item in scene.objects:
        centre_in_object, _ = item.sphere()
        centre_in_lens = world_from_lens.inverse() @ (item.world_from_object @ centre_in_object)
        pixels, valid = lens.project(centre_in_lens)
        range_m = float(np.linalg.norm(centre_in_lens))
        print(f"{item.object_id:10} {range_m:.2f} m away, {'seen' if valid[0] else 'not seen'}")
        if valid[0]:
            at = tuple(int(v) for v in pixels[0])
            cv2.drawMarker(picture, at, (64, 255, 64), cv2.MARKER_CROSS, 14, 2)
            cv2.putText(picture, item.object_id, (at[0] + 9, at[1] - 6), 0, 0.45, (64, 255, 64), 1)
    cv2.imwrite(str(args.out), picture)


if __name__ == "__main__":
    main()
