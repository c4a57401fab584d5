"""A session's first frame: who is where, settled for all objects together.

Objects that were moved are searched for while others still account for the wrong part of the
picture: a chair that has left, or a table found where another object stands. So what was found is
weighed anew, the best supported first, each against a picture in which only those before it stand
(greedy maximisation of the joint likelihood). Who does not hold is searched for again.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from scenes.state import TrackState
from tracking.evidence.evidence import Neighbour, gather, view_of
from tracking.evidence.observation import observe
from tracking.follow.belief import STAYS_NATS
from tracking.follow.redetection import heights_of, redetect_all
from tracking.follow.track import Task, Track
from tracking.hypotheses.hypothesis import is_other
from tracking.hypotheses.prior import moved_log_prior
from tracking.likelihood.pixel_model import PoseSupport
from tracking.likelihood.pose_likelihood import pose_support

ROUNDS = 4
"""Rounds of searching and weighing at most. In three random rooms no session needed more than
three."""


DOUBTFUL_NATS = -1.0
"""Support below which an object that holds by its prior alone is searched for once, together with
those that are lost: a mug that may still stand where a book lies would keep the book out."""


def settle_all(tasks: Sequence[Task], tracks: Mapping[str, Track]) -> dict[str, Track]:
    """Tracks of all objects after the first frame.

    Args:
        tasks: one per object; their tracks and neighbours are not looked at.
        tracks: by object id, each believed at the scene's pose or lost.
    """
    after = dict(tracks)
    for attempt in range(ROUNDS):
        upheld = _uphold(tasks, after)
        if attempt == 0:
            upheld = {k: track for k, track in upheld.items() if track.usual_nats > DOUBTFUL_NATS}
        lost = [task for task in tasks if _id(task) not in upheld]
        for task in lost:
            after[_id(task)] = _lost(after[_id(task)])
        beside = _neighbours(tasks, upheld)
        searched = redetect_all(
            [replace(task, track=after[_id(task)], neighbours=beside) for task in lost]
        )
        after.update(upheld)
        after.update(searched)
        if all(track.state is TrackState.LOST for track in searched.values()):
            break
    return after | _uphold(tasks, after)


def _uphold(tasks: Sequence[Task], tracks: Mapping[str, Track]) -> dict[str, Track]:
    """Tracks of the objects that hold beside those that are better supported.

    Objects of which nothing is seen hold: nothing speaks against them.
    """
    present = [task for task in tasks if tracks[_id(task)].state is not TrackState.LOST]
    upheld: dict[str, Track] = {}
    for task in sorted(present, key=lambda task: -tracks[_id(task)].usual_nats):
        track = tracks[_id(task)]
        support = _support(task, track, _neighbours(tasks, upheld))
        log_odds = support.nats + _log_prior(task, track)
        if log_odds > 0.0:
            upheld[_id(task)] = _weighed(track, log_odds, support)
    return upheld


def _neighbours(tasks: Sequence[Task], tracks: Mapping[str, Track]) -> tuple[Neighbour, ...]:
    return tuple(
        (task.model, tracks[_id(task)].world_from_object) for task in tasks if _id(task) in tracks
    )


def _support(task: Task, track: Track, beside: tuple[Neighbour, ...]) -> PoseSupport:
    scene, model, pose = task.scene, task.model, track.world_from_object
    evidence = gather(scene, model, view_of(scene, model, pose), beside)
    return pose_support(observe(scene, evidence), model, pose, scene.renderer)


def _log_prior(task: Task, track: Track) -> float:
    """Log odds of a pose against being nowhere in view, before anything was seen."""
    stood = task.model.source.world_from_object
    if not is_other(task.model, track.world_from_object, stood):
        return STAYS_NATS
    return moved_log_prior(
        task.scene,
        task.model,
        heights_of(task),
        world_from_last=stood,
        world_from_now=track.world_from_object,
    )


def _weighed(track: Track, log_odds: float, support: PoseSupport) -> Track:
    """The track with the confidence that the picture allows beside the other objects."""
    stays = 1.0 / (1.0 + math.exp(-min(log_odds, 60.0)))
    return replace(track, confidence=min(track.confidence, stays), usual_nats=support.nats)


def _lost(track: Track) -> Track:
    return replace(track, state=TrackState.LOST, confidence=0.0, rest=None, searches_in_vain=0)


def _id(task: Task) -> str:
    return task.model.object_id
