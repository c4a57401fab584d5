"""Photos of printed symbols whose corners are known, and reconstructions that saw them."""

from pathlib import Path

import cv2
import numpy as np

from scenes.cameras import Pinhole
from scenes.frames import WORLD_FROM_BOARD_FACING_X, look_at
from scenes.pose import Pose, rotation_from_vector
from scenes.prepare.align.codes.anchors import AnchorSightings, Sighting
from scenes.prepare.align.codes.symbols import qr_symbol
from scenes.prepare.align.codes.triangulate import predicted_corners
from scenes.prepare.align.similarity import Similarity
from scenes.prepare.reconstruction import Reconstruction, View

SIDE_M = 0.2
FINE = 4


def photo_of(symbol, corners_px, rng, *, size=(320, 240), blur_px=0.8, noise=3.0, jpeg=92):
    """(H, W) uint8: the symbol on a mottled wall in uneven light, as a camera would give it."""
    w, h = size
    m, q, fine = symbol.modules, symbol.quiet_modules, 12
    drawn = symbol.picture(module_px=fine, light=1).astype(np.float32)
    printed = fine * np.array([[q, q], [q + m, q], [q + m, q + m], [q, q + m]], dtype=float)
    warp = cv2.getPerspectiveTransform(
        (printed - 0.5).astype(np.float32), (corners_px * FINE - 0.5).astype(np.float32)
    )
    big = (w * FINE, h * FINE)
    card = cv2.warpPerspective(0.05 + 0.75 * drawn, warp, big, flags=cv2.INTER_AREA)
    there = cv2.warpPerspective(np.ones_like(drawn), warp, big)
    wall = rng.uniform(0.2, 0.7, (h // 16, w // 16)).astype(np.float32)
    wall = cv2.resize(wall, big, interpolation=cv2.INTER_CUBIC)
    light = (wall * (1 - there) + card * there) * np.linspace(0.8, 1.1, big[0], dtype=np.float32)
    light = cv2.resize(cv2.GaussianBlur(light, (0, 0), blur_px * FINE), size,
                       interpolation=cv2.INTER_AREA)  # fmt: skip
    light = np.clip(light, 0, 1)
    code = np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    grey = np.clip(255 * code + rng.normal(0, noise, code.shape) + 0.5, 0, 255).astype(np.uint8)
    return cv2.imdecode(cv2.imencode(".jpg", grey, [cv2.IMWRITE_JPEG_QUALITY, jpeg])[1], 0)


def tilted_corners(side_px, tilt_deg, rng, *, size=(320, 240)):
    """(4, 2) px of a square seen at an angle, roughly in the middle."""
    f = 800.0
    about = rng.uniform(0, 2 * np.pi)
    turn = rotation_from_vector(np.radians(tilt_deg) * np.array([np.cos(about), np.sin(about), 0]))
    turn = turn @ rotation_from_vector([0, 0, rng.uniform(-0.4, 0.4)])
    square = 0.1 * np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    p = square @ turn.T + [0, 0, f * 0.2 / side_px]
    return f * p[:, :2] / p[:, 2:] + np.array(size) / 2 + rng.uniform(-9, 9, 2)


def wall_codes(count):
    """World poses of codes on three walls of a 6 × 5 m room, by payload."""
    walls = ((-90, (0.2, 2.5, 1.5)), (180, (3.0, -1.2, 1.45)), (90, (-0.75, -2.5, 1.5)))
    return {
        f"code:{k}": Pose.from_yaw(np.radians(yaw), at) @ WORLD_FROM_BOARD_FACING_X
        for k, (yaw, at) in enumerate(walls[:count])
    }


def capture(
    rng, *, codes, frames=48, corner_px=0.05, feature_px=0.5, sides_m=None, moved=None, unread=()
):
    """A reconstruction in a frame of its own, what it saw, and the truth.

    Its photos' poses are as far off as 150 features with `feature_px` of noise leave them.

    Args:
        rng: for noise and for the reconstruction's frame.
        codes: world poses by payload.
        frames: photos on a walk around the room.
        corner_px: noise of corners.
        feature_px: noise of features.
        sides_m: true sides that are not `SIDE_M`.
        moved: (payload, first photo, new pose): a code that is moved meanwhile.
        unread: payloads that are never seen.

    Returns:
        reconstruction, sightings, world_from_reconstruction.
    """
    camera = Pinhole.from_fov(960, 720, np.radians(68))
    truth = Similarity(
        np.exp(rng.normal(0, 0.5)), rotation_from_vector(rng.normal(size=3)), rng.normal(size=3)
    )
    features = rng.uniform([-3, -2.5, 0], [3, 2.5, 2.7], (900, 3))
    nearest = np.abs(features - [0, 0, 1.35]) / [3, 2.5, 1.35]
    wall = np.argmax(nearest, axis=1)
    features[np.arange(900), wall] = (
        np.array([0, 0, 1.35])[wall]
        + np.array([3, 2.5, 1.35])[wall] * np.sign(features - [0, 0, 1.35])[np.arange(900), wall]
    )
    views, seen = [], {payload: [] for payload in codes}
    for k in range(frames):
        a = 4 * np.pi * k / frames
        eye = np.array([1.2 * np.cos(a), np.sin(a), 1.5 + 0.25 * np.sin(3.1 * a)])
        eye[:2] *= 1 + 0.4 * np.sin(a / 2 + 1)
        b = a + 0.9 * np.sin(2.3 * a)
        world_from_camera = look_at(eye, np.array([2.8 * np.cos(b), 2.4 * np.sin(b), 1.3]))
        view = View(f"{k:03}.jpg", Path(f"{k:03}.jpg"), camera, world_from_camera)
        for payload, pose in codes.items():
            there = moved[2] if moved and moved[0] == payload and k >= moved[1] else pose
            side = (sides_m or {}).get(payload, SIDE_M)
            corners = predicted_corners(Similarity.from_pose(there, side), view)
            if corners is not None and np.linalg.norm(corners[0] - corners[2]) > 34:
                noisy = corners + rng.normal(0, corner_px, (4, 2))
                sigma = np.full(4, max(corner_px, 0.02))
                seen[payload].append(Sighting(view.name, noisy, sigma, True))
        near = _resected(camera, world_from_camera, features, feature_px, rng)
        views.append(View(view.name, view.image, camera, truth.inverse().moved(near)))
    reconstruction = Reconstruction(
        tuple(views),
        truth.inverse() @ (features + rng.normal(0, 0.003, features.shape)),
        np.zeros((900, 3), np.uint8),
        np.full(900, feature_px, np.float32),
    )
    symbol = qr_symbol("code:0")
    sightings = tuple(
        AnchorSightings(p, symbol, tuple(s)) for p, s in seen.items() if s and p not in unread
    )
    return reconstruction, sightings, truth


def _resected(camera, world_from_camera, features, feature_px, rng):
    """A pose off by what so noisy features leave uncertain."""
    p = world_from_camera.inverse() @ features
    p = p[camera.project(p)[1]][:150]
    f, z = camera.fx, p[:, 2]
    slopes = np.zeros((len(p), 2, 3))
    slopes[:, 0, 0] = slopes[:, 1, 1] = f / z
    slopes[:, :, 2] = -f * p[:, :2] / z[:, None] ** 2
    turns = np.cross(np.eye(3)[None], p[:, None], axis=2)
    by_turn = np.einsum("nij,nkj->nik", slopes, turns)
    rows = np.concatenate([by_turn, slopes], axis=2).reshape(-1, 6)
    off = rng.multivariate_normal(np.zeros(6), feature_px**2 * np.linalg.inv(rows.T @ rows))
    turn = Pose(rotation_from_vector(off[:3]), off[3:])
    return (turn @ world_from_camera.inverse()).inverse()
