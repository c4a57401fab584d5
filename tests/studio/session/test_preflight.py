"""The checks before a session: a verdict each, whatever a device does."""

import json
import threading

from studio.session.preflight import Check, checks_for, run_checks, save_checks, worst


def test_this_machine_can_run_a_session(tmp_path):
    checks = run_checks(checks_for(recordings=tmp_path / "new" / "out"))
    assert [check.name for check in checks] == [
        "camera",
        "tracker",
        "disk space",
        "clock",
        "recordings",
        "OpenGL",
        "splat engine",
        "memory",
        "display",
    ]
    failed = {check.name for check in checks if check.verdict == "FAIL"}
    assert not failed & {"camera", "tracker", "recordings", "splat engine", "OpenGL"}, checks


def test_an_unplugged_camera_and_an_unknown_tracker_are_named_with_what_to_do(tmp_path):
    probes = checks_for(recordings=tmp_path, source=tmp_path / "insta.mp4", method="magic")
    camera, tracker = run_checks({name: probes[name] for name in ("camera", "tracker")})
    assert (camera.verdict, tracker.verdict) == ("FAIL", "FAIL")
    assert "insta.mp4 is not there" in camera.what
    assert "own, paper" in tracker.fix


def test_a_folder_that_cannot_be_written_into_fails(tmp_path):
    (tmp_path / "file").write_text("")
    probes = checks_for(recordings=tmp_path / "file" / "out")
    (check,) = run_checks({"recordings": probes["recordings"]})
    assert check.verdict == "FAIL"
    assert str(tmp_path / "file") in check.what


def test_a_probe_that_raises_or_hangs_is_a_line_and_not_a_traceback():
    free = threading.Event()

    def hang():
        free.wait(30)
        return Check("tripod", "PASS", "late")

    def broken():
        raise OSError("usb:3\n gone")

    checks = run_checks(
        {"lens": broken, "tripod": hang, "ok": lambda: Check("ok", "PASS", "here")}, limit_s=0.5
    )
    free.set()
    assert [(c.name, c.verdict) for c in checks] == [
        ("lens", "FAIL"),
        ("tripod", "FAIL"),
        ("ok", "PASS"),
    ]
    assert checks[0].what == "usb:3 gone"
    assert all(check.fix for check in checks[:2])
    assert worst(checks) == "FAIL"


def test_checks_are_saved_as_json(tmp_path):
    save_checks([Check("disk", "WARN", "2 GiB", "free some")], tmp_path / "new" / "preflight.json")
    saved = json.loads((tmp_path / "new" / "preflight.json").read_text())
    assert saved["checks"] == [
        {"name": "disk", "verdict": "WARN", "what": "2 GiB", "fix": "free some"}
    ]
