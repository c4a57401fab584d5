"""How the local user's HoloLens is doing, in figures and a sentence."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from studio.app.live.words import age_words

if TYPE_CHECKING:  # what a session needs takes a second to import: not before the window is shown
    from devices.hololens.values import StreamStatus
    from studio.live.hololens.worn import WornStatus

NAMES = ("Video", "Hands", "Clock", "Origin", "Drift", "Mesh", "Display", "Battery")
"""Titles of the figures, in their order."""

STALE_S = 60.0
"""Time since a code was seen after which the wearer should look at one again, seconds."""

OLD_NS = 1_000_000_000
"""Age of the newest picture or hand from which something is wrong."""

LOW_PERCENT = 20.0
"""Battery at which it should be charged."""


@dataclass(frozen=True, slots=True)
class Figure:
    """A line of the panel.

    Attributes:
        name: its title.
        text: its value.
        kind: of the theme's colours and shapes; empty for a plain one.
        hint: more about it.
    """

    name: str
    text: str = "–"
    kind: str = ""
    hint: str = ""


def figures_of(status: WornStatus | None) -> tuple[Figure, ...]:
    """Return the lines about a headset; dashes where there is none."""
    if status is None:
        return tuple(Figure(name) for name in NAMES)
    streams, clock, origin = status.headset.streams, status.headset.clock, status.origin
    mesh, battery = status.mesh, status.headset.battery_percent
    known = Figure("Origin", "no code seen", "warning")
    if origin.sigma_mm is not None and origin.sigma_deg is not None:
        is_stale = origin.age_s is not None and origin.age_s > STALE_S
        text = f"±{origin.sigma_mm:.0f} mm, {origin.sigma_deg:.2f}°"
        codes = ", ".join(origin.codes)
        known = Figure("Origin", text, "warning" if is_stale else "good", f"by {codes}")
    cells = Figure("Mesh", f"{mesh.surfaces} surfaces, {mesh.cells} new cells")
    return (
        _stream("Video", streams.get("video")),
        _stream("Hands", streams.get("body")),
        Figure("Clock", "–" if clock is None else f"±{clock.offset_sigma_ns / 1e6:.1f} ms"),
        known,
        Figure("Drift", f"{origin.drift_mm:.0f} mm in a minute" if origin.is_known else "–"),
        Figure("Mesh", "off", "warning", mesh.failure) if mesh.failure else cells,
        Figure("Display", f"{status.drawn} items"),
        Figure("Battery", "not said by it" if battery is None else f"{battery:.0f} %",
               "warning" if battery is not None and battery <= LOW_PERCENT else ""),
    )  # fmt: skip


def sentence_of(status: WornStatus) -> tuple[str, str]:
    """Return what is to be known or done, and of which kind it is."""
    for name, stream in status.headset.streams.items():
        if stream.state in ("waiting", "held"):
            return f"{name}: {stream.reason}", "warning"
    origin = status.origin
    if origin.moved:
        return f"Code {origin.moved[0]!r} hangs elsewhere than in the scan; left out.", "warning"
    if not origin.is_known:
        return "Ask the wearer to look at one of the room's codes from 1 to 3 m.", "warning"
    if origin.age_s is not None and origin.age_s > STALE_S:
        return f"No code seen for {origin.age_s:.0f} s: ask the wearer to look at one.", "warning"
    if not status.headset.is_live:
        return "Connecting …", ""
    return "The local user is in the room.", "good"


def _stream(name: str, status: StreamStatus | None) -> Figure:
    if status is None or status.last_age_ns is None:
        return Figure(name, "–" if status is None else str(status.state))
    delay = "" if status.delay_ms is None else f", {status.delay_ms:.0f} ms"
    is_old = status.last_age_ns > OLD_NS
    text = f"{age_words(status.last_age_ns)}" if is_old else f"{status.rate_hz:.0f} /s{delay}"
    return Figure(name, text, "warning" if is_old else "", status.reason)
