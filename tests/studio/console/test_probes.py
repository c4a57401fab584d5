"""The probes name what is missing and what to do about it."""

from __future__ import annotations

from pathlib import Path

from studio.console import probes
from studio.console.extras import EXTRAS


def test_a_wrong_and_an_absent_package_are_named_with_their_pin(tmp_path: Path) -> None:
    pins = tmp_path / "run.txt"
    pins.write_text(
        "numpy==0.0.1 \\\n    --hash=sha256:00\n"
        "no-such-package==1.0 \\\n    --hash=sha256:00\n"
        "pyobjc-core==13.0 ; sys_platform == 'darwin' \\\n"
    )

    (finding,) = probes.packages(pins)

    assert finding.state == "missing"
    assert "(pinned 0.0.1)" in finding.detail
    assert "no-such-package absent (pinned 1.0)" in finding.detail
    assert "pyobjc" not in finding.detail, "packages of other systems are not ours to miss"
    assert finding.remedy == "./nexus setup"


def test_this_machine_can_draw_off_screen_and_encode_video() -> None:
    assert probes.offscreen_drawing().state == "ok"
    assert probes.h264().state == "ok"


def test_an_installed_program_names_its_own_packages_and_its_extras() -> None:
    wanted = ("numpy>=1", "jinja2==0.0.1", "no-such-package", 'PySide6 ; extra == "studio"')

    first, *extras = probes.installed_packages(wanted)

    assert first.state == "missing"
    assert "no-such-package absent" in first.detail
    assert "(wanted ==0.0.1)" in first.detail
    assert "numpy" not in first.detail
    assert "PySide6" not in first.detail
    assert {finding.subject for finding in extras} == {f"extra {name}" for name in EXTRAS}
