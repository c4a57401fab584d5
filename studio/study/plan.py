"""A study as one TOML file describes it: tasks, conditions, questionnaires, consent."""

from __future__ import annotations

import math
import re
import tomllib
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from scenes.state import STANDS_WITHIN_M, STANDS_WITHIN_RAD
from sim.tables import ScenarioError, Table
from studio.study.questionnaires import (
    KINDS,
    MAX_ITEMS,
    Item,
    Questionnaire,
    known_questionnaire,
)

STUDY_FILE = "study.toml"
"""Name of the description in a study's folder."""

FIRST_STUDY = Path(__file__).parent / "first-study.toml"
"""Description with which a study begins: the paper's two applications."""

MAX_PARTICIPANTS = 500
"""Participants of one study, chosen: ten times the largest of telepresence studies."""

MAX_DELAY_S = 10.0
"""Longest delay, and longest time between two states, of a condition, seconds; chosen: ten times
the paper's."""

ID = re.compile(r"[a-z0-9][a-z0-9-]{0,30}")
"""Ids of tasks, conditions and questionnaires: they are parts of folder names and of columns."""


class GoalKind(StrEnum):
    """How it is known that a task is done."""

    SAID = "said"
    """The participant says so, as in the paper."""
    LAYOUT = "layout"
    """Every object stands at its target in the room."""
    FIGURE = "figure"
    """Pieces lie as a figure, wherever it lies and however it is turned."""


class When(StrEnum):
    """When a questionnaire is answered."""

    FIRST = "first"
    """Once, before the first task."""
    TASK = "task"
    """After every task."""
    CONDITION = "condition"
    """After the last task of every condition."""
    END = "end"
    """Once, after everything."""


@dataclass(frozen=True, slots=True)
class Target:
    """Place of one object in a goal.

    Attributes:
        object_id: as in the scene.
        place_m: (x, y) of its origin on the floor or table.
        yaw_rad: its turn about the vertical.
        symmetry: how many yaws of it look the same; 0 where all do.
        kind: objects of one kind may stand for each other; empty where nothing else may.
    """

    object_id: str
    place_m: tuple[float, float]
    yaw_rad: float
    symmetry: int = 1
    kind: str = ""


@dataclass(frozen=True, slots=True)
class Goal:
    """An arrangement that has to be reached.

    Attributes:
        kind: how it is known.
        targets: of the objects; none where the participant says it.
        within_m: how far each may be off.
        within_rad: by how much each may be turned off.
        hold_s: how long it must stay so: an object that passes through its place is not there.
    """

    kind: GoalKind = GoalKind.SAID
    targets: tuple[Target, ...] = ()
    within_m: float = STANDS_WITHIN_M
    within_rad: float = STANDS_WITHIN_RAD
    hold_s: float = 2.0


@dataclass(frozen=True, slots=True)
class Task:
    """Something that participants do.

    Attributes:
        task_id: unique in the study.
        title: shown to the participant.
        prompt: what is to be done, in the words that everybody reads.
        scene: room or scene package.
        scenario: scripted people by which it is rehearsed; empty where there is none.
        limit_s: after which it ends undone.
        goal: by which it is judged.
    """

    task_id: str
    title: str
    prompt: str
    scene: str
    scenario: str
    limit_s: float
    goal: Goal


@dataclass(frozen=True, slots=True)
class Condition:
    """A way in which participants see the room.

    Attributes:
        condition_id: unique in the study.
        title: in words, for tables and plots; participants do not see it.
        delay_s: the room's state reaches people so much later than it is known.
        every_s: seconds between two states that people get; 0 for as often as they come.
        shows_objects: whether people see objects move; else they see the scan.
    """

    condition_id: str
    title: str
    delay_s: float = 0.0
    every_s: float = 0.0
    shows_objects: bool = True


@dataclass(frozen=True, slots=True)
class Asked:
    """A questionnaire, and when it is answered."""

    questionnaire: Questionnaire
    when: When


@dataclass(frozen=True, slots=True)
class Study:
    """A study.

    Attributes:
        title: of the study.
        seed: of everything that is drawn by chance: orders, anonymous ids, resampling.
        participants: how many are planned.
        consent: paragraphs that everybody agrees to.
        contact: whom to ask, and to whom one says that one's data are to go.
        conditions: at least one.
        tasks: at least one.
        asked: questionnaires in the order in which they are answered.
    """

    title: str
    seed: int
    participants: int
    consent: tuple[str, ...]
    contact: str
    conditions: tuple[Condition, ...]
    tasks: tuple[Task, ...]
    asked: tuple[Asked, ...]

    def task(self, task_id: str) -> Task:
        """Return a task by id.

        Raises:
            KeyError: there is none.
        """
        return {task.task_id: task for task in self.tasks}[task_id]

    def condition(self, condition_id: str) -> Condition:
        """Return a condition by id.

        Raises:
            KeyError: there is none.
        """
        return {each.condition_id: each for each in self.conditions}[condition_id]

    def questionnaire(self, name: str) -> Questionnaire:
        """Return a questionnaire by id.

        Raises:
            ValueError: it is not asked in this study.
        """
        for asked in self.asked:
            if asked.questionnaire.name == name:
                return asked.questionnaire
        known = ", ".join(asked.questionnaire.name for asked in self.asked)
        raise ValueError(f"questionnaire {name!r}: not asked in this study; asked are {known}")


def read_study(path: Path) -> Study:
    """Return the study that a file describes, or the one in a folder.

    Raises:
        ScenarioError: it cannot be read, or a key or value in it is wrong.
    """
    file = path / STUDY_FILE if path.is_dir() else path
    try:
        text = file.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or type(error).__name__
        raise ScenarioError(
            f"{file}: cannot be read ({reason}); `nexus study new DIR` makes one"
        ) from None
    return parse_study(text, source=str(file))


