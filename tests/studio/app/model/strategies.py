"""Documents to test with, drawn by hypothesis."""

import numpy as np
from hypothesis import strategies as st

from scenes.pose import Pose
from scenes.state import Annotation, Avatar, LiveSurface
from studio.app.model.documents.added_mesh import AddedMesh, Geometry
from studio.app.model.documents.document import (
    Document,
    Marker,
    Primitive,
    TrackerChoice,
    TwinEdits,
)
from tracking.options import TrackerOptions

ids = st.text(st.characters(codec="utf-8", exclude_characters="\x00"), min_size=1, max_size=8)
lengths = st.floats(-50, 50, allow_nan=False)
sizes = st.floats(0.01, 5)
shares = st.floats(0, 1)
places = st.tuples(lengths, lengths, lengths)
colours = st.tuples(shares, shares, shares)
poses = st.builds(Pose.from_yaw, st.floats(-3, 3), places)


def points(count):
    return st.lists(places, min_size=count, max_size=count).map(np.array)


def triangles(corners):
    """Two triangles of four corners."""
    grey = np.full((4, 3), 128, np.uint8)
    return Geometry(corners.astype(np.float32), np.array([[0, 1, 2], [0, 2, 3]]), grey)


def keyed(make):
    return st.dictionaries(ids, st.none(), max_size=3).flatmap(
        lambda keys: st.fixed_dictionaries({key: make(key) for key in keys})
    )


twins = st.builds(
    TwinEdits,
    poses=keyed(lambda _: poses),
    names=keyed(lambda _: ids),
    primitives=keyed(
        lambda key: st.builds(
            Primitive,
            st.just(key),
            st.sampled_from(["box", "ball", "cylinder"]),
            st.tuples(sizes, sizes, sizes),
            colours,
            poses,
        )
    ),
    avatars=keyed(
        lambda key: st.builds(
            Avatar,
            st.just(key),
            st.sampled_from(["local", "remote"]),
            poses,
            st.lists(points(5), max_size=2).map(tuple),
            st.none() | points(2),
        )
    ),
    cameras=keyed(lambda _: poses),
    surfaces=keyed(
        lambda key: st.builds(
            LiveSurface, st.just(key), points(4), st.just((320, 200)), st.just("camera-360")
        )
    ),
    annotations=keyed(lambda key: st.builds(Annotation, st.just(key), ids, points(3), colours)),
    meshes=keyed(
        lambda key: st.builds(AddedMesh, st.just(key), ids, points(4).map(triangles), poses)
    ),
)
documents = st.builds(
    Document,
    scene=ids,
    scenario_name=ids,
    scenario=st.text(max_size=40),
    seed=st.integers(0, 2**31),
    twin=twins,
    tracker=st.builds(
        TrackerChoice,
        ids,
        st.booleans(),
        st.builds(TrackerOptions, st.booleans(), st.booleans(), st.booleans(), st.floats(1, 1000)),
    ),
    draft=st.none() | st.text(max_size=40),
    markers=st.lists(st.builds(Marker, st.integers(0, 10**12), ids), max_size=3).map(tuple),
)
