"""A session that goes on with another scenario from some instant: what may change there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

from scenes.mesh import PhysicalRoom
from sim.faults.twins import Twins
from sim.scenarios.scenario import Scenario, validate_scenario
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
