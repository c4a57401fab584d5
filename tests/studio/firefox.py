"""Firefox on a screen that nobody sees, driven over WebDriver BiDi: what a page shows and says.

Without any screen (`--headless`) it has no 3D graphics where there is no graphics card.
"""

from __future__ import annotations

import asyncio
import base64
import io
import json
import os
import re
import shutil
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import aiohttp
import numpy as np
from numpy.typing import NDArray
from PIL import Image

NAMES = ("firefox-esr", "firefox")
ANSWER_WITHIN_S = 120.0
SCREEN = "1600x1000x24"
LISTENING = re.compile(r"WebDriver BiDi listening on (ws://\S+)")
PREFERENCES = {
    "app.normandy.enabled": False,
    "app.update.enabled": False,
    "browser.shell.checkDefaultBrowser": False,
    "browser.aboutwelcome.enabled": False,
    "browser.safebrowsing.malware.enabled": False,
    "browser.safebrowsing.phishing.enabled": False,
    "datareporting.policy.dataSubmissionEnabled": False,
    "network.captive-portal-service.enabled": False,
    "network.connectivity-service.enabled": False,
    "remote.active-protocols": 1,
    "services.settings.server": "data:,",
    "toolkit.telemetry.enabled": False,
    # Without a graphics card the picture is drawn by the processor, which is slow but the same.
    "webgl.force-enabled": True,
    "webgl.disable-fail-if-major-performance-caveat": True,
}
"""Settings of the profile: nothing is asked of the network, and 3D graphics work everywhere."""


def firefox_path() -> str | None:
    """The first Firefox there is, or None."""
    return next((found for name in NAMES if (found := shutil.which(name))), None)


def missing() -> str | None:
    """Why Firefox cannot be run here and what would change that, or None."""
    if firefox_path() is None:
        return (
            f"no Firefox here: none of {', '.join(NAMES)}; `./nexus test` as root installs "
            "firefox-esr on Debian"
        )
    if not os.environ.get("DISPLAY") and shutil.which("Xvfb") is None:
        return "no screen for Firefox here: neither DISPLAY nor Xvfb; install xvfb"
    return None


