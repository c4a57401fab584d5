# pyright: standard
"""Pictures and lights on walls: posters, writing, screens, the view out of the window."""

from __future__ import annotations

import math

import cv2
import numpy as np
from PIL import Image, ImageDraw

from scenes.samples.pictures.graphics import font
from scenes.samples.pictures.textures import FloatArray, Rgb, noise, tinted
from scenes.samples.shapes import Picture

SUPERSAMPLE = 2
"""Pictures are drawn larger and averaged down, so that edges are smooth."""


def landscape(rng: np.random.Generator, width_px: int, height_px: int) -> Picture:
    """A poster of hills at dusk behind one another, with a margin and a title."""
    w, h = width_px * SUPERSAMPLE, height_px * SUPERSAMPLE
    rows = np.linspace(0, 1, h, dtype=np.float32)[:, None, None]
    top, low = np.array([42.0, 74.0, 118.0]), np.array([250.0, 190.0, 130.0])
    image = Image.fromarray(
        np.broadcast_to(top + (low - top) * rows**0.8, (h, w, 3)).astype(np.uint8)
    )
    draw = ImageDraw.Draw(image)
    sun = (0.66 * w, 0.36 * h, 0.11 * w)
    draw.ellipse(_round(*sun), fill=(255, 236, 190))
    shades = [(206, 142, 120), (150, 104, 116), (96, 78, 104), (52, 56, 82), (26, 36, 54)]
    for k, shade in enumerate(shades):
        line = h * (0.46 + 0.1 * k) + 0.05 * h * noise(rng, (1, w), cell_px=(1, w / (4 + 2 * k)))[0]
        draw.polygon([(0, h), *((x, float(y)) for x, y in enumerate(line)), (w, h)], fill=shade)
    margin = round(0.045 * w)
    for k in range(margin):
        draw.rectangle((k, k, w - 1 - k, h - 1 - k), outline=(244, 240, 230))
    draw.text(
        (w / 2, h - 2.6 * margin), "FAR AND NEAR", font=font(min(w, h) // 14, bold=True),
        fill=(244, 236, 220), anchor="mm",
    )  # fmt: skip
    return _average(image, width_px, height_px)


def shapes_poster(rng: np.random.Generator, width_px: int, height_px: int) -> Picture:
    """A poster of quarter discs and bars on a grid, in five colours."""
    w, h = width_px * SUPERSAMPLE, height_px * SUPERSAMPLE
    paper: Rgb = (240, 232, 214)
    palette = [(206, 72, 52), (36, 72, 110), (236, 178, 58), (48, 128, 112), (34, 36, 42)]
    image = Image.new("RGB", (w, h), paper)
    draw = ImageDraw.Draw(image)
    n = 4
    cell = w * 0.84 / n
    rows = int(h * 0.86 / cell)
    for row in range(rows):
        for column in range(n):
            x, y = 0.08 * w + column * cell, 0.06 * h + row * cell
            colour, other = (palette[i] for i in rng.permutation(len(palette))[:2])
            kind = int(rng.integers(4))
            if kind == 0:
                corner = (x + cell * int(rng.integers(2)), y + cell * int(rng.integers(2)))
                tile = Image.new("RGB", (math.ceil(cell), math.ceil(cell)), other)
                ImageDraw.Draw(tile).ellipse(
                    _round(corner[0] - x, corner[1] - y, cell), fill=colour
                )
                image.paste(tile, (round(x), round(y)))
            elif kind == 1:
                draw.ellipse(_round(x + cell / 2, y + cell / 2, cell / 2.1), fill=colour)
                draw.ellipse(_round(x + cell / 2, y + cell / 2, cell / 4.5), fill=paper)
            elif kind == 2:
                for k in range(4):
                    draw.rectangle(
                        (x, y + k * cell / 4, x + cell, y + (k + 0.55) * cell / 4), fill=colour
                    )
            else:
                draw.polygon([(x, y + cell), (x + cell, y + cell), (x + cell, y)], fill=colour)
    return _average(image, width_px, height_px)


def title_poster(rng: np.random.Generator, width_px: int, height_px: int) -> Picture:
    """A poster with large type over concentric arcs."""
    w, h = width_px * SUPERSAMPLE, height_px * SUPERSAMPLE
    image = Image.new("RGB", (w, h), (24, 44, 58))
    draw = ImageDraw.Draw(image)
    for k in range(9, 0, -1):
        shade = (230 - 16 * k, 150 - 8 * k + int(rng.integers(0, 8)), 70 + 9 * k)
        draw.ellipse(_round(0.5 * w, 0.98 * h, 0.075 * w * k), fill=shade)
    ink = (240, 232, 214)
    draw.text((0.08 * w, 0.05 * h), "HERE", font=font(w // 5, bold=True), fill=ink)
    draw.text((0.08 * w, 0.19 * h), "& THERE", font=font(w // 6, bold=True), fill=(236, 178, 58))
    draw.text((0.08 * w, 0.33 * h), "an evening on shared space", font=font(w // 20), fill=ink)
    draw.text((0.08 * w, 0.37 * h), "room 2.14 · thursdays", font=font(w // 20), fill=ink)
    return _average(image, width_px, height_px)


def whiteboard(rng: np.random.Generator, width_px: int, height_px: int) -> Picture:
    """A used whiteboard: a heading, a floor plan, a list, arrows, and the haze of wiped words."""
    w, h = width_px * SUPERSAMPLE, height_px * SUPERSAMPLE
    haze = 0.012 * noise(rng, (h, w), cell_px=(60, 140))
    image = Image.fromarray(tinted((244, 246, 246), haze - np.abs(haze)))
    draw = ImageDraw.Draw(image)
    blue, red, green, black = (32, 70, 160), (190, 44, 40), (30, 120, 70), (40, 42, 48)
    pen = max(3, w // 260)
    draw.text((0.05 * w, 0.06 * h), "Room plan", font=font(h // 10), fill=black)
    draw.line((0.05 * w, 0.19 * h, 0.34 * w, 0.185 * h), fill=red, width=pen)
    plan = (0.06 * w, 0.30 * h, 0.46 * w, 0.88 * h)
    _sketch(draw, rng, plan, blue, pen)
    _sketch(draw, rng, (0.36 * w, 0.42 * h, 0.445 * w, 0.70 * h), blue, pen)
    draw.text((0.368 * w, 0.53 * h), "desk", font=font(h // 24), fill=blue)
    for x, y in ((0.17, 0.45), (0.28, 0.60)):
        _sketch(draw, rng, (x * w, y * h, (x + 0.045) * w, (y + 0.07) * h), green, pen)
    for x, y in ((0.13, 0.70), (0.24, 0.76)):
        draw.ellipse(_round(x * w, y * h, 0.02 * w), outline=red, width=pen)
    draw.line((0.19 * w, 0.54 * h, 0.25 * w, 0.70 * h), fill=black, width=pen)
    draw.polygon([(0.25 * w, 0.70 * h), (0.238 * w, 0.685 * h), (0.253 * w, 0.67 * h)], fill=black)
    for k, line in enumerate(("move chair to window", "two stools → corner", "book: other end",
                              "check the view", "call at 3 pm")):  # fmt: skip
        y = (0.25 + 0.105 * k) * h + float(rng.normal(0, 0.004)) * h
        draw.rectangle((0.54 * w, y + 0.012 * h, 0.556 * w, y + 0.043 * h), outline=red, width=pen)
        draw.text((0.575 * w, y), line, font=font(h // 19), fill=blue if k % 2 else black)
    curve = [(0.56 * w + 0.36 * w * t, h * (0.90 - 0.10 * t - 0.02 * math.sin(14 * t)))
             for t in np.linspace(0, 1, 60)]  # fmt: skip
    draw.line(curve, fill=green, width=pen)
    draw.line([(0.56 * w, 0.77 * h), (0.56 * w, 0.92 * h), (0.93 * w, 0.92 * h)], fill=black,
              width=pen)  # fmt: skip
    return _average(image, width_px, height_px)


def call_screen(width_px: int, height_px: int) -> Picture:
    """A wall screen showing a slide."""
    w, h = width_px * SUPERSAMPLE, height_px * SUPERSAMPLE
    image = Image.new("RGB", (w, h), (20, 34, 52))
    draw = ImageDraw.Draw(image)
    draw.rectangle((0, 0, w, 0.13 * h), fill=(34, 92, 128))
    draw.text((0.04 * w, 0.03 * h), "Spaces we share", font=font(h // 14, bold=True),
              fill=(236, 242, 246))  # fmt: skip
    heights = (0.22, 0.34, 0.30, 0.46, 0.58, 0.52)
    for k, bar in enumerate(heights):
        x = (0.06 + 0.07 * k) * w
        draw.rectangle((x, (0.88 - bar) * h, x + 0.045 * w, 0.88 * h),
                       fill=(240, 176, 70) if k == 4 else (96, 158, 186))  # fmt: skip
    draw.line((0.05 * w, 0.88 * h, 0.5 * w, 0.88 * h), fill=(200, 210, 216), width=4)
    for k, line in enumerate(("what moved", "where it stands", "who can see it")):
        y = (0.26 + 0.14 * k) * h
        draw.ellipse(_round(0.57 * w, y + 0.035 * h, 0.008 * w), fill=(240, 176, 70))
        draw.text((0.59 * w, y), line, font=font(h // 17), fill=(226, 232, 236))
    draw.rounded_rectangle((0.56 * w, 0.66 * h, 0.94 * w, 0.9 * h), 16, fill=(46, 62, 84))
    for x, skin in ((0.66, (214, 170, 140)), (0.83, (150, 108, 84))):
        draw.ellipse(_round(x * w, 0.74 * h, 0.022 * w), fill=skin)
        draw.pieslice(_round(x * w, 0.89 * h, 0.055 * w), 180, 360, fill=(96, 158, 186))
    return _average(image, width_px, height_px)


def editor_screen(rng: np.random.Generator, width_px: int, height_px: int) -> Picture:
    """A desktop monitor with a text editor."""
    image = Image.new("RGB", (width_px, height_px), (30, 34, 42))
    draw = ImageDraw.Draw(image)
    draw.rectangle((0, 0, width_px, height_px // 16), fill=(58, 64, 76))
    draw.rectangle((0, height_px // 16, width_px // 6, height_px), fill=(40, 45, 55))
    palette = [(126, 180, 220), (220, 170, 110), (150, 200, 140), (200, 200, 205)]
    y, step = height_px // 10, height_px // 26
    while y < height_px - step:
        x = width_px // 5 + int(rng.integers(0, 4)) * width_px // 30
        for _ in range(int(rng.integers(1, 6))):
            length = int(rng.integers(width_px // 30, width_px // 8))
            if x + length > width_px * 0.95:
                break
            colour = palette[int(rng.integers(len(palette)))]
            draw.rectangle((x, y, x + length, y + step // 2), fill=colour)
            x += length + width_px // 60
        y += step
    return np.asarray(image)


def window_view(rng: np.random.Generator, width_px: int, height_px: int) -> Picture:
    """A bright, slightly blurred view: sky with clouds, trees, a hedge."""
    h, w = height_px, width_px
    rows = np.linspace(0, 1, h, dtype=np.float32)[:, None]
    cloud = noise(rng, (h, w), cell_px=(60, 150)) + 0.4 * noise(rng, (h, w), cell_px=(24, 50))
    cover = np.clip(0.45 + 0.35 * cloud, 0, 1)[..., None]
    sky = np.array([186, 214, 240], dtype=np.float32) + rows[..., None] * np.array([40, 24, 8])
    image = sky * (1 - cover) + 252 * cover
    for base, rough, colour in (
        (0.60, 0.03, (196, 210, 206)), (0.68, 0.07, (164, 186, 158)), (0.84, 0.04, (136, 164, 124))
    ):  # fmt: skip
        line = (
            base
            + rough * noise(rng, (1, w), cell_px=(1, 70))
            + 0.4 * rough * noise(rng, (1, w), cell_px=(1, 16))
        )
        leaf = 1 + 0.07 * noise(rng, (h, w), cell_px=(10, 12))
        inside = np.clip((rows - line) * h / 8, 0, 1)[..., None]
        image = image * (1 - inside) + inside * leaf[..., None] * np.asarray(colour, np.float32)
    blurred = cv2.GaussianBlur(image.astype(np.float32), (0, 0), 2.6)
    return np.clip(0.88 * blurred + 34, 0, 255).astype(np.uint8)


def rug(rng: np.random.Generator, height_px: int, width_px: int) -> FloatArray:
    """(H, W, 3) colours of a woven rug with borders and a field of diamonds."""
    y, x = np.mgrid[0:height_px, 0:width_px].astype(np.float32)
    inset = np.minimum.reduce([x, y, width_px - 1 - x, height_px - 1 - y]) / height_px
    cream, blue, rust = (
        np.array(c, np.float32) for c in ((214, 204, 184), (74, 96, 122), (176, 104, 78))
    )
    field = np.abs((x / height_px * 7) % 1 - 0.5) + np.abs((y / height_px * 7) % 1 - 0.5)
    picture = np.broadcast_to(cream, (height_px, width_px, 3)).copy()
    picture[(field > 0.42) & (field < 0.5)] = 0.6 * cream + 0.4 * blue
    picture[field < 0.09] = rust
    picture[inset < 0.13] = cream
    picture[inset < 0.11] = blue
    picture[inset < 0.06] = cream * 0.94
    picture[inset < 0.05] = rust
    picture[inset < 0.02] = cream * 0.9
    weave = rng.normal(0, 0.05, (height_px, width_px)) + 0.03 * noise(
        rng, (height_px, width_px), cell_px=(1.5, 30)
    )
    return np.asarray(picture * (1 + weave[..., None]), dtype=np.float32)


def _sketch(
    draw: ImageDraw.ImageDraw,
    rng: np.random.Generator,
    frame: tuple[float, float, float, float],
    colour: Rgb,
    pen: int,
) -> None:
    """A rectangle drawn by hand."""
    x0, y0, x1, y1 = frame
    wobble = rng.normal(0, 0.012 * (x1 - x0), (5, 2))
    corners = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]]) + wobble
    draw.line([(float(x), float(y)) for x, y in corners], fill=colour, width=pen, joint="curve")


def _round(x: float, y: float, radius: float) -> tuple[float, float, float, float]:
    return (x - radius, y - radius, x + radius, y + radius)


def _average(image: Image.Image, width_px: int, height_px: int) -> Picture:
    full = np.asarray(image, dtype=np.uint8)
    small = cv2.resize(full, (width_px, height_px), interpolation=cv2.INTER_AREA)
    return np.asarray(small, dtype=np.uint8)
