"""Wishes of all sites about shapes, carried out in the room in their order, each answered once."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from devices.hub.attendance import OPS_BURST, OPS_HZ
from devices.hub.entities.drawn import Drawn, drawn_entity
from devices.hub.entry.rates import Bucket
from devices.hub.protocol.messages import Do, OpError, Wish
from devices.sites.channels import WISHES, SiteBytesError
from devices.sites.wishes import MAX_ASKED, Answers, pack_answers, read_number, read_wish
from devices.transport.followed import LogNews, News
from scenes.state import SceneState, SharedPrimitive

SITE_PEOPLE = 8
"""People of one site who may change shapes at the same time as fast as a person may, chosen."""

SEEN_NS = 1_000_000_000
"""Time after which a change counts as in the room's state, if that never was like it: another
came before the session's next picture."""

Act = Callable[[str, Do], Drawn | None]
"""Does what somebody of a site asks for, or raises OpError or KeyError."""


@dataclass(slots=True)
class _Site:
    """Wishes of one site.

    Attributes:
        epoch: of its start.
        bucket: limits them.
        taken: number of the newest that was read.
        waiting: read, and not carried out.
        unseen: carried out, and not in the room's state: number, what came of it, when.
        refused: why, by number, until the site has read it.
    """

    epoch: int
    bucket: Bucket
    taken: int = 0
    waiting: deque[tuple[int, Wish]] = field(default_factory=deque[tuple[int, Wish]])
    unseen: deque[tuple[int, Drawn, int]] = field(default_factory=deque[tuple[int, Drawn, int]])
    refused: dict[int, str] = field(default_factory=dict[int, str])

    @property
    def done(self) -> int:
        """Number up to which all are decided, and in the room's state."""
        ahead = self.unseen or self.waiting
        return ahead[0][0] - 1 if ahead else self.taken


class Decisions:
    """Everything that sites ask of shapes. The caller keeps others off.

    Args:
        epoch: of the room's start.
    """

    def __init__(self, epoch: int) -> None:
        self._epoch = epoch
        self._sites: dict[str, _Site] = {}
        self._said: dict[str, bytes] = {}
        self.refused = 0
        """Wishes so far that could not be read, or were too many."""

    def take(self, news: News, now_ns: int) -> None:
        """Take what is new of a site."""
        name, log = news.member.name, news.logs.get(WISHES)
        site = self._sites.get(name)
        if site is None or site.epoch != news.epoch:
            bucket = Bucket(SITE_PEOPLE * OPS_HZ, SITE_PEOPLE * OPS_BURST, now_ns=now_ns)
            site = self._sites[name] = _Site(news.epoch, bucket)
        if log is not None:
            self._read(site, log, now_ns=now_ns)

    def carry_out(self, act: Act, now_ns: int) -> None:
        """Carry out what waits."""
        for name, site in self._sites.items():
            while site.waiting:
                number, wish = site.waiting.popleft()
                person_id = f"{name}.{wish.person_id}"
                try:
                    drawn = act(person_id, wish.do)
                except OpError as error:
                    site.refused[number] = str(error)
                except KeyError:
                    site.refused[number] = "the room does not know you yet; ask again"
                else:
                    if drawn is not None:
                        site.unseen.append((number, drawn, now_ns))

    def answers(self, state: SceneState, now_ns: int) -> Mapping[str, bytes]:
        """Return answers to sites that have others than before, by the site's name."""
        found: dict[str, bytes] = {}
        for name, site in self._sites.items():
            _see(site.unseen, state, now_ns=now_ns)
            data = pack_answers(Answers(site.epoch, site.done, site.refused))
            if site.taken and data != self._said.get(name):
                self._said[name] = found[name] = data
        return found

    def _read(self, site: _Site, log: LogNews, *, now_ns: int) -> None:
        there: set[int] = set()
        for entry in log.entries:
            try:
                number = read_number(entry.item)
            except SiteBytesError:
                self.refused += 1
                continue
            there.add(number)
            if not entry.data:
                site.refused.pop(number, None)  # the site has read it
            elif number > site.taken:
                site.taken = number
                self._read_wish(site, number, data=entry.data, now_ns=now_ns)
        if log.is_whole:
            site.refused = {n: why for n, why in site.refused.items() if n in there}

    def _read_wish(self, site: _Site, number: int, *, data: bytes, now_ns: int) -> None:
        why = ""
        is_much = len(site.waiting) + len(site.unseen) >= MAX_ASKED
        if is_much or not site.bucket.take(now_ns):
            why = "your site changes too many shapes at once"
        else:
            try:
                site.waiting.append((number, read_wish(data, room_epoch=self._epoch)))
            except SiteBytesError as error:
                why = str(error)
        if why:
            self.refused += 1
            site.refused[number] = why
            while len(site.refused) > MAX_ASKED:
                del site.refused[next(iter(site.refused))]


def _see(unseen: deque[tuple[int, Drawn, int]], state: SceneState, *, now_ns: int) -> None:
    """Forget changes that the room's state has, and those before them."""
    seen = 0
    for count, (_number, drawn, t_ns) in enumerate(unseen, start=1):
        if now_ns - t_ns >= SEEN_NS or is_in(state, drawn):
            seen = count
    for _ in range(seen):
        unseen.popleft()


def is_in(state: SceneState, drawn: Drawn) -> bool:
    """Return whether a state has a shape as it was decided."""
    known: SharedPrimitive | None = state.primitives.get(drawn.key)
    if known is None or not drawn.is_there:
        return known is None and not drawn.is_there
    return drawn_entity(known).entry() == drawn.entry()