@contextmanager
def _screen() -> Iterator[str]:
    """The name of a screen: the one there is, or one of its own that ends with the block."""
    there = os.environ.get("DISPLAY")
    if there:
        yield there
        return
    ours, its = os.pipe()
    flags = ["-displayfd", str(its), "-screen", "0", SCREEN, "-noreset", "-nolisten", "tcp"]
    server = subprocess.Popen(
        ["Xvfb", *flags], pass_fds=(its,), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    os.close(its)
    try:
        with os.fdopen(ours) as said:
            number = said.readline().strip()
        yield f":{number}"
    finally:
        server.terminate()
        server.wait(10)


class FirefoxPage:
    """One tab: every message of the protocol goes through it.

    Args:
        url: of the browser's own WebSocket.
    """

    def __init__(self, url: str) -> None:
        self.messages: list[str] = []
        self._count = 0
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever)
        self._thread.start()
        self._answers: dict[int, asyncio.Future[dict[str, Any]]] = {}
        self._run(self._connect(url))
        self.call("session.new", capabilities={"alwaysMatch": {"acceptInsecureCerts": True}})
        self.call("session.subscribe", events=["log.entryAdded"])
        self._tab = self.call("browsingContext.getTree")["contexts"][0]["context"]

    def call(self, method: str, **params: Any) -> dict[str, Any]:
        """Ask, and wait for the answer."""
        answer = self._run(self._ask(method, params))
        if answer.get("type") == "error":
            raise RuntimeError(f"{method}: {answer['error']}: {answer['message'][:1500]}")
        return answer["result"]

    def visit(self, url: str, *, width: int = 960, height: int = 600) -> None:
        """Go to an address."""
        size = {"width": width, "height": height}
        self.call("browsingContext.setViewport", context=self._tab, viewport=size)
        self.call("browsingContext.navigate", context=self._tab, url=url, wait="none")

    def evaluate(self, script: str) -> Any:
        """The value of an expression in the page, a promise's when it is kept."""
        answer = self.call(
            "script.evaluate",
            # As JSON: the protocol has types of its own for every kind of value.
            expression=f"(async () => JSON.stringify(await ({script})))()",
            target={"context": self._tab},
            awaitPromise=True,
        )
        if answer["type"] == "exception":
            raise RuntimeError(json.dumps(answer["exceptionDetails"])[:2000])
        text = answer["result"].get("value")
        return None if text is None else json.loads(text)

    def wait_for(self, script: str, *, seconds: float = ANSWER_WITHIN_S) -> None:
        """Until an expression is true."""
        deadline = time.monotonic() + seconds
        while True:
            try:
                if self.evaluate(script):
                    return
            except RuntimeError:  # the page is being exchanged
                if time.monotonic() > deadline:
                    raise
            if time.monotonic() > deadline:
                raise TimeoutError(f"{script}: not true after {seconds:g} s; {self.messages}")
            time.sleep(0.05)

    def press(self, key: str) -> None:
        """A key down and up."""
        actions = [{"type": kind, "value": key} for kind in ("keyDown", "keyUp")]
        self.call(
            "input.performActions",
            context=self._tab,
            actions=[{"type": "key", "id": "keys", "actions": actions}],
        )

    def click(self, x: float, y: float) -> None:
        """The left button down and up."""
        move = {"type": "pointerMove", "x": round(x), "y": round(y)}
        press = [{"type": kind, "button": 0} for kind in ("pointerDown", "pointerUp")]
        self.call(
            "input.performActions",
            context=self._tab,
            actions=[{"type": "pointer", "id": "mouse", "actions": [move, *press]}],
        )

    def picture(self) -> NDArray[np.uint8]:
        """(H, W, 3) what is on the page."""
        data = self.call("browsingContext.captureScreenshot", context=self._tab)["data"]
        return np.asarray(Image.open(io.BytesIO(base64.b64decode(data))).convert("RGB"))

    def close(self) -> None:
        """Part from the browser."""
        self._run(self._session.close())
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def _run(self, coroutine: Any) -> Any:
        return asyncio.run_coroutine_threadsafe(coroutine, self._loop).result(ANSWER_WITHIN_S)

    async def _connect(self, url: str) -> None:
        self._session = aiohttp.ClientSession()
        self._socket = await self._session.ws_connect(f"{url}/session", max_msg_size=1 << 26)
        self._reading = asyncio.create_task(self._read())

    async def _ask(self, method: str, params: dict[str, Any]) -> dict[str, Any]:
        self._count += 1
        answer: asyncio.Future[dict[str, Any]] = asyncio.get_running_loop().create_future()
        self._answers[self._count] = answer
        await self._socket.send_str(
            json.dumps({"id": self._count, "method": method, "params": params})
        )
        return await answer

    async def _read(self) -> None:
        async for message in self._socket:
            said = json.loads(message.data)
            if said.get("id") in self._answers:
                self._answers.pop(said["id"]).set_result(said)
            elif said.get("method") == "log.entryAdded":
                entry = said["params"]
                self.messages.append(f"{entry['level']}: {entry.get('text')}")
        for answer in self._answers.values():
            answer.set_exception(ConnectionError("the browser has gone"))


@contextmanager
def opened_firefox(profile: Path) -> Iterator[FirefoxPage]:
    """A browser with a fresh profile folder; it ends with the block."""
    program = firefox_path()
    assert program is not None
    lines = [f"user_pref({json.dumps(k)}, {json.dumps(v)});" for k, v in PREFERENCES.items()]
    (profile / "user.js").write_text("\n".join(lines))
    said = profile / "said.txt"
    flags = ["--no-remote", "--profile", str(profile), "--remote-debugging-port", "0"]
    with _screen() as screen, said.open("wb") as file:
        own = {"TMPDIR": str(profile), "HOME": str(profile), "DISPLAY": screen}
        # One that the tests' own user starts may be asked to draw on Wayland instead.
        env = {key: value for key, value in os.environ.items() if key != "WAYLAND_DISPLAY"} | own
        process = subprocess.Popen(
            [program, *flags], env=env, stdout=file, stderr=subprocess.STDOUT
        )
        try:
            page = FirefoxPage(_address(said, process))
            try:
                yield page
            finally:
                page.close()
        finally:
            process.terminate()
            try:
                process.wait(15)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait(15)


def _address(said: Path, process: subprocess.Popen[bytes]) -> str:
    deadline = time.monotonic() + ANSWER_WITHIN_S
    while True:
        text = said.read_text(errors="replace")
        found = LISTENING.search(text)
        if found:
            return found.group(1)
        if process.poll() is not None or time.monotonic() > deadline:
            raise RuntimeError(f"Firefox did not start: {text[-1500:]}")
        time.sleep(0.05)
