"""Everything the window knows and does, without the window: the one object that docks share.

It belongs to the main thread. Threads leave their results in slots, which `poll` empties.
"""

from __future__ import annotations

import time
from collections import defaultdict, deque
from collections.abc import Callable, Mapping, MutableSet
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from scenes.state import SceneState
from studio.app.model.actions import ActionError, ActionTable
from studio.app.model.documents.document import Change, Document, History, composed
from studio.app.model.log import Level, Log, LogLine
from studio.app.model.names import shown_name
from studio.app.model.offered import Offered
from studio.app.model.script import script_line
from studio.app.model.settings import Recent, Settings
from studio.app.model.standing import Happening, Mode, Standing, after
from studio.app.model.topics import Notice, Topic

if TYPE_CHECKING:
    from scenes.package import ScenePackage
    from studio.app.model.grabbing import Grabbing
    from studio.app.model.jobs.sessions import Sessions
    from studio.view.surface_drawing import LivePicture

TRACE = 2000
"""Script lines that are kept of what the user did."""


Part = TypeVar("Part")


class Workbench:
    """The document, what is shown of it, and what can be done.

    Args:
        document: what to begin with.
        settings: the user's.
        history: of the document's changes.
    """

    def __init__(self, document: Document, settings: Settings, history: History) -> None:
        self.actions = ActionTable()
        self.log = Log()
        self.history = history
        self.scene: ScenePackage | None = None
        self.project: Path | None = None
        """File of the project, or None before it was saved once."""
        self.standing = Standing()
        """Editing, playing, recorded or live, and the recording that belongs to it."""
        self.notice: Notice | None = None
        """The newest one."""
        self.selection = ""
        self.left_unsaved = False
        """Whether the document before this one went with edits nobody has saved or given up."""
        self.live: tuple[LivePicture, ...] = ()
        """Pictures of the live surfaces in the state that is shown."""
        self.camera_picture: NDArray[np.uint8] | None = None
        """(H, W, 3) RGB of the 360° camera's front lens at that instant."""
        self.session: Sessions | None = None
        """Opens scenes and plays sessions; there from the time the window is."""
        self.grabbing: Grabbing | None = None
        """Moves objects by physics; there from the time the twin's dock is."""
        self.offered = Offered()
        """Trackers and faults of plug-ins."""
        self.busy: MutableSet[str] = set()
        """Names of work on threads that will come to an end by itself: scripts wait for it."""
        self._document = document
        self._saved: Document | None = document
        self._given_up: Document | None = None
        self._settings = settings
        self._base: SceneState | None = None
        self._state = composed(None, document.twin)
        self._listeners: defaultdict[Topic, list[Callable[[], None]]] = defaultdict(list)
        self._trace: deque[str] = deque(maxlen=TRACE)
        self._depth = 0
        self._parts: dict[type[object], object] = {}

    # --- the document ----------------------------------------------------------------------------

    @property
    def document(self) -> Document:
        """The document that is edited."""
        return self._document

    def change(self, label: str, document: Document, *, merge: str = "") -> None:
        """Make a change that can be undone.

        Args:
            label: what was done, such as "Move chair-1".
            document: with the change.
            merge: changes in a row with the same key that is not empty are one step: a drag.
        """
        before = self._document
        self.show_document(document)
        self.history.push(Change(label, before, document, merge))

    def show_document(self, document: Document) -> None:
        """Take a document without a step of undo: undo itself, and what is restored."""
        self._document = document
        self._compose()
        self._call(Topic.DOCUMENT)

    def open_document(
        self, document: Document, project: Path | None, *, is_saved: bool = True
    ) -> None:
        """Begin with another document; what could be undone is forgotten.

        Args:
            document: what is edited from now on.
            project: its file, or None.
            is_saved: whether nothing would be lost with it as it is.

        Raises:
            StandingError: a session plays.
        """
        self._happen(Happening.OPEN_DOCUMENT)
        self.left_unsaved = not (self.is_saved or self.is_given_up)
        self.history.clear()
        self.project = project
        self.selection = ""
        if self.standing.mode is Mode.EDITING:
            self._base = None
        self._saved = document if is_saved else None
        self._given_up = None
        self._document = document
        self._call(Topic.OPENED)
        self.show_document(document)

    @property
    def is_saved(self) -> bool:
        """Whether nothing would be lost with the document: undo comes back to what was saved."""
        return self._document is self._saved

    @property
    def is_given_up(self) -> bool:
        """Whether the user has said that the document as it is may be lost."""
        return self._document is self._given_up

    def give_up(self) -> None:
        """The user has said that the document as it is now may be lost."""
        self._given_up = self._document

    def saved(self, project: Path) -> None:
        """The document is in that file as it is now."""
        self.project, self._saved = project, self._document
        self._call(Topic.DOCUMENT)

    # --- what is shown ---------------------------------------------------------------------------

    @property
    def state(self) -> SceneState:
        """The room as it is shown: a session's or recording's, with what was added by hand."""
        return self._state

    @property
    def is_by_hand(self) -> bool:
        """Whether no session or recording decides where objects are."""
        return self._base is None and self.standing.mode is Mode.EDITING

    def show_state(
        self,
        state: SceneState | None,
        *,
        live: tuple[LivePicture, ...] = (),
        camera_picture: NDArray[np.uint8] | None = None,
    ) -> None:
        """Show an instant of a session or recording; None shows the room as arranged by hand.

        Args:
            state: the room at that instant.
            live: what its live surfaces show.
            camera_picture: (H, W, 3) RGB of the front lens; None keeps the one that is shown.
        """
        self._base = state
        self.live = live
        self.camera_picture = self.camera_picture if camera_picture is None else camera_picture
        self._compose()

    def show_scene(self, scene: ScenePackage | None) -> None:
        """A scene was opened; None while another one is being opened."""
        self.scene = scene
        self._call(Topic.SCENE)
        self._compose()

    @property
    def recording(self) -> Path | None:
        """The recording that is open; None while a session plays, too."""
        return self.standing.recording if self.standing.mode is Mode.RECORDED else None

    def open_recording(self, path: Path | None) -> None:
        """Show a recording; None closes it.

        Raises:
            StandingError: a session plays.
        """
        if path is None and self.standing.is_session:
            return
        happening = Happening.CLOSE_RECORDING if path is None else Happening.OPEN_RECORDING
        self._happen(happening, path)
        if path is None:
            self.show_state(None)
        self._call(Topic.RECORDING)

    def begin_session(self, *, is_live: bool) -> None:
        """A session decides where objects are from now on.

        Raises:
            StandingError: one plays already.
        """
        happening = Happening.GO_LIVE if is_live else Happening.PLAY
        self._happen(happening)
        self.show_state(None)
        self._call(Topic.RECORDING)

    def end_session(self, recording: Path | None) -> None:
        """The session has ended, however it did; hands decide again unless there is a recording.

        Args:
            recording: to look at; None goes back to where the session was begun.

        Raises:
            StandingError: none plays.
        """
        happening = Happening.END if recording is None else Happening.END_KEPT
        self._happen(happening, recording)
        self.show_state(None)
        self._call(Topic.RECORDING)

    def select(self, item_id: str) -> None:
        """Select an object or whatever else has an id; "" selects nothing."""
        if item_id != self.selection:
            self.selection = item_id
            self._call(Topic.SELECTION)

    def name_of(self, item_id: str) -> str:
        """Return the shown name of an item, see `shown_name`."""
        return shown_name(item_id, self._document, self.scene, people=self._state.avatars)

    def _happen(self, happening: Happening, recording: Path | None = None) -> None:
        self.standing = after(self.standing, happening, recording)

    def _compose(self) -> None:
        self._state = composed(self._base, self._document.twin)
        self._call(Topic.STATE)

    def share(self, part: object) -> None:
        """Give docks and actions something that is shared like the bench, by its class."""
        self._parts[type(part)] = part

    def shared(self, kind: type[Part]) -> Part | None:
        """Return the shared instance of a class; None if there is none."""
        part = self._parts.get(kind)
        return part if isinstance(part, kind) else None

    def offer(self, offered: Offered) -> None:
        """These are the trackers and faults of plug-ins now."""
        self.offered = offered
        self._call(Topic.OFFERED)

    # --- settings --------------------------------------------------------------------------------

    @property
    def settings(self) -> Settings:
        """The user's."""
        return self._settings

    def set(self, **values: Any) -> None:
        """Change settings by name."""
        self._settings = replace(self._settings, **values)
        self._call(Topic.SETTINGS)

    def remember(self, path: str, kind: Recent = "recent") -> None:
        """Something was opened: it comes first in that list of the settings."""
        self._settings = self._settings.opened(path, kind)
        self._call(Topic.SETTINGS)

    # --- actions ---------------------------------------------------------------------------------

    def do(self, action_id: str, **values: Any) -> bool:
        """Do what a button, a key, the palette or a line of a script asks for.

        Returns:
            Whether it was done; if not, the log says why.
        """
        try:
            self.perform(action_id, **values)
        except (ValueError, OSError) as error:
            self.say("error", str(error))
            return False
        return True

    def perform(self, action_id: str, **values: Any) -> None:
        """As `do`, for scripts, which end at the first failure.

        Raises:
            ActionError: no such action, a wrong argument, or it cannot be done now.
            ValueError, OSError: whatever the action raises.
        """
        action = self.actions.check(action_id, values)
        self._depth += 1
        try:
            action.run(**values)
        except TypeError as error:
            if "argument" not in str(error):
                raise
            wanted = ", ".join(action.arguments)
            raise ActionError(f"{action_id}: wanted {wanted or 'no arguments'}: {error}") from error
        finally:
            self._depth -= 1
        if not self._depth:  # what an action does by other actions is in its own line already
            self._trace.append(script_line(action_id, values))

    def note(self, action_id: str, **values: Any) -> None:
        """Write down what was done by hand, such as a drag, as the line of a script."""
        self._trace.append(script_line(action_id, values))

    def trace(self) -> list[str]:
        """Return the user's actions as lines of a script."""
        return list(self._trace)

    # --- words and listeners ---------------------------------------------------------------------

    def say(self, level: Level, text: str) -> None:
        """Add a line to the log; the window shows the last one."""
        self.log.add(LogLine(time.time_ns(), level, " ".join(text.split())))
        self._call(Topic.LOG)

    def notify(
        self,
        text: str,
        level: Level = "error",
        ways: Mapping[str, Callable[[], object]] = MappingProxyType({}),
    ) -> None:
        """Show a sentence in the window, with a button for each way to go on; see `Notice`."""
        self.notice = Notice(" ".join(text.split()), ways, level)
        self._call(Topic.NOTICE)

    def listen(self, topic: Topic, callback: Callable[[], None]) -> None:
        """Call back on the main thread whenever something of that kind has changed."""
        self._listeners[topic].append(callback)

    def stop_listening(self, callback: Callable[[], None]) -> None:
        """No longer call back, for any topic."""
        for callbacks in self._listeners.values():
            while callback in callbacks:
                callbacks.remove(callback)

    def announce(self, topic: Topic) -> None:
        """Call those who listen: for parts that keep something of their own, such as a session."""
        self._call(topic)

    def _call(self, topic: Topic) -> None:
        for callback in tuple(self._listeners[topic]):
            callback()
