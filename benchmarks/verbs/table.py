"""The table of verbs that measure: the command line adds it to its own in a checkout."""

from __future__ import annotations

from studio.verbs.verb import Verb

VERBS = (
    Verb(
        "evaluate preparation",
        "benchmarks.verbs.evaluate.preparation",
        "film a built-in room, prepare it and hold the result against the truth",
        "nexus evaluate preparation lab --json",
    ),
    Verb(
        "evaluate dataset",
        "benchmarks.verbs.evaluate.dataset",
        "take a folder of photos and 360° pictures with exact truth through prepare, cut and track",
        "nexus evaluate dataset room_c --out out/room_c",
    ),
    Verb(
        "evaluate twin",
        "benchmarks.verbs.evaluate.twin",
        "rehearse a dataset's courses in its own scan, and compare with what was measured there",
        "nexus evaluate twin room_c --out out/room_c",
    ),
    Verb(
        "evaluate random-rooms",
        "benchmarks.verbs.evaluate.random_rooms",
        "track objects of many kinds in rooms by seed, and say where it fails",
        "nexus evaluate random-rooms --seeds 100-107",
    ),
    Verb(
        "evaluate cuts",
        "benchmarks.verbs.evaluate.cuts",
        "cut objects out of rooms by seed that a simulated phone filmed, against true meshes",
        "nexus evaluate cuts --seeds 100-107 --captures out/cuts",
    ),
    Verb(
        "evaluate",
        "benchmarks.verbs.evaluate.tables",
        "hold the tracker against the truth, with the paper's method on the same frames",
        "nexus evaluate room --method paper --seeds 5 --plot",
    ),
    Verb(
        "bench raster",
        "benchmarks.raster.raster",
        "measure the splat renderer",
        "nexus bench raster --json",
    ),
    Verb(
        "bench likelihood",
        "benchmarks.verbs.bench.likelihood",
        "weigh true, wrong and covered poses of labelled pictures",
        "nexus bench likelihood --seeds 100-107",
    ),
    Verb(
        "bench proposals",
        "benchmarks.verbs.bench.proposals",
        "look for what people move around where it was known",
        "nexus bench proposals --seeds 100-107",
    ),
    Verb(
        "bench filter",
        "benchmarks.verbs.bench.filter",
        "measure how long what people move is reported wrongly",
        "nexus bench filter --seeds 100-107",
    ),
    Verb(
        "bench headset",
        "benchmarks.verbs.bench.headset",
        "measure the shared origin of a headset that is walked about",
        "nexus bench headset --walks 5",
    ),
    Verb(
        "bench studio",
        "benchmarks.verbs.bench.studio",
        "measure the window: opening, drawing, answering, seeking, what a kill costs",
        "nexus bench studio --json",
    ),
    Verb(
        "bench physics",
        "benchmarks.twin.physics",
        "measure the physics of a scanned room",
        "nexus bench physics --quick",
    ),
    Verb(
        "bench twin",
        "benchmarks.twin.twin",
        "measure the digital twin: its camera, its physics, its forks",
        "nexus bench twin --json",
    ),
    Verb(
        "bench files",
        "benchmarks.files",
        "try small files as people bring them, and count those that come out right",
        "nexus bench files --json",
    ),
    Verb(
        "bench parsers",
        "benchmarks.verbs.bench.parsers",
        "give hostile bytes to every parser that a network reaches, and count those that fail",
        "nexus bench parsers --json",
    ),
    Verb(
        "bench hub",
        "benchmarks.verbs.bench.hub",
        "let many people into a session on loopback, then hostile ones: latency, memory, crashes",
        "nexus bench hub --clients 16 --json",
    ),
    Verb(
        "bench hololens",
        "benchmarks.verbs.bench.hololens",
        "receive a simulated HoloLens on loopback: delays, its clock, hostile bytes both ways",
        "nexus bench hololens --json",
    ),
    Verb(
        "bench sites",
        "benchmarks.verbs.bench.sites",
        "measure rooms, sites and a router on loopback, and reckon a building of a thousand rooms",
        "nexus bench sites --rooms 1 4 16 --json",
    ),
)
