"""Measures of a tester's day: the simulator, faults, comparing, exporting."""

from __future__ import annotations

import hashlib
import json
import sys
import time
from pathlib import Path
from typing import Any

from benchmarks.studio.shown import has_picture, shown_window
from studio.console.rows import Row, at_least, at_most

SPEED_BAR_HZ, COMPARE_BAR_S, REPORT_CLICKS_BAR, GLUE_BAR = 5.0, 60.0, 3, 30
RELOAD_BAR_S = 5.0
"""A plug-in is there so soon after it was saved: a look at the folder a second, and its run."""

SEED = 7
SPEED = """# What the simulator's speed is measured with: the table's picture, 960 × 480.
room = "lab"
duration_s = 4.0

[camera]
fps = 5
lens_size_px = 480
bitrate_mbps = 6.0

[[people]]
id = "local-user"
start = [-1.25, 1.5]
facing_deg = -40.0
actions = [{ do = "push", object = "chair-1", to = [-0.45, 0.4] }]
"""
FAULTY = """# One fault at a time.
room = "lab"
duration_s = 1.0

[camera]
fps = 5
lens_size_px = 64
bitrate_mbps = 1.0

[[people]]
id = "ann"
start = [-1.25, 1.5]
facing_deg = -40.0
actions = [{ do = "stand", seconds = 1.0 }]

[faults]
"""
FAULT_LINES = {
    "blur": "blur = { px = 3.0 }",
    "bump": "bump_s = 0.5",
    "burst": "burst = { lasts_s = 0.3, from_s = 0.3 }",
    "clock_drift": "clock_drift_ppm = 200.0",
    "delay": "delay_ms = 80.0",
    "exposure": "exposure = { ev = -1 }",
    "freeze": "freeze = { from_s = 0.3, to_s = 0.6 }",
    "headset_off": 'headset_off = { person = "ann" }',
    "hidden_code": "hidden_code = {}",
    "loss": "drop_share = 0.5",
    "occluder": 'occluder = { object = "chair-1", share = 0.5 }',
    "twins": 'twins = { object = "chair-1", at = [0.3, 0.2] }',
    "white_balance": "white_balance = { warmth = 0.3 }",
}
"""A line of `[faults]` for each that there is."""

PLUG_IN = '''"""Says how many objects the room has."""


def register(studio):
    studio.action("measured.count", "Count", lambda: None)
'''


def generating(folder: Path) -> list[Row]:
    """T1, T3: the same seed gives the same bytes; faults of a scenario are in the truth."""
    from scenes.samples import sample_room
    from sim.rehearsal import simulate
    from sim.scenarios.scenario import parse_scenario

    room, scenario = sample_room("lab"), parse_scenario(SPEED, source="speed")

    def hashed(seed: int) -> tuple[str, float, int]:
        digest, frames, begin = hashlib.sha256(), 0, time.perf_counter()
        for step in simulate(room, scenario, seed=seed):
            digest.update(step.packet.data)
            for key, pose in step.truth.recorded.world_from_object.items():
                digest.update(key.encode() + pose.matrix().tobytes())
            frames += 1
        return digest.hexdigest(), time.perf_counter() - begin, frames

    first, took_s, frames = hashed(SEED)
    again, _, _ = hashed(SEED)
    other, _, _ = hashed(SEED + 1)
    return [
        at_most("studio.T1.different_with_the_same_seed", int(first != again), "", bar=0),
        at_least("studio.T1.different_with_another_seed", int(first != other), "", bar=1),
        at_least("studio.T1.frames_per_s", frames / took_s, "1/s", bar=SPEED_BAR_HZ),
        *_fault_rows(folder),
    ]


def _fault_rows(folder: Path) -> list[Row]:
    """Every fault by itself, against what truth and events say of it."""
    from scenes.samples import sample_room
    from sim.faults.settings import LINES, NUMBERS
    from sim.rehearsal import simulate
    from sim.scenarios.scenario import parse_scenario

    room, unseen = sample_room("lab"), []
    for name, line in FAULT_LINES.items():
        (folder / f"{name}.toml").write_text(FAULTY + line + "\n", encoding="utf-8")
        scenario = parse_scenario(FAULTY + line, source=name)
        steps = list(simulate(room, scenario, seed=SEED))
        named = any(step.truth.recorded.faults for step in steps)
        kinds = {event.kind for step in steps for event in step.events}
        if not named and not kinds & {"bumped", "dropped", "fault"}:
            unseen.append(name)
    if unseen:
        print(f"faults that nothing shows: {', '.join(unseen)}", file=sys.stderr)
    return [
        at_most("studio.T3.unseen_faults", len(unseen), "", bar=0),
        at_least("studio.T3.faults", len(FAULT_LINES), "", bar=len(NUMBERS) + len(LINES)),
    ]


