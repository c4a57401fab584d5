"""Guests of the live session: its doors, the code that is shown, who is here, what they may."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

from scenes.workers.task import Task
from studio.app.model.runs.live_run import LiveRun
from studio.app.model.workbench import Topic, Workbench

if TYPE_CHECKING:  # the hub takes a second to import: not before somebody is let in
    from devices.hub.contract import Invitation
    from devices.hub.roles import Person, Role
    from devices.hub.server import Hub
    from studio.live.people.doors import Doors
    from studio.live.people.hosting import Hosting

OPENING = "opening the room to people"
"""Name of the work that scripts wait for."""

MAX_UNDO = 50
"""Changes of people that can be taken back, chosen: more than somebody remembers."""

WORSE_MS = 150.0
"""Round trip above which talking and pointing do not fit any more, milliseconds (ITU-T G.114 asks
for 150 one way at most)."""

ROLES = {
    "local": "on site",
    "remote": "remote",
    "operator": "operator",
    "spectator": "spectator",
}
"""Roles as people read them."""


class DoorState(StrEnum):
    """How people get in; its words."""

    NO_SESSION = "no session"
    CLOSED = "closed"
    OPENING = "opening"
    HERE = "open on this computer"
    NETWORK = "open to the network"


@dataclass(frozen=True, slots=True)
class Undone:
    """A change of a person that can be taken back: who they were before it."""

    label: str
    before: Person


class Guests:
    """Lets people into the live session that plays. It belongs to the main thread.

    Args:
        bench: whose log says who comes and what fails.
        doors: returns the doors of the session that plays, or None.
    """

    def __init__(self, bench: Workbench, doors: Callable[[], Doors | None]) -> None:
        self.invitation: Invitation | None = None
        """The code that is shown; None before one is made, and after it was used."""
        self.asks_for_network = False
        """Whether somebody is being asked if the network may reach the room."""
        self.opens_at_once = False
        """Whether the doors of each session are opened, on this computer, as soon as it begins."""
        self._bench, self._doors = bench, doors
        self._greeted: Doors | None = None
        self._role = "remote"
        self._opening: Task[str] | None = None
        self._opens_for: Doors | None = None
        self._shown_of: Hub | None = None
        self._known: frozenset[str] = frozenset()
        self._undo: list[Undone] = []

    # --- what is seen of it ----------------------------------------------------------------------

    @property
    def state(self) -> DoorState:
        """How people get in now."""
        doors = self._doors()
        if doors is None:
            return DoorState.NO_SESSION
        if self._opening is not None and self._opening.is_running:
            return DoorState.OPENING
        if doors.hub is None:
            return DoorState.CLOSED
        hosting = doors.hosting
        is_open = hosting is not None and hosting.is_open
        return DoorState.NETWORK if is_open else DoorState.HERE

    @property
    def is_open(self) -> bool:
        """Whether people can come in."""
        return self.state in (DoorState.HERE, DoorState.NETWORK)

    @property
    def role(self) -> str:
        """Role of who comes in with the next code."""
        return self._role

    def people(self) -> tuple[Person, ...]:
        """Return who is here, and who may come back, in the order in which they came."""
        hub = self._hub()
        return () if hub is None else tuple(sorted(hub.people(), key=lambda each: each.index))

    def person(self, name: str) -> Person:
        """Return somebody by id or by name.

        Raises:
            ValueError: nobody of that name is here, or several are.
        """
        from devices.hub.roles import named

        return named(self.people(), name)

    def seconds_left(self) -> float:
        """Return how long the code that is shown can still be used; 0 if there is none."""
        doors = self._doors()
        if doors is None or self.invitation is None:
            return 0.0
        return max(0.0, (self.invitation.expires_ns - doors.now_ns()) * 1e-9)

    @property
    def undoes(self) -> str:
        """Label of what `undo` takes back; empty if nothing."""
        return self._undo[-1].label if self._undo else ""

    # --- doors -----------------------------------------------------------------------------------

    def let_in(self) -> None:
        """Open the doors on this computer, and show a code.

        Raises:
            ValueError: no live session plays.
        """
        if self.is_open:
            self.invite()
        else:
            self._open(is_open=False)

    def open_at_once(self, is_wanted: bool | None = None) -> None:
        """Open the doors of each session as soon as it begins, or no longer; None changes it."""
        self.opens_at_once = not self.opens_at_once if is_wanted is None else is_wanted
        self._bench.announce(Topic.SESSION)

    def ask_for_network(self, is_asked: bool = True) -> None:
        """Ask whether the network may reach the room, or do not ask any more."""
        self.asks_for_network = is_asked
        self._bench.announce(Topic.SESSION)

    def open_to_network(self) -> None:
        """Let the whole network reach the room's page; everybody still needs a code.

        Raises:
            ValueError: no live session plays.
        """
        self.asks_for_network = False
        self._open(is_open=True)

    def close(self) -> None:
        """Close the doors: everybody leaves."""
        doors = self._needed()
        self.asks_for_network, self.invitation = False, None
        doors.close()
        self._undo.clear()
        self._bench.say("info", "people: nobody can join any more")
        self._bench.announce(Topic.SESSION)

    def _open(self, *, is_open: bool) -> None:
        from studio.live.people.hosting import Hosting

        doors = self._needed()
        if self._opening is not None and self._opening.is_running:
            return
        bench, hosting = self._bench, Hosting(is_open=is_open, invitations=0)
        self.invitation, self._opens_for = None, doors
        self._undo.clear()
        bench.busy.add(OPENING)
        # A certificate and the page of a large room take seconds.
        self._opening = Task("doors", lambda _task: _opened(doors, hosting)).start()
        bench.announce(Topic.SESSION)

    def poll(self) -> None:
        """Take what has come since: doors that are open, people who have come with the code."""
        opening = self._opening
        if opening is not None and not opening.is_running:
            self._opening = None
            self._bench.busy.discard(OPENING)
            self._end_of(opening)
        doors = self._doors()
        is_new, self._greeted = doors is not self._greeted, doors
        if is_new and doors is not None and self.opens_at_once and doors.hub is None:
            self.let_in()
        hub = self._hub()
        if hub is None or hub is not self._shown_of:
            self._known, self._shown_of = frozenset(), hub
            if hub is None:
                self.invitation = None
        if hub is None:
            return
        people = hub.people()
        here = frozenset(each.person_id for each in people)
        come = [each for each in people if each.person_id not in self._known]
        self._known = here
        if come and self.invitation is not None:
            # A code lets one person in: what is on the screen is worth nothing any more.
            self.invitation = None
        for each in come:
            self._bench.say("info", f"people: {each.name} is here as {each.role}")

    def _end_of(self, opening: Task[str]) -> None:
        problem = opening.outcome()
        if problem:
            self._bench.say("error", f"people: the room cannot be opened: {problem}")
        elif self._opens_for is self._doors() and self._hub() is not None:
            self.invite()
        self._bench.announce(Topic.SESSION)

    # --- codes -----------------------------------------------------------------------------------

    def invite(self, role: str = "") -> None:
        """Show a new code; the one that was shown is worth nothing any more.

        Args:
            role: of who comes in with it; "" the one that was chosen last.

        Raises:
            ValueError: the doors are closed, or there is no such role.
        """
        chosen = role_of(role or self._role)
        hub = self._open_hub()
        if self.invitation is not None:
            hub.revoke(self.invitation.code)
        self._role = str(chosen)
        self.invitation = hub.invite(chosen)
        self._bench.announce(Topic.SESSION)

    @property
    def is_voice_recorded(self) -> bool:
        """Whether the recording gets what people say."""
        hub = self._hub()
        return hub is not None and hub.is_voice_recorded

    def record_voices(self, is_recorded: bool | None = None) -> None:
        """Record what people say, or no longer; None changes what is so now. Their pages say so.

        Raises:
            ValueError: the doors are closed.
        """
        hub = self._open_hub()
        wanted = not hub.is_voice_recorded if is_recorded is None else is_recorded
        hub.record_voices(is_recorded=wanted)
        words = "people's voices are recorded from now on" if wanted else "voices are not recorded"
        self._bench.say("info", f"people: {words}; they are told")
        self._bench.announce(Topic.SESSION)

    # --- people ----------------------------------------------------------------------------------

    def set_role(self, name: str, role: str) -> None:
        """Give a person another role.

        Raises:
            ValueError: there is no such person or role.
        """
        person, chosen = self.person(name), role_of(role)
        if chosen != person.role:
            self._remember(f"{person.name}: {chosen}", person)
            self._done(lambda hub: hub.set_role(person.person_id, chosen))

    def mute(self, name: str, *, is_muted: bool | None = None) -> None:
        """Mute a person, or let them be seen again; None changes what is so now.

        Raises:
            ValueError: there is no such person.
        """
        person = self.person(name)
        wanted = not person.is_muted if is_muted is None else is_muted
        if wanted != person.is_muted:
            self._remember(f"{'mute' if wanted else 'unmute'} {person.name}", person)
            self._done(lambda hub: hub.mute(person.person_id, is_muted=wanted))

    def give_pen(self, name: str) -> None:
        """Let one person alone draw; "" lets everybody again, and so does who has the pen.

        Raises:
            ValueError: there is no such person, or their role lets them draw nothing.
        """
        had = next((each for each in self.people() if each.has_pen), None)
        person = self.person(name) if name else None
        wanted = None if person is None or person.has_pen else person
        if wanted is None and had is None:
            return
        before = had or wanted
        assert before is not None
        words = f"the pen for {wanted.name} alone" if wanted else "the pen for everybody"
        self._remember(words, before)
        try:
            self._done(lambda hub: hub.give_pen(None if wanted is None else wanted.person_id))
        except ValueError:
            self._undo.pop()
            raise

    def remove(self, name: str) -> None:
        """Send a person away: they need a new code to come back.

        Raises:
            ValueError: there is no such person.
        """
        person = self.person(name)
        self._undo = [each for each in self._undo if each.before.person_id != person.person_id]
        self._done(lambda hub: hub.remove(person.person_id))
        self._bench.say("info", f"people: {person.name} was sent away")

    def undo(self) -> None:
        """Take back the last change of a role, of who is muted, or of the pen.

        Raises:
            ValueError: there is none, or the person has left.
        """
        if not self._undo:
            raise ValueError("people: no change of a role, a muting or the pen can be taken back")
        before = self._undo.pop().before
        now = self.person(before.person_id)

        def restore(hub: Hub) -> None:
            if now.role != before.role:
                hub.set_role(before.person_id, before.role)
            if now.is_muted != before.is_muted:
                hub.mute(before.person_id, is_muted=before.is_muted)
            if now.has_pen != before.has_pen:
                hub.give_pen(before.person_id if before.has_pen else None)

        self._done(restore)

    def _remember(self, label: str, before: Person) -> None:
        self._undo.append(Undone(label, before))
        del self._undo[:-MAX_UNDO]

    def _done(self, change: Callable[[Hub], None]) -> None:
        try:
            change(self._open_hub())
        except KeyError as error:
            raise ValueError(f"people: {error.args[0]} has left") from error
        self._bench.announce(Topic.SESSION)

    def _hub(self) -> Hub | None:
        doors = self._doors()
        return None if doors is None else doors.hub

    def _open_hub(self) -> Hub:
        hub = self._hub()
        if hub is None:
            raise ValueError("people: nobody can join yet: let people in first")
        return hub

    def _needed(self) -> Doors:
        doors = self._doors()
        if doors is None:
            raise ValueError("people: they join a live session: check and connect first")
        return doors


def doors_of(live: LiveRun) -> Callable[[], Doors | None]:
    """Return what returns the doors of the live session that plays."""

    def found() -> Doors | None:
        job = live.job
        return None if job is None or live.session is None else job.doors

    return found


def role_of(name: str) -> Role:
    """Return a role by its word.

    Raises:
        ValueError: there is no such role.
    """
    from devices.hub.roles import Role

    try:
        return Role(name.strip().lower())
    except ValueError:
        raise ValueError(f"people: role = {name!r}, wanted one of {', '.join(Role)}") from None


def _opened(doors: Doors, hosting: Hosting) -> str:
    """Return why doors cannot be opened; empty when they are open."""
    try:
        doors.open(hosting)
    except (OSError, ValueError) as error:
        return str(error)
    return ""
