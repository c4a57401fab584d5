"""A session that goes on with another scenario from some instant: what may change there."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace

from scenes.mesh import PhysicalRoom
from sim.faults.device import Bump
from sim.faults.fault import Fault
from sim.faults.twins import Twins
from sim.faults.way import Delay, Loss
from sim.scenarios.actions import Action
from sim.scenarios.scenario import RemoteSettings, Scenario, validate_scenario
from sim.tables import ScenarioError


@dataclass(frozen=True, slots=True)
class Switch:
    """From one instant on, what happens is what another scenario says.

    Faults, remote users and the duration are the new scenario's. A person whose actions so far
    begin the new list goes on with the rest of it; another lets go, stops, and begins the new list
    where they stand. Where people of the new scenario start is not looked at.

    Attributes:
        t_ns: the instant; the first frame at or after it is the first that can differ.
        scenario: what is followed from then on.
    """

    t_ns: int
    scenario: Scenario


def validate_switches(scenario: Scenario, then: Sequence[Switch], room: PhysicalRoom) -> None:
    """Check that a session of `scenario` can go on as `then` says, one after the other.

    Raises:
        ScenarioError: one of them doesn't fit the room, or changes what cannot change in a session:
            the camera, the live surfaces, or who is there.
    """
    before, since_ns = scenario, -1
    for switch in then:
        validate_scenario(switch.scenario, room)
        _check_instant(switch, since_ns, before)
        _check_camera(switch.scenario, scenario)
        _check_twins(switch.scenario, scenario)
        _check_people(switch.scenario, scenario)
        before, since_ns = switch.scenario, switch.t_ns


def _check_instant(switch: Switch, since_ns: int, before: Scenario) -> None:
    where, t_s = switch.scenario.source, switch.t_ns / 1e9
    if not max(0, since_ns + 1) <= switch.t_ns < before.duration_s * 1e9:
        raise ScenarioError(
            f"{where}: goes on at {t_s:g} s, wanted an instant from "
            f"{max(0, since_ns + 1) / 1e9:g} s to before {before.duration_s:g} s"
        )
    if switch.scenario.duration_s * 1e9 <= switch.t_ns:
        raise ScenarioError(
            f"{where}: duration_s = {switch.scenario.duration_s:g}, wanted more than the {t_s:g} s "
            "at which the session goes on with it"
        )


def _check_camera(new: Scenario, first: Scenario) -> None:
    for field in fields(first.camera):
        found, wanted = getattr(new.camera, field.name), getattr(first.camera, field.name)
        if found != wanted:
            raise ScenarioError(
                f"{new.source}: camera.{field.name} = {found!r}, wanted {wanted!r} as in "
                f"{first.source}: the camera stays the same in a session that goes on"
            )
    if new.surfaces != first.surfaces:
        raise ScenarioError(
            f"{new.source}: surfaces: wanted the same as in {first.source}: what shows live video "
            "is decided when a session begins"
        )


def _check_twins(new: Scenario, first: Scenario) -> None:
    if new.faults.of(Twins) != first.faults.of(Twins):
        raise ScenarioError(
            f"{new.source}: faults.{Twins.name}: wanted the same as in {first.source}: what stands "
            "in the room is decided when a session begins"
        )


def _check_people(new: Scenario, first: Scenario) -> None:
    known = [person.person_id for person in first.people]
    for person in new.people:
        if person.person_id not in known:
            raise ScenarioError(
                f"{new.source}: people.id = {person.person_id!r}, wanted one of "
                f"{', '.join(known) or 'nobody'}: nobody can come into a session that goes on; "
                f"add them to {first.source}, standing still, and rehearse it first"
            )


def first_difference_s(
    before: Scenario,
    after: Scenario,
    *,
    from_s: float,
    begins_s: Callable[[Scenario, str, int], float],
) -> float | None:
    """The time from which a session that goes on with another scenario can differ; None if never.

    A time at or after the end means that the session ends before the change. What cannot change in
    a session counts as different at once: it is refused when it is played.

    Args:
        before: what is followed until the instant.
        after: what is followed from then on.
        from_s: the instant.
        begins_s: when an action of a person begins, by scenario, person's id and number.
    """
    fixed = ("duration_s", "camera", "surfaces")
    if any(getattr(before, name) != getattr(after, name) for name in fixed):
        return from_s
    if _remote_within(before) != _remote_within(after):
        return from_s
    found = [_first_fault_s(before, after, from_s)]
    old, new = ({p.person_id: p for p in each.people} for each in (before, after))
    for person_id in {*old, *new}:
        if person_id not in old or person_id not in new:
            return from_s
        number = _first_other(old[person_id].actions, new[person_id].actions)
        if number is not None:
            has_it = number < len(new[person_id].actions)
            found.append(max(from_s, begins_s(after if has_it else before, person_id, number)))
    return min((t_s for t_s in found if t_s is not None), default=None)


def _first_fault_s(before: Scenario, after: Scenario, from_s: float) -> float | None:
    """The first frame at which other faults are there."""
    for number in range(math.ceil(from_s * after.camera.fps - 1e-9), after.frame_count):
        t_s = number / after.camera.fps
        if _acting(before, from_s, t_s) != _acting(after, from_s, t_s):
            return t_s
    return None


def _acting(scenario: Scenario, from_s: float, t_s: float) -> list[Fault]:
    """Loss and delay are drawn for every frame, whatever size they name."""
    return [
        fault
        for fault in scenario.faults.each
        if isinstance(fault, Loss | Delay)
        or (fault.size_at(t_s) and not (isinstance(fault, Bump) and fault.at_s < from_s))
    ]


def _remote_within(scenario: Scenario) -> list[RemoteSettings]:
    """Remote users, without the lines that they would draw after the end."""
    return [
        replace(user, draws=tuple(d for d in user.draws if d.from_s < scenario.duration_s))
        for user in scenario.remote
    ]


def _first_other(old: Sequence[Action], new: Sequence[Action]) -> int | None:
    """Number of the first action that is not the same; None if all are."""
    same = next((i for i, (a, b) in enumerate(zip(old, new, strict=False)) if a != b), None)
    if same is not None:
        return same
    return None if len(old) == len(new) else min(len(old), len(new))
