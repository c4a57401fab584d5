"""A simulated participant of a study: agrees, begins, answers what is asked, as a page would."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

import aiohttp
import numpy as np

from sim.headset.connection import HubAddress

NOW, TAKEN = "/study/now.json", "/study/answers"
"""Paths of what is asked and of where answers go, as the page has them."""

LOOK_S = 0.3
"""Time between two looks at what is asked, chosen: a fifth of a page's."""

THINK_S = 0.2
"""Time until an answer, chosen: short, as what is asked does not depend on it."""

LEAN = 0.72
"""Share of a scale that answers lie about, chosen: people who like what they see."""

SPREAD = 0.15
"""Standard deviation of answers, as a share of the scale."""

WORDS = ("It felt as if I was there.", "The chairs came a little late.", "I would use it again.")
"""Written answers."""


async def answer_all(
    http: aiohttp.ClientSession, address: HubAddress, *, token: Callable[[], str], seed: int
) -> int:
    """Answer everything that is asked until there is nothing more; return how many forms it was.

    Args:
        http: of the process.
        address: of the hub.
        token: returns the newest one.
        seed: of the answers.
    """
    rng, forms, done = np.random.default_rng([seed, 7]), 0, -1
    while True:
        await asyncio.sleep(LOOK_S)
        try:
            asked = await _asked(http, address, token=token())
            if asked is None or asked["kind"] == "thanks":
                return forms
            if asked["kind"] == "task" or asked["step"] == done:
                continue  # it ends by its goal
            await asyncio.sleep(THINK_S)
            answers = {"agree": "yes"} if asked["kind"] == "consent" else {}
            answers |= {item["name"]: answer(item, rng) for item in asked["items"]}
            body = {"step": asked["step"], "answers": answers}
            if await _send(http, address, token=token(), body=body):
                done = int(asked["step"])
                forms += asked["kind"] == "form"
        except (aiohttp.ClientError, TimeoutError, OSError):
            continue  # the network is away, as the body's


def answer(item: dict[str, Any], rng: np.random.Generator) -> str:
    """Return an answer to an item as a page is given it."""
    share = float(np.clip(rng.normal(LEAN, SPREAD), 0.0, 1.0))
    match item["kind"]:
        case "likert":
            return str(1 + round(share * (int(item["points"]) - 1)))
        case "scale":
            return str(5 * round(20 * (1.0 - share)))
        case "choice":
            return str(item["options"][int(rng.integers(0, len(item["options"])))])
        case "number":
            return str(int(rng.integers(20, 60)))
        case _:
            return WORDS[int(rng.integers(0, len(WORDS)))]


async def _asked(
    http: aiohttp.ClientSession, address: HubAddress, *, token: str
) -> dict[str, Any] | None:
    """Return what is asked now; None where no study is going on."""
    headers = {"Authorization": f"Bearer {token}"}
    async with http.get(address.at(NOW), headers=headers) as said:
        return None if said.status == 404 else dict(await said.json())


async def _send(
    http: aiohttp.ClientSession, address: HubAddress, *, token: str, body: dict[str, Any]
) -> bool:
    headers = {"Authorization": f"Bearer {token}"}
    async with http.post(address.at(TAKEN), headers=headers, json=body) as said:
        return said.status == 200
