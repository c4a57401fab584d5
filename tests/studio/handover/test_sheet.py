from dataclasses import replace
from datetime import UTC, datetime

import pytest

from devices.session_info import ForkOrigin, ScenarioChange
from studio.console.rows import Row
from studio.handover.share import write_stills
from studio.handover.sheet import name_text, read_rows, sheet_html, sheet_markdown, sheet_of


def make(info, rows, **given):
    values = {
        "recorded": datetime(2026, 11, 25, 7, 26, tzinfo=UTC),
        "seconds": 2.9,
        "frames": 30,
        "events": [(790, "pushes <chair> | 1")],
        "pictures": [],
        "notes": [],
    }
    return sheet_of(info, rows, **{**values, **given})


ROWS = [
    Row("rehearse.chairs.world_cm.mean", 7.083, "cm", 9.9, True),
    Row("rehearse.chairs.yaw_deg.mean", 12.5, "deg", 5.7, False),
    Row("rehearse.frames", 30.0, ""),
    Row("rehearse.object.chair-1.yaw_deg.p95", 3.0, "deg"),
    Row("stage.track.ms.p50", 3.0, "ms"),
]


def test_it_says_what_was_played_when_and_how_it_went(lab_info):
    text = sheet_markdown(make(lab_info, ROWS))

    assert text.startswith("# tiny · tiny-push\n")
    assert "**1 of 2 figures miss their limit: chairs, yaw, mean**" in text
    assert "| when | 2026-11-25 07:26 UTC |" in text
    assert "| seed | 0 |" in text
    assert "| versions | gaussiannexus-studio 0.1.0 |" in text
    assert "| chairs, position, mean | 7.08 cm | 9.9 cm | ✓ pass |" in text
    assert "| chairs, yaw, mean | 12.50 ° | 5.7 ° | ✗ fail |" in text
    assert "- 0.8 s: pushes <chair> \\| 1" in text
    assert "chair-1" not in text
    assert "track" not in text.split("## Figures")[1]


def test_changes_while_it_ran_are_listed(lab_info):
    info = replace(
        lab_info,
        changes=(ScenarioChange(500_000_000, "", "other"),),
        fork=ForkOrigin("recording.mcap", "ab" * 32, 400_000_000),
    )

    sheet = make(info, ROWS)

    assert sheet.title == "tiny · tiny-push → other"
    assert sheet.changes == (
        "0.4 s: forked from recording.mcap (sha256 abababababababab)",
        "0.5 s: the session went on with other",
    )
    assert "## Changes" in sheet_markdown(sheet)
    assert "the session went on with other" in sheet_html(sheet)


def test_the_page_is_one_file_with_its_pictures_inside(lab_info, rehearsed, tmp_path):
    pictures = write_stills(rehearsed / "rehearsal.mp4", tmp_path / "pictures", 4)
    sheet = make(lab_info, ROWS, pictures=pictures)

    html = sheet_html(sheet)

    assert len(pictures) == 4
    assert [t_s for t_s, _path in pictures] == sorted({t_s for t_s, _path in pictures})
    assert html.count('src="data:image/jpeg;base64,') == 4
    assert "http" not in html
    assert "pushes &lt;chair&gt;" in html
    assert sheet_markdown(sheet).count("](pictures/") == 4


def test_a_film_that_cannot_be_decoded_is_named(tmp_path):
    (tmp_path / "film.mp4").write_bytes(b"no film" * 100)

    with pytest.raises(ValueError, match=r"film\.mp4: damaged film"):
        write_stills(tmp_path / "film.mp4", tmp_path / "pictures", 2)


@pytest.mark.parametrize("text", ["", "[]", '{"rows": 3}', '{"rows": [{"name": "a"}]}'])
def test_a_damaged_report_is_named(text, tmp_path):
    (tmp_path / "report.json").write_text(text)

    with pytest.raises(ValueError, match=r"report\.json: damaged"):
        read_rows(tmp_path / "report.json")


def test_figures_have_names_that_people_use():
    assert name_text(ROWS[0]) == "chairs, position, mean"
    assert name_text(Row("rehearse.paper.objects.yaw_deg.p95", 1.0, "deg")) == (
        "the paper's method, all moved objects, yaw, 95 % below"
    )
