"""The live session of the window: what it is asked for, which step comes next, what it leads to."""

from __future__ import annotations

import shlex
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING

from studio.app.model.jobs.live_job import LiveJob, LivePlan
from studio.app.model.jobs.sessions import Sessions
from studio.app.model.settings import RECENT
from studio.app.model.workbench import Topic, Workbench

if TYPE_CHECKING:  # what a session needs takes a second to import: not before the window is shown
    import numpy as np
    from numpy.typing import NDArray

    from devices.camera.lenses.layout import LensLayout
    from studio.live.live import LiveSession
    from studio.live.setup import LiveSetup

DEFAULT_CAMERA = "rtmp://:1935/live/room"
"""Default address: any camera's app can push there."""

SIMULATED_CAMERA = "rtmp://127.0.0.1:0/live/room"
"""Address that a simulated camera pushes to: any free port of this machine."""


@dataclass(frozen=True, slots=True)
class LiveChoice:
    """The devices as they stand in the form: words that may still be wrong.

    Attributes:
        address: of the camera.
        layout: such as "side_by_side 0 0", or "auto".
        place: "find", or "scan" where the camera stands as in the scan.
        is_simulated: whether a simulated camera is used instead.
        wears: whether the local user wears a HoloLens; a simulated one with a simulated camera.
        headset: its address.
    """

    address: str = DEFAULT_CAMERA
    layout: str = "auto"
    place: str = "find"
    is_simulated: bool = False
    wears: bool = False
    headset: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class HeadsetView:
    """Picture of a headset's camera.

    Attributes:
        person_id: of whoever wears it.
        t_ns: when it was taken, session time; None before the first.
        age_s: of it.
        draw: returns (H, W, 3) uint8 RGB: the newest, with what the headset's display shows.
    """

    person_id: str
    t_ns: int | None
    age_s: float
    draw: Callable[[], NDArray[np.uint8] | None]


class Step(StrEnum):
    """Next step of the one button; its words."""

    CHECK = "Check and connect"
    OPENING = "Opening the room …"
    CONFIRM = "Confirm and go live"
    TRY_AGAIN = "Try again"
    GO_LIVE = "Go live"
    GO_LIVE_SOON = "Go live when ready"
    GOES_LIVE = "Goes live by itself …"
    END = "End"
    ENDING = "Ending …"


NO_STEP = frozenset({Step.OPENING, Step.GOES_LIVE, Step.ENDING})
"""Steps after which the next one comes by itself."""


