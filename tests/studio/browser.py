"""A real browser without a window, driven over two pipes: what a page shows and asks for."""

from __future__ import annotations

import base64
import fcntl
import io
import json
import os
import select
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from PIL import Image

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--remote-debugging-pipe",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--hide-scrollbars",
)
ANSWER_WITHIN_S = 90.0
WITH_PIPES = """
import os, sys
os.dup2(int(sys.argv[1]), 3)
os.dup2(int(sys.argv[2]), 4)
os.execv(sys.argv[3], sys.argv[3:])
"""
"""Starts a program with two open files as its third and fourth, where the browser looks."""

AT_REST = """(async () => {
  const page = window.live ?? window.viewer;
  for (let drawn = -1, still = 0; still < 3;) {
    await new Promise(requestAnimationFrame);
    const { spark } = page.room;
    const isStill = page.drawn() > 0 && page.drawn() === drawn && page.sharpness() === 0
      && !spark.sorting && !spark.sortDirty;
    still = isStill ? still + 1 : 0;
    drawn = page.drawn();
  }
})()"""
"""Kept once the live page or the viewer lets frames pass without drawing: splats are sorted beside,
and a slow machine's pictures are coarse until nothing moves."""

Found = TypeVar("Found")


def browser_path() -> str | None:
    """The first browser there is, or None."""
    return next((found for name in NAMES if (found := shutil.which(name))), None)


def until(
    is_wanted: Callable[[Found], object],
    measure: Callable[[], Found],
    *,
    seconds: float = ANSWER_WITHIN_S,
) -> Found:
    """The first of the values that are measured one after another that is as wanted."""
    deadline = time.monotonic() + seconds
    while not is_wanted(found := measure()):
        if time.monotonic() > deadline:
            raise TimeoutError(f"not as wanted after {seconds:g} s: {found}")
        time.sleep(0.05)
    return found


class Page:
    """One tab: every message of the protocol goes through it.

    Args:
        send: file descriptor that the browser reads.
        receive: file descriptor that it writes.
    """

    def __init__(self, send: int, receive: int) -> None:
        self._send, self._receive = send, receive
        self._rest = b""
        self._count = 0
        self._session: str | None = None
        self.requests: list[str] = []
        self.messages: list[str] = []
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        attached = self.call("Target.attachToTarget", targetId=target, flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **params: Any) -> dict[str, Any]:
        """Ask, and wait for the answer."""
        self._count += 1
        message: dict[str, Any] = {"id": self._count, "method": method, "params": params}
        if self._session is not None:
            message["sessionId"] = self._session
        os.write(self._send, json.dumps(message).encode() + b"\0")
        deadline = time.monotonic() + ANSWER_WITHIN_S
        while True:
            answer = self._next(deadline)
            if answer.get("id") == self._count:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]
            self._note(answer)

    def open(self, path: Path, *, width: int = 960, height: int = 600) -> None:
        """Go to a file on the disk, as somebody does who clicks on it twice."""
        self.visit(path.resolve().as_uri(), width=width, height=height)

    def visit(
        self, url: str, *, width: int = 960, height: int = 600, is_phone: bool = False
    ) -> None:
        """Go to an address."""
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=is_phone,
        )
        self.call("Emulation.setTouchEmulationEnabled", enabled=is_phone)
        self.call("Page.navigate", url=url)

    def reload(self) -> None:
        """Load the page anew; what is asked of it afterwards is asked of the new one."""
        self.evaluate("window.isOld = true")
        self.call("Page.reload")
        until(bool, self._is_new)

    def evaluate(self, script: str) -> Any:
        """The value of an expression in the page, a promise's when it is kept."""
        answer = self.call(
            "Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True
        )
        if "exceptionDetails" in answer:
            raise RuntimeError(json.dumps(answer["exceptionDetails"])[:2000])
        return answer["result"].get("value")

    def wait_for(self, script: str, *, seconds: float = ANSWER_WITHIN_S) -> None:
        """Until an expression is true."""
        deadline = time.monotonic() + seconds
        while not self.evaluate(script):
            if time.monotonic() > deadline:
                raise TimeoutError(f"{script}: not true after {seconds:g} s; {self.messages}")
            time.sleep(0.05)

    def rest(self) -> None:
        """Until the live page or the viewer draws no more: its picture is as it stays."""
        self.evaluate(AT_REST)

    def pass_frames(self, count: int = 2) -> None:
        """Until so many more pictures were drawn from beginning to end, in a headset too."""
        drawn = self.evaluate("live.drawn()")
        self.wait_for(f"live.drawn() >= {drawn + count}")

    def click(self, x: float, y: float) -> None:
        """The left button down and up."""
        for kind in ("mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def hold(self, key: str, code: str, seconds: float) -> None:
        """A key down for a while."""
        self.call("Input.dispatchKeyEvent", type="keyDown", key=key, code=code)
        time.sleep(seconds)
        self.call("Input.dispatchKeyEvent", type="keyUp", key=key, code=code)

    def press(self, key: str, code: str) -> None:
        """A key down and up."""
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, code=code)

    def picture(self) -> NDArray[np.uint8]:
        """(H, W, 3) what is on the page."""
        data = base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])
        return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))

    def _is_new(self) -> bool:
        try:
            return self.evaluate("window.isOld === undefined")
        except RuntimeError:  # it is being exchanged
            return False

    def _next(self, deadline: float) -> dict[str, Any]:
        while b"\0" not in self._rest:
            left = deadline - time.monotonic()
            if left <= 0 or not select.select([self._receive], [], [], left)[0]:
                raise TimeoutError(f"the browser did not answer in {ANSWER_WITHIN_S:g} s")
            data = os.read(self._receive, 1 << 20)
            if not data:
                raise ConnectionError("the browser has gone")
            self._rest += data
        line, self._rest = self._rest.split(b"\0", 1)
        return json.loads(line)

    def _note(self, message: dict[str, Any]) -> None:
        params = message.get("params", {})
        if message.get("method") == "Network.requestWillBeSent":
            self.requests.append(params["request"]["url"])
        elif message.get("method") == "Runtime.exceptionThrown":
            self.messages.append(json.dumps(params["exceptionDetails"])[:1500])
        elif message.get("method") == "Runtime.consoleAPICalled":
            said = " ".join(str(a.get("value", a.get("description"))) for a in params["args"])
            self.messages.append(f"{params['type']}: {said}")
        elif message.get("method") == "Log.entryAdded":
            self.messages.append(f"log: {params['entry']['text']}")


def _pipe() -> tuple[int, int]:
    """Both ends above the numbers that the browser's own ends get."""
    ends = os.pipe()
    above = tuple(fcntl.fcntl(end, fcntl.F_DUPFD, 10) for end in ends)
    for end in ends:
        os.close(end)
    return above[0], above[1]


@contextmanager
def opened_browser(profile: Path, *more: str) -> Iterator[Page]:
    """A browser with a fresh profile folder, and more flags; it ends with the block."""
    program = browser_path()
    assert program is not None
    to_browser, from_us = _pipe()
    from_browser, to_us = _pipe()
    flags = (*FLAGS, *more, f"--user-data-dir={profile}")
    process = subprocess.Popen(
        [sys.executable, "-c", WITH_PIPES, str(to_browser), str(to_us), program, *flags],
        pass_fds=(to_browser, to_us),
        env={**os.environ, "TMPDIR": str(profile)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    os.close(to_browser)
    os.close(to_us)
    try:
        yield Page(from_us, from_browser)
    finally:
        os.close(from_us)
        os.close(from_browser)
        process.terminate()
        try:
            process.wait(10)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait(10)