def parse_study(text: str, *, source: str) -> Study:
    """Return the study that a TOML text describes.

    Args:
        text: the file's content.
        source: its name, for messages.

    Raises:
        ScenarioError: it is no TOML, or a key or value in it is wrong.
    """
    try:
        values = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError(f"{source}: not TOML: {error}") from None
    table = Table(values, source, "")
    own = tuple(_questionnaire(each) for each in table.tables("questionnaires"))
    consent = table.table("consent")
    study = Study(
        title=table.text("title"),
        seed=table.integer("seed", 0, low=0, high=2**31 - 1),
        participants=table.integer("participants", low=1, high=MAX_PARTICIPANTS),
        consent=consent.texts("text"),
        contact=consent.text("contact"),
        conditions=tuple(_condition(each) for each in table.tables("conditions")),
        tasks=tuple(_task(each) for each in table.tables("tasks")),
        asked=tuple(_asked(each, own) for each in table.tables("ask")),
    )
    consent.done()
    table.done()
    for key, ids in (
        ("conditions", [each.condition_id for each in study.conditions]),
        ("tasks", [each.task_id for each in study.tasks]),
        ("ask", [each.questionnaire.name for each in study.asked]),
    ):
        _check_ids(ids, f"{source}: {key}", is_needed=key != "ask")
    if not study.consent:
        raise ScenarioError(f"{source}: consent.text is missing, wanted what participants agree to")
    return study


def _condition(table: Table) -> Condition:
    condition_id = table.text("id")
    objects = table.text("objects", "live")
    if objects not in ("live", "still"):
        raise table.error("objects", objects, "'live' or 'still'")
    condition = Condition(
        condition_id,
        table.text("title", condition_id),
        table.number("delay_s", 0.0, low=0.0, high=MAX_DELAY_S),
        table.number("every_s", 0.0, low=0.0, high=MAX_DELAY_S),
        objects == "live",
    )
    table.done()
    return condition


def _task(table: Table) -> Task:
    task_id = table.text("id")
    task = Task(
        task_id,
        table.text("title", task_id),
        table.text("prompt"),
        table.text("scene"),
        table.optional_text("scenario") or "",
        table.number("limit_s", 900.0, low=1.0, high=7200.0),
        _goal(table.table("goal")),
    )
    table.done()
    return task


def _goal(table: Table) -> Goal:
    kind = table.text("kind", "said")
    if kind not in list(GoalKind):
        raise table.error("kind", kind, f"one of {', '.join(GoalKind)}")
    usual = Goal()
    goal = Goal(
        GoalKind(kind),
        tuple(_target(each) for each in table.tables("targets")),
        table.number("within_m", usual.within_m, low=0.001, high=1.0),
        math.radians(table.number("within_deg", math.degrees(usual.within_rad), low=0.1, high=180)),
        table.number("hold_s", usual.hold_s, low=0.0, high=60.0),
    )
    if bool(goal.targets) is (goal.kind is GoalKind.SAID):
        raise table.error("kind", kind, "'said' without targets, or another kind with some")
    table.done()
    return goal


def _target(table: Table) -> Target:
    target = Target(
        table.text("object"),
        table.point("at"),
        math.radians(table.number("yaw_deg", 0.0, low=-360.0, high=360.0)),
        table.integer("symmetry", 1, low=0, high=12),
        table.optional_text("kind") or "",
    )
    table.done()
    return target


def _asked(table: Table, own: tuple[Questionnaire, ...]) -> Asked:
    name, when = table.text("questionnaire"), table.text("when", "end")
    found = next((each for each in own if each.name == name), None) or known_questionnaire(name)
    if found is None:
        raise table.error("questionnaire", name, "a built-in one, or one of [[questionnaires]]")
    if when not in list(When):
        raise table.error("when", when, f"one of {', '.join(When)}")
    table.done()
    return Asked(found, When(when))


def _questionnaire(table: Table) -> Questionnaire:
    """Return a study's own questionnaire.

    Raises:
        ScenarioError: a key or value is wrong.
    """
    name = table.text("id")
    items = table.tables("items")
    if not 1 <= len(items) <= MAX_ITEMS:
        raise table.error("items", len(items), f"1..{MAX_ITEMS} of them")
    found = Questionnaire(
        name,
        table.text("title", name),
        table.optional_text("lead") or "",
        tuple(_item(each) for each in items),
        table.optional_text("source") or "",
    )
    names = [item.name for item in found.items]
    twice = sorted({each for each in names if names.count(each) > 1})
    if twice:
        raise table.error("items", twice[0], "a different id for each")
    table.done()
    return found


def _item(table: Table) -> Item:
    kind = table.text("kind", "likert")
    if kind not in KINDS:
        raise table.error("kind", kind, f"one of {', '.join(KINDS)}")
    item = Item(
        table.text("id"),
        table.text("text"),
        kind,
        table.integer("points", 5, low=2, high=11),
        table.optional_text("low") or "",
        table.optional_text("high") or "",
        table.texts("options"),
        table.text("needed", "yes") == "yes",
    )
    if (item.kind == "choice") is not bool(item.options):
        raise table.error("options", item.options, "some of a choice, and of nothing else")
    table.done()
    return item


def _check_ids(ids: list[str], where: str, *, is_needed: bool) -> None:
    if is_needed and not ids:
        raise ScenarioError(f"{where}: none, wanted at least one")
    for each in ids:
        if not ID.fullmatch(each):
            raise ScenarioError(f"{where}: id = {each!r}, wanted small letters, digits and -")
    twice = sorted({each for each in ids if ids.count(each) > 1})
    if twice:
        raise ScenarioError(f"{where}: id = {twice[0]!r} twice, wanted a different id for each")
