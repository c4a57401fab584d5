"""The film of a session shows what people put into the room."""

from dataclasses import replace

import numpy as np

from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.state import Proposal, SharedPrimitive
from studio.reports.film import FilmMaker, FilmTitle, film_frame
from studio.session.plan import SessionPlan
from studio.view.twin import Twin


def test_primitives_and_proposals_are_in_both_pictures_of_the_twin(tiny):
    outputs = []
    tiny.session(SessionPlan(methods=("own",))).run(outputs.append)
    maker = FilmMaker(tiny.scene, Twin(tiny.scene, NativeRenderer()), FilmTitle("tiny", "test"))
    bare = film_frame(outputs[0])
    assert (bare.primitives, bare.proposals) == ((), ())
    ahead = tiny.scene.world_from_rig.translation * (1, 1, 0) + (0.0, 0.9, 0.0)
    item = tiny.scene.objects[0]
    red = SharedPrimitive(
        "p1/b", "p1", "box", (0.4, 0.4, 0.4), (1, 0, 0), Pose.from_yaw(0.0, ahead)
    )
    copy = Proposal("p1/c", "p1", "Ann", item.object_id, item.world_from_object)
    plain = maker.picture(bare).astype(int)
    shown = maker.picture(replace(bare, primitives=(red,))).astype(int)
    changed = np.abs(shown - plain).max(axis=2) > 60
    _camera, _same_view, above = np.array_split(changed, 3, axis=1)
    assert above.sum() > 200
    green = maker.picture(replace(bare, proposals=(copy,))).astype(int)
    more = (green - plain)[..., 1] - (green - plain)[..., 0]
    assert (more > 30).sum() > 100
