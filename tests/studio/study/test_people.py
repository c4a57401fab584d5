"""A condition delays and thins what people get, and no name reaches the session."""

from types import SimpleNamespace

from devices.clock import ManualClock
from devices.hub.contract import Arrived
from scenes.pose import Pose
from scenes.state import Avatar, Proposal, SceneState, reduce_state
from studio.study.people import StudyPeople
from studio.study.plan import Condition


class Hub:
    def __init__(self):
        self.arrived, self.states, self.pictures = Arrived(), [], []

    def take(self):
        return self.arrived

    def publish(self, state):
        self.states.append(state)

    def show(self, surface_id, jpeg):
        self.pictures.append(surface_id)


def made(**condition):
    hub, clock = Hub(), ManualClock()
    people = StudyPeople(
        hub, Condition("c", "c", **condition), participant="ABC1", person=lambda: "p1", clock=clock
    )
    return SimpleNamespace(hub=hub, clock=clock, people=people)


def play(it, *, frames, hz=20):
    for k in range(frames):
        it.clock.sleep_until(k * 10**9 // hz)
        it.people.publish(SceneState(version=k))
    return [state.version for state in it.hub.states]


def test_states_come_at_once_late_or_seldom():
    assert play(made(), frames=5) == [0, 1, 2, 3, 4]
    assert play(made(delay_s=0.1), frames=5) == [0, 1, 2]
    assert play(made(every_s=1.0), frames=41) == [0, 20, 40]
    assert play(made(every_s=0.5, delay_s=0.5), frames=31) == [0, 10, 20]


def test_a_still_room_shows_no_object():
    it = made(shows_objects=False)
    it.people.publish(SceneState(objects={"chair": None}))
    assert dict(it.hub.states[0].objects) == {}


def test_names_are_left_outside_and_proposals_come_back_as_they_were():
    it = made()
    wanted = Proposal("p1/a", "p1", "Ada Lovelace", "chair", Pose.identity())
    it.hub.arrived = Arrived(
        avatars=(
            Avatar("p1", "remote", Pose.identity(), name="Ada Lovelace"),
            Avatar("p7", "local", Pose.identity(), name="Grace"),
        ),
        placed=(wanted,),
        events=(("joined", "Ada Lovelace (p1) joined as remote"),),
    )
    it.people.note("task-begun", "layout")
    taken = it.people.take()
    assert [avatar.name for avatar in taken.avatars] == ["ABC1", "other-1"]
    assert taken.placed[0].user_name == "ABC1"
    assert taken.events == (("joined", "joined"), ("task-begun", "layout"))
    state = reduce_state(SceneState(), taken.placed[0], 0)
    it.people.publish(state)
    assert it.hub.states[-1].proposals["p1/a"] is wanted
