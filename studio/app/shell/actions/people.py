"""Actions of people in the live session, for keys, palette and scripts."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtGui import QGuiApplication

from studio.app.model.actions import Action, Choice
from studio.app.model.runs.guests import ROLES, DoorState, Guests
from studio.app.model.workbench import Workbench

if TYPE_CHECKING:  # the hub takes a second to import: not before somebody is let in
    from devices.hub.roles import Person


class GuestActions:
    """Actions of guests.

    Args:
        bench: whose actions they become.
        guests: who is let in.
    """

    def __init__(self, bench: Workbench, guests: Guests) -> None:
        self._bench, self._guests = bench, guests

    def add(self) -> None:
        """Add them to the bench."""
        for action in (*self._doors(), *self._rights(), *self._people()):
            self._bench.actions.add(action)

    def _doors(self) -> tuple[Action, ...]:
        guests = self._guests
        return (
            Action(
                "people.let_in",
                "Let people in",
                "Live",
                self.let_in,
                "open the room to browsers on this computer, and show a code",
                "F7",
                available=lambda: guests.state in (DoorState.CLOSED, DoorState.HERE),
                icon="mdi6.account-plus-outline",
            ),
            Action(
                "people.open_at_once",
                "Let people in as soon as a live session begins",
                "Live",
                guests.open_at_once,
                "on this computer; the one button of a session opens its doors, too",
                is_on=lambda: guests.opens_at_once,
            ),
            Action(
                "people.open_network",
                "Open the room to this network",
                "Live",
                self.open_network,
                "browsers and headsets on it can join with a code; says first what that means",
                arguments=("confirmed",),
                available=lambda: guests.state in (DoorState.CLOSED, DoorState.HERE),
            ),
            Action(
                "people.close",
                "Let nobody in any more",
                "Live",
                guests.close,
                "everybody leaves; the session goes on",
                available=lambda: guests.is_open,
            ),
            Action(
                "people.new_code",
                "Make a new code for somebody",
                "Live",
                guests.invite,
                "one person, two minutes; the code before it is worth nothing any more",
                arguments=("role",),
                available=lambda: guests.is_open,
                choices=lambda: [Choice(word, {"role": role}) for role, word in ROLES.items()],
            ),
            Action(
                "people.copy_link",
                "Copy the link to join",
                "Live",
                self.copy_link,
                "with the code in it: whoever opens it first comes in",
                available=lambda: guests.seconds_left() > 0.0,
            ),
        )

    def _rights(self) -> tuple[Action, ...]:
        guests = self._guests
        return (
            Action(
                "people.set_role",
                "Give a person another role",
                "Live",
                lambda person, role: guests.set_role(person, role),
                "local, remote, operator or spectator; by name or id",
                arguments=("person", "role"),
                available=lambda: guests.is_open,
            ),
            Action(
                "people.mute",
                "Mute a person",
                "Live",
                lambda person, muted=None: guests.mute(person, is_muted=muted),
                "their body and what they do are refused; again lets them",
                arguments=("person", "muted"),
                available=lambda: guests.is_open,
                choices=lambda: self._each(muted=True),
            ),
            Action(
                "people.give_pen",
                "Give one person the pen",
                "Live",
                lambda person="": guests.give_pen(person),
                "they alone may draw and put things; again, or nobody: everybody may",
                arguments=("person",),
                available=lambda: guests.is_open,
                choices=lambda: self._each(pen=True),
            ),
            Action(
                "people.record_voices",
                "Record what people say",
                "Live",
                lambda recorded=None: guests.record_voices(recorded),
                "off at first; everybody's page says that it is on; again ends it",
                arguments=("recorded",),
                available=lambda: guests.is_open,
            ),
        )

    def _people(self) -> tuple[Action, ...]:
        guests = self._guests
        return (
            Action(
                "people.remove",
                "Send a person away",
                "Live",
                lambda person: guests.remove(person),
                "they need a new code to come back",
                arguments=("person",),
                available=lambda: guests.is_open,
                choices=self._each,
            ),
            Action(
                "people.follow",
                "Look from a guest's eyes",
                "Live",
                self.follow,
                "the view follows them until it is moved by hand",
                arguments=("person",),
                available=lambda: guests.is_open,
                choices=self._each,
            ),
            Action(
                "people.undo",
                "Undo the last change of a person",
                "Live",
                guests.undo,
                "of a role, of who is muted, or of the pen",
                available=lambda: bool(guests.undoes),
            ),
        )

    def _each(self, *, muted: bool = False, pen: bool = False) -> list[Choice]:
        def is_on(each: Person) -> bool | None:
            return each.is_muted if muted else each.has_pen if pen else None

        return [
            Choice(each.name, {"person": each.person_id}, is_on=is_on(each))
            for each in self._guests.people()
        ]

    def let_in(self) -> None:
        """Open the doors on this computer and show the panel with the code.

        Raises:
            ValueError: no live session plays.
        """
        self._guests.let_in()
        self._show_panel()

    def open_network(self, confirmed: bool = False) -> None:
        """Open the doors to the network, or ask whether to.

        Raises:
            ValueError: no live session plays.
        """
        if confirmed:
            self._guests.open_to_network()
        else:
            self._guests.ask_for_network()
        self._show_panel()

    def copy_link(self) -> None:
        """Put the link of the code that is shown on the clipboard; the log has it without."""
        invitation = self._guests.invitation
        if invitation is not None:
            QGuiApplication.clipboard().setText(invitation.url)
            self._bench.say("info", "copied: the link to join, for one person")

    def follow(self, person: str) -> None:
        """See what somebody sees.

        Raises:
            ValueError: there is no such person, or nothing of them is seen yet.
        """
        found = self._guests.person(person)
        if found.person_id not in self._bench.state.avatars:
            raise ValueError(f"people: {found.name} shows no head yet: wait until they are seen")
        self._bench.perform("view.follow", person=found.person_id)

    def _show_panel(self) -> None:
        if "dock.people" in self._bench.actions:
            self._bench.perform("dock.people")
