"""A HoloLens's address as a person writes it, and its table in a file of devices.

[hololens]
address = "192.168.1.40"
name = "Ana"
camera_code = "nexus:camera"
camera_code_side_m = 0.08
"""

from __future__ import annotations

import json
import re

from devices.hololens.plan import HeadsetPlan
from sim.tables import Table
from studio.live.hololens.worn import WornPlan

HOST = re.compile(r"[A-Za-z0-9]([A-Za-z0-9.-]{0,251}[A-Za-z0-9])?")
"""Names and IPv4 addresses; its ports are fixed, and it speaks no IPv6."""

MAX_NAME = 40
"""Characters of the wearer's name, as of everybody's in the session."""


def parse_host(text: str) -> str:
    """Return the address of a headset.

    Raises:
        ValueError: it is none.
    """
    host = text.strip()
    if not HOST.fullmatch(host):
        raise ValueError(
            f"HoloLens {text!r}: wanted its address, such as 192.168.1.40; it is shown on the "
            "headset under Settings, Network, and when its program starts"
        )
    return host


def worn_plan(host: str, *, name: str = "", code: str = "", code_side_m: float = 0.1) -> WornPlan:
    """Return the headset at an address.

    Raises:
        ValueError: it is none.
    """
    usual = WornPlan(HeadsetPlan(parse_host(host)))
    called = name.strip()[:MAX_NAME] or usual.name
    return WornPlan(usual.headset, called, code, code_side_m)


def worn_again(before: WornPlan | None, host: str) -> WornPlan:
    """Return the headset at an address, with the name and the code that it had.

    Raises:
        ValueError: it is none.
    """
    usual = worn_plan(host)
    if before is None:
        return usual
    return WornPlan(usual.headset, before.name, before.camera_code, before.camera_code_side_m)


def read_worn(table: Table) -> WornPlan:
    """Return what a file of devices says.

    Raises:
        ScenarioError: something in it is wrong.
    """
    text = table.text("address")
    try:
        host = parse_host(text)
    except ValueError as error:
        raise table.error("address", text, str(error).partition("wanted ")[2]) from None
    plan = worn_plan(
        host,
        name=table.optional_text("name") or "",
        code=table.optional_text("camera_code") or "",
        code_side_m=table.number("camera_code_side_m", 0.1, low=0.02, high=1.0),
    )
    table.done()
    return plan


def worn_text(plan: WornPlan) -> str:
    """Return the table that `read_worn` reads the same from."""
    values: dict[str, str | float] = {"address": plan.headset.host, "name": plan.name}
    if plan.camera_code:
        values["camera_code"] = plan.camera_code
        values["camera_code_side_m"] = plan.camera_code_side_m
    lines = (f"{key} = {json.dumps(value)}\n" for key, value in values.items())
    return "[hololens]\n" + "".join(lines)
