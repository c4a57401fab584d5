"""People of a state from picture to picture."""

import numpy as np

from scenes.bodies.crowd import Crowd, colour_of
from scenes.frames import look_at
from scenes.state import Avatar

S = 1_000_000_000


def at(name, x, role="remote", hands=()):
    head = look_at(np.array([x, 0.0, 1.6]), np.array([x + 2.0, 0.0, 1.6]))
    return Avatar(name, role, head, hands)


def test_the_same_state_gives_the_same_figures():
    crowd, people = Crowd(), {"ana": at("ana", 0.0)}
    first = crowd.figures(people, 0)["ana"]
    assert crowd.figures(dict(people), 0)["ana"] is first
    second = crowd.figures({"ana": at("ana", 0.01)}, S // 72)["ana"]
    assert second is not first
    assert second.faces is first.faces
    assert second.colours is first.colours
    assert second.arm_faces is first.arm_faces


def test_feet_stay_while_the_body_moves_and_jump_when_time_does():
    crowd = Crowd()

    def feet(people, t_ns):
        places = crowd.figures(people, t_ns)["ana"].vertices
        return places[places[:, 2] < 0.06]

    before = feet({"ana": at("ana", 0.0)}, S)
    after = feet({"ana": at("ana", 0.06)}, S + S // 72)
    assert np.abs(before[:, 0].mean() - after[:, 0].mean()) < 0.004
    jumped = feet({"ana": at("ana", 0.06)}, S // 2)
    assert jumped[:, 0].mean() - before[:, 0].mean() > 0.05


def test_people_come_and_go_and_the_others_stay_as_they_are():
    crowd = Crowd()
    ana, ben = at("ana", 0.0), at("ben", 1.0, "local")
    alone = crowd.figures({"ana": ana}, S)["ana"].vertices
    both = crowd.figures({"ben": ben, "ana": ana}, S + S // 72)
    assert list(both) == ["ben", "ana"]
    assert np.abs(both["ana"].vertices - alone).max() < 1e-4
    assert both["ben"].vertices[:, 0].mean() > 0.7
    assert crowd.figures({}, 2 * S) == {}


def test_colours_are_of_the_role_and_the_person():
    colours = {colour_of(at(name, 0.0)) for name in ("p1", "p2", "p3", "p4", "p5")}
    assert len(colours) >= 4
    assert colour_of(at("p1", 0.0)) != colour_of(at("p1", 0.0, "local"))