class LiveRun:
    """Asks for live sessions and directs the one that plays. It belongs to the main thread.

    Args:
        bench: whose document says which room.
        run: plays them.
    """

    def __init__(self, bench: Workbench, run: Sessions) -> None:
        self.choice = LiveChoice(next(iter(bench.settings.cameras), DEFAULT_CAMERA))
        self.layout: LensLayout | None = None
        """The layout that a person looks at before it is confirmed; None for the found one."""
        self.plan: LivePlan | None = None
        """Wishes given when the window was opened, such as a scenario."""
        self._bench, self._run = bench, run
        self._base: LiveSetup | None = None
        self._goes_live = False

    # What is seen of it.

    @property
    def job(self) -> LiveJob | None:
        """The live job that plays or played last; None before, or after another kind of job."""
        job = self._run.job
        return job if isinstance(job, LiveJob) else None

    @property
    def is_running(self) -> bool:
        """Whether a live session plays."""
        job = self.job
        return job is not None and job.running

    @property
    def session(self) -> LiveSession | None:
        """The session, while it plays."""
        job = self.job
        return job.live if job is not None and job.running else None

    def headset_view(self) -> HeadsetView | None:
        """Return the picture of the local user's headset; None where none is worn."""
        session = self.session
        worn = None if session is None else session.worn
        if session is None or worn is None:
            return None
        from studio.live.hololens.local_user import WEARER

        frame = worn.anchoring.picture
        if frame is None:
            return HeadsetView(WEARER, None, 0.0, worn.view)
        return HeadsetView(WEARER, frame.t_ns, (session.now_ns() - frame.t_ns) / 1e9, worn.view)

    @property
    def step(self) -> Step:
        """The next step."""
        job = self.job
        if job is None or not job.running:
            return Step.CHECK
        if job.stops:
            return Step.ENDING
        if job.live is None:
            return Step.OPENING
        state = job.live.state
        if state in STEPS:
            return STEPS[state]
        return Step.GOES_LIVE if self._goes_live else Step.GO_LIVE_SOON

    def shown_layout(self) -> LensLayout | None:
        """How the lenses are cut out for people: as chosen here, else as the session has it."""
        session = self.session
        return self.layout or (None if session is None else session.layout)

    def setup(self) -> LiveSetup:
        """The devices that are asked for.

        Raises:
            AddressError, ValueError: address or layout is none; the message says what it could be.
        """
        from devices.camera.address import parse_address
        from studio.live.hololens.address import worn_again
        from studio.live.setup import LiveSetup, Place, parse_layout

        choice = self.choice
        address = SIMULATED_CAMERA if choice.is_simulated else choice.address
        setup = self._base or LiveSetup(parse_address(address))
        return replace(
            setup,
            camera=parse_address(address),
            layout=parse_layout(choice.layout),
            place=Place(choice.place),
            hololens=worn_again(setup.hololens, choice.headset)
            if choice.wears and not choice.is_simulated
            else None,
        )

    def command(self) -> str:
        """The command line that does the same without a window; without passwords."""
        choice = self.choice
        words = ["nexus", "live", self._bench.document.scene, "--headless"]
        if choice.is_simulated:
            words.append("--simulated")
        else:
            words += ["--camera", shown_address(choice.address)]
        if choice.layout != "auto":
            words += ["--layout", choice.layout]
        if choice.place != "find":
            words += ["--place", choice.place]
        if choice.wears:
            words += ["--hololens"] if choice.is_simulated else ["--hololens", choice.headset]
        return shlex.join(words)  # without --out it finds a folder that is free

    # What can be done.

    def choose(self, choice: LiveChoice) -> None:
        """Ask for other devices from the next session on.

        Raises:
            ValueError: a session plays.
        """
        if self.is_running and choice != self.choice:
            raise ValueError("the camera cannot be changed while it is live: end the session first")
        self.choice = choice
        self._bench.announce(Topic.SESSION)

    def use(self, setup: LiveSetup, *, is_simulated: bool = False, wears: bool = False) -> None:
        """Ask for the devices of a file or of a command line."""
        from studio.live.setup import address_text, layout_text

        self._base = setup
        self.choose(
            LiveChoice(
                address_text(setup.camera) if not is_simulated else self.choice.address,
                layout_text(setup.layout),
                str(setup.place),
                is_simulated,
                wears or setup.hololens is not None,
                "" if setup.hololens is None else setup.hololens.headset.host,
            )
        )

    def begin(self) -> None:
        """Connect to the camera and look at everything.

        Raises:
            AddressError, ValueError: a word of the form is wrong, or a session plays.
        """
        if self._run.is_playing:
            raise ValueError("a session is playing already: end it first")
        setup = self.setup()
        asked, choice, bench = self.plan, self.choice, self._bench
        if not choice.is_simulated:
            shown = shown_address(choice.address)
            others = [each for each in bench.settings.cameras if each != shown]
            bench.set(cameras=tuple([shown, *others][:RECENT]))
        scene = bench.document.scene
        plan = LivePlan(scene, setup, self._run.out, choice.is_simulated, seed=bench.document.seed)
        if asked is not None and choice.is_simulated == asked.is_simulated:
            plan = replace(asked, scene=scene, setup=setup)
        plan = replace(plan, wears=choice.wears)
        plan = replace(plan, out=self._run.new_folder("live"))
        self.layout = None
        self._goes_live = plan.seconds is not None
        opened = None if self._run.is_busy else bench.scene
        self._run.play(LiveJob(plan, options=bench.document.tracker.options, opened=opened))

    def go_on(self) -> None:
        """Do the next step.

        Raises:
            AddressError, ValueError: it cannot be done.
        """
        match self.step:
            case Step.CHECK:
                self.begin()
            case Step.CONFIRM:
                self.confirm()
                self.go_live()
            case Step.TRY_AGAIN:
                self.try_again()
            case Step.GO_LIVE | Step.GO_LIVE_SOON:
                self.go_live()
            case Step.END:
                self.end()
            case Step.OPENING | Step.GOES_LIVE | Step.ENDING:
                pass

    def look_at(self, layout: LensLayout | None) -> None:
        """Show the pictures under a layout, before it is confirmed."""
        self.layout = layout
        self._bench.announce(Topic.SESSION)

    def confirm(self) -> None:
        """The layout that is shown is right.

        Raises:
            ValueError: no session asks.
        """
        layout = self.shown_layout()
        if layout is None:
            raise ValueError("there is no picture yet whose layout could be confirmed")
        self._playing().choose_layout(layout)
        self.layout = None

    def try_again(self) -> None:
        """Look for the camera again, under the layout that is shown.

        Raises:
            ValueError: no session plays.
        """
        session = self._playing()
        if self.layout is not None and self.layout != session.layout:
            self.confirm()
        else:
            session.try_again()

    def go_live(self) -> None:
        """Go live as soon as the objects are found.

        Raises:
            ValueError: no session plays.
        """
        self._playing().go_live()
        self._goes_live = True
        self._bench.announce(Topic.SESSION)

    def end(self) -> None:
        """End the session; its report opens."""
        if self.is_running:
            self._run.stop()

    def find_camera(self) -> None:
        """Look for the camera anywhere in the room, beside the session.

        Raises:
            ValueError: no session plays.
        """
        self._playing().relocate()

    def undo_tracker(self) -> None:
        """Take back the last change of the tracker's settings.

        Raises:
            ValueError: no session plays, or nothing was changed.
        """
        session = self._playing()
        if not session.undo_adjustment():
            raise ValueError("none of the tracker's settings was changed in this session")
        bench = self._bench
        tracker = replace(bench.document.tracker, options=session.options)
        bench.change("Undo the tracker's settings", replace(bench.document, tracker=tracker))

    def check_again(self) -> None:
        """Look at everything again."""
        self._playing()
        assert self.job is not None
        self.job.check()

    def save_devices(self, path: Path) -> None:
        """Write the devices as TOML.

        Raises:
            ValueError, OSError: a word of the form is wrong, or the file cannot be written.
        """
        from studio.live.setup import setup_text

        path.write_text(setup_text(self.setup()), encoding="utf-8")
        self._bench.say("info", f"saved {path}: nexus live --devices {shlex.quote(str(path))}")

    def open_devices(self, path: Path) -> None:
        """Take the devices of a file.

        Raises:
            SetupError, OSError: the file is wrong or cannot be read.
        """
        from studio.live.setup import read_setup

        self.use(read_setup(path))

    def _playing(self) -> LiveSession:
        session = self.session
        if session is None:
            raise ValueError("no live session plays: check and connect first")
        return session


STEPS = {
    "confirming": Step.CONFIRM,
    "refused": Step.TRY_AGAIN,
    "ready": Step.GO_LIVE,
    "live": Step.END,
    "ended": Step.ENDING,
}
"""By the session's state, where only one step is possible."""


def shown_address(text: str) -> str:
    """An address without user and password, as it is remembered and shown."""
    scheme, mark, rest = text.strip().partition("://")
    authority, slash, path = rest.partition("/")
    return f"{scheme}{mark}{authority.rpartition('@')[2]}{slash}{path}" if mark else text.strip()
