"""Open a scene, list its movable objects and draw its plan.

    .venv/bin/python examples/open_a_scene.py lab --out plan.png

The scene is a built-in room ("lab", "desk"), a package that `./nexus prepare` wrote, or a splat
file. The plan shows the room from straight above, its ceiling left out, north (+y) up.
"""

import argparse
import math
from pathlib import Path

import cv2
import numpy as np

from scenes.cameras import Pinhole
from scenes.opening import open_scene
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats

CEILING_M = 2.0
EYE_M = 12.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", nargs="?", default="lab")
    parser.add_argument("--out", type=Path, required=True, metavar="PICTURE.png")
    parser.add_argument("--size", type=int, default=720, help="width of the picture, px")
    args = parser.parse_args()

    scene = open_scene(args.scene)
    print(f"{scene.name}: {len(scene.room):,} splats, made by {len(scene.stages)} stages")
    for item in scene.objects:
        size_cm = " × ".join(f"{100 * side:.0f}" for side in item.box_m)
        x, y, z = item.world_from_object.translation
        yaw_deg = math.degrees(item.world_from_object.yaw())
        print(f"{item.object_id:10} {size_cm} cm at ({x:.2f}, {y:.2f}, {z:.2f}) m, {yaw_deg:.0f}°")

    low, high = scene.footprint_m
    width, height = args.size, round(args.size * (high - low)[1] / (high - low)[0])
    focal_px = 0.95 * EYE_M * width / (high - low)[0]
    camera = Pinhole(width, height, focal_px, focal_px, 0.5 * width, 0.5 * height)
    # OpenCV axes of a camera that looks down: x right stays, y (down in the picture) is −y.
    middle = 0.5 * (low + high)
    world_from_camera = Pose(np.diag([1.0, -1.0, -1.0]), np.array([*middle, EYE_M]))
    below_ceiling = scene.room.select(scene.room.means[:, 2] < CEILING_M)
    drawn = NativeRenderer().render(
        [
            PosedSplats(below_ceiling, Pose.identity()),
            *(PosedSplats(item.splats, item.world_from_object) for item in scene.objects),
        ],
        camera,
        world_from_camera,
    )
    rgb = np.clip(255 * drawn.rgb + 0.5, 0, 255).astype(np.uint8)
    cv2.imwrite(str(args.out), rgb[..., ::-1])


if __name__ == "__main__":
    main()