def judging(folder: Path) -> list[Row]:
    """T5, T7, T9: two runs are compared, the first failure is gone to, both are exported."""
    from studio.compare.comparison import read_comparison
    from studio.compare.page import write_comparison
    from studio.console.progress import Progress
    from studio.rehearsal import perform
    from studio.session.plan import SessionPlan

    for name, seed in (("a", 0), ("b", 1)):
        plan = SessionPlan(scenario="lab-short", methods=("own",), seed=seed)
        perform(plan, folder / name, progress=Progress(lambda _text, _final: None))
    begin = time.monotonic()
    comparison = read_comparison(folder / "a", folder / "b", tolerance=0.1)
    write_comparison(comparison, folder / "comparison.html")
    compared_s = time.monotonic() - begin
    clicks, found_s = _first_failure(folder / "a")
    return [
        at_most("studio.T5.compare_s", compared_s, "s", bar=COMPARE_BAR_S),
        at_least("studio.T5.rows", len(comparison.rows), "", bar=1),
        at_most("studio.T7.clicks", clicks, "", bar=REPORT_CLICKS_BAR),
        Row("studio.T7.seconds", found_s, "s"),
        at_most("studio.T9.mcap_problems", _mcap_problems(folder / "a"), "", bar=0),
        at_most("studio.T9.usd_problems", _usd_problems(folder / "room.usdc"), "", bar=0),
    ]


def _first_failure(rehearsal: Path) -> tuple[int, float]:
    """Clicks and seconds from a report to the camera's picture at the first failure."""
    window, wait = shown_window("lab")
    wait(lambda: window.is_filled and has_picture(window))
    bench, begin = window.bench, time.monotonic()
    bench.perform("timeline.open", path=str(rehearsal))
    wait(lambda: bench.actions.get("timeline.first_failure").is_available)
    bench.perform("timeline.first_failure")
    bench.perform("timeline.step")
    wait(lambda: bench.camera_picture is not None)
    window.close()
    return 3, time.monotonic() - begin


def _mcap_problems(rehearsal: Path) -> int:
    """Messages of a recording that are not what the JSON schemas beside them say."""
    from jsonschema import Draft202012Validator
    from mcap.reader import make_reader

    problems, validators = 0, {}
    with (rehearsal / "recording.mcap").open("rb") as file:
        for schema, _channel, message in make_reader(file).iter_messages():
            assert schema is not None
            if schema.id not in validators:
                validators[schema.id] = Draft202012Validator(json.loads(schema.data))
            problems += not validators[schema.id].is_valid(json.loads(message.data))
    return problems


def _usd_problems(path: Path) -> int:
    """Properties of the exported room that OpenUSD's schema does not know, or no splats at all."""
    import pxr.Usd

    from scenes.formats.registry import write_splats
    from scenes.opening import open_scene

    write_splats(path, open_scene("desk").room)
    usd: Any = pxr.Usd  # it has no types
    stage = usd.Stage.Open(str(path))
    splats = [p for p in stage.Traverse() if p.GetTypeName() == "ParticleField3DGaussianSplat"]
    problems = int(not splats) + int(stage.GetMetadata("upAxis") != "Z")
    for prim in splats:
        known = set(prim.GetPrimDefinition().GetPropertyNames())
        problems += sum(p.GetName() not in known for p in prim.GetAuthoredProperties())
    return problems


def plug_in(folder: Path) -> list[Row]:
    """T8: a plug-in is saved, and saved again with a mistake in it, beside an open window."""
    plugins = folder / "home" / "plugins"
    plugins.mkdir(parents=True)
    window, wait = shown_window("desk", home=folder / "home")
    wait(lambda: window.is_filled and has_picture(window))
    bench, path, begin = window.bench, plugins / "measured.py", time.monotonic()
    path.write_text(PLUG_IN, encoding="utf-8")
    wait(lambda: "measured.count" in bench.actions)
    loaded_s = time.monotonic() - begin
    lines = bench.log.count
    path.write_text(PLUG_IN + "\n1 / 0\n", encoding="utf-8")
    wait(lambda: bench.log.count > lines)
    said = any("measured.py" in line.text for line in bench.log.lines("error"))
    alive = bench.do("view.orbit", yaw_deg=1.0)
    window.close()
    glue = sum(bool(line.strip()) for line in PLUG_IN.splitlines())
    return [
        at_most("studio.T8.reload_s", loaded_s, "s", bar=RELOAD_BAR_S),
        at_most("studio.T8.lines", glue, "", bar=GLUE_BAR),
        at_least("studio.T8.error_said_and_alive", int(said and alive), "", bar=1),
    ]
