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
from tracking.follow.redetection import heights_of, redetect_all
from tracking.follow.track import Task, Track
from tracking.hypotheses.hypothesis import CLEAR_NATS, is_other
from tracking.hypotheses.prior import moved_log_prior, stayed_log_prior
from tracking.likelihood.pixel_model import PoseSupport
from tracking.likelihood.pose_likelihood import pose_support

ROUNDS = 4
"""Rounds of searching and weighing at most. In three random rooms no session needed more than
three."""


def settle_all(tasks: Sequence[Task], tracks: Mapping[str, Track]) -> dict[str, Track]:
    """Tracks of all objects after the first frame.

    Args:
        tasks: one per object; their tracks and neighbours are not looked at.
        tracks: by object id, each believed at the scene's pose or lost.
    """
    after = dict(tracks)
    has_left = {_id(task): _has_left(task, after[_id(task)]) for task in tasks}
    for attempt in range(ROUNDS):
        after = _by_the_others(after, has_left)
        upheld = _uphold(tasks, after)
        if attempt == 0:
            # A mug that may still stand where a book lies would keep the book out.
            upheld = {k: t for k, t in upheld.items() if t.usual_nats + t.stays_nats > CLEAR_NATS}
        lost = [task for task in tasks if _id(task) not in upheld]
        for task in lost:
            after[_id(task)] = _lost(after[_id(task)])
        beside = _neighbours(tasks, upheld)
        searched = redetect_all(
            [replace(task, track=after[_id(task)], neighbours=beside) for task in lost]
        )
        after.update(upheld)
        after.update(searched)
        for task in tasks:
            if after[_id(task)].state is not TrackState.LOST:
                has_left[_id(task)] = _has_left(task, after[_id(task)])
        if all(track.state is TrackState.LOST for track in searched.values()):
            break
    after = _by_the_others(after, has_left)
    return after | _uphold(tasks, after)


def _has_left(task: Task, track: Track) -> bool | None:
    """Whether an object is seen elsewhere, or its place is empty; None if the picture is silent."""
    if track.state is TrackState.LOST:
        return True
    if track.usual_nats <= CLEAR_NATS:
        return None
    return is_other(task.model, track.world_from_object, task.model.source.world_from_object)


def _by_the_others(
    tracks: Mapping[str, Track], has_left: Mapping[str, bool | None]
) -> dict[str, Track]:
    """The tracks with the log odds of their places, by how many others have left theirs."""

    def stays_nats(name: str) -> float:
        others = [left for other, left in has_left.items() if other != name]
        return stayed_log_prior(stayed=others.count(False), left=others.count(True))

    return {name: replace(t, stays_nats=stays_nats(name)) for name, t in tracks.items()}


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
        return track.stays_nats
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
