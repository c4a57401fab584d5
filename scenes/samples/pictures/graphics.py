"""Printed matter: posters, book covers, writing, screens, codes. Pictures drawn by code."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from scenes.samples.pictures.textures import Rgb, noise, tinted
from scenes.samples.shapes import Picture


def font(size_px: int, *, bold: bool = False) -> ImageFont.FreeTypeFont:
    """A sans-serif face of so many pixels."""
    import matplotlib as mpl

    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return ImageFont.truetype(Path(mpl.get_data_path()) / "fonts" / "ttf" / name, size_px)


def qr_symbol(payload: str, *, module_px: int = 12) -> Picture:
    """A QR code without its quiet zone: the outermost dark modules touch the edge."""
    symbol = cv2.QRCodeEncoder.create().encode(payload)
    inked = np.argwhere(symbol < 128)
    (top, left), (bottom, right) = inked.min(axis=0), inked.max(axis=0) + 1
    modules = symbol[top:bottom, left:right]
    big = np.kron(modules, np.ones((module_px, module_px), dtype=np.uint8))
    return np.repeat(np.where(big < 128, 22, 236).astype(np.uint8)[..., None], 3, axis=2)


def book_cover(rng: np.random.Generator) -> tuple[Picture, Picture, Picture]:
    """Front (18 × 25 cm), back and spine (25 × 3 cm, title along it), 2 px per mm."""
    front = _cover_art(rng, (500, 360), (38, 66, 120))
    image = Image.fromarray(front)
    draw = ImageDraw.Draw(image)
    draw.rectangle((24, 40, 336, 150), fill=(246, 238, 214))
    draw.text((36, 48), "ROOMS", font=font(56, bold=True), fill=(30, 40, 66))
    draw.text((38, 114), "and how to share them", font=font(22), fill=(160, 60, 40))
    draw.rectangle((24, 446, 336, 480), fill=(230, 176, 52))
    draw.text((36, 452), "A FIELD GUIDE · VOL. 3", font=font(20, bold=True), fill=(40, 40, 40))
    back = Image.fromarray(_cover_art(rng, (500, 360), (150, 62, 44)))
    draw = ImageDraw.Draw(back)
    for row in range(9):
        draw.rectangle((40, 60 + 24 * row, 40 + int(rng.integers(180, 280)), 70 + 24 * row),
                       fill=(240, 232, 214))  # fmt: skip
    spine = Image.new("RGB", (500, 60), (30, 44, 80))
    draw = ImageDraw.Draw(spine)
    draw.rectangle((0, 0, 40, 60), fill=(230, 176, 52))
    draw.text((70, 12), "ROOMS AND HOW TO SHARE", font=font(26, bold=True), fill=(246, 238, 214))
    return np.asarray(image), np.asarray(back), np.asarray(spine)


def _cover_art(rng: np.random.Generator, shape: tuple[int, int], base: Rgb) -> Picture:
    """Overlapping discs, bars and triangles on a tinted ground."""
    ground = tinted(base, 0.12 * noise(rng, shape, cell_px=(60, 60)))
    image = Image.fromarray(ground)
    draw = ImageDraw.Draw(image)
    palette = [(228, 92, 60), (244, 200, 86), (70, 160, 150), (240, 236, 220), (28, 36, 60)]
    h, w = shape
    for _ in range(26):
        colour = palette[int(rng.integers(len(palette)))]
        x, y, r = rng.uniform(0, w), rng.uniform(0.3 * h, 0.92 * h), rng.uniform(12, 52)
        kind = int(rng.integers(3))
        if kind == 0:
            draw.ellipse((x - r, y - r, x + r, y + r), fill=colour)
        elif kind == 1:
            a = rng.uniform(0, 6.28, 3)
            corners = [(float(x + r * np.cos(v)), float(y + r * np.sin(v))) for v in a]
            draw.polygon(corners, fill=colour)
        else:
            draw.rectangle((x - r, y - r / 5, x + r, y + r / 5), fill=colour)
    return np.asarray(image)


def page_edges(rng: np.random.Generator) -> Picture:
    """The side of a page block: thin lines along it."""
    lines = rng.normal(0, 0.05, (48, 1)).astype(np.float32) + rng.normal(0, 0.01, (48, 64))
    return tinted((226, 216, 192), lines.astype(np.float32))


def mug_band(rng: np.random.Generator) -> Picture:
    """Draw the print around a mug, 25 × 9.5 cm, 2 px per mm."""
    image = Image.new("RGB", (500, 190), (226, 222, 212))
    draw = ImageDraw.Draw(image)
    draw.rectangle((0, 30, 500, 46), fill=(196, 72, 50))
    draw.rectangle((0, 148, 500, 156), fill=(40, 90, 120))
    draw.text((40, 66), "NEXUS", font=font(58, bold=True), fill=(34, 46, 70))
    for k in range(9):
        x, y = 290 + 22 * k, 100 + float(rng.normal(0, 12))
        draw.ellipse((x - 9, y - 9, x + 9, y + 9), fill=(230, 176, 52) if k % 2 else (40, 120, 110))
    return np.asarray(image)


def parcel_face(rng: np.random.Generator, size_m: tuple[float, float], name: str) -> Picture:
    """One side of the small box, 2 px per mm."""
    w, h = (round(s * 2000) for s in size_m)
    image = Image.fromarray(tinted((188, 146, 98), 0.03 * noise(rng, (h, w), cell_px=(3, 14))))
    draw = ImageDraw.Draw(image)
    if "z" in name:
        draw.rectangle((0, h // 2 - 14, w, h // 2 + 14), fill=(214, 190, 150))
        draw.rectangle((w - 140, 20, w - 24, 90), fill=(240, 238, 230))
        for row in range(4):
            draw.line((w - 130, 34 + 13 * row, w - 40, 34 + 13 * row), fill=(60, 60, 60), width=4)
    else:
        draw.text((16, h // 2 - 34), "TEA", font=font(54, bold=True), fill=(40, 84, 66))
        draw.ellipse((w - 80, h // 2 - 30, w - 20, h // 2 + 30), outline=(150, 40, 40), width=8)
    return np.asarray(image)


def spine(rng: np.random.Generator, cover: Rgb, size_m: tuple[float, float]) -> Picture:
    """A book's spine, standing: bands and a title that reads downwards, 1.5 mm per px."""
    w, h = max(8, round(size_m[0] * 667)), round(size_m[1] * 667)
    image = Image.new("RGB", (h, w), cover)
    draw = ImageDraw.Draw(image)
    light = sum(cover) > 360
    ink = (44, 40, 38) if light else (236, 226, 200)
    band = int(rng.integers(4, 12))
    draw.rectangle((0, 0, band, w), fill=ink)
    draw.rectangle((h - band - 3, 0, h - band, w), fill=ink)
    words = (
        "Atlas",
        "Light",
        "Of Rooms",
        "Kinds of Wood",
        "Maps",
        "North",
        "The Window",
        "Signals",
    )
    title = words[int(rng.integers(len(words)))]
    draw.text(
        (h / 2, w / 2), title, font=font(max(9, round(0.62 * w)), bold=True), fill=ink, anchor="mm"
    )
    return np.ascontiguousarray(np.rot90(np.asarray(image), -1))
