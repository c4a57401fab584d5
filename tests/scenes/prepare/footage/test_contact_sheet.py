from scenes.prepare.footage.capture import CaptureOptions
from scenes.prepare.footage.contact_sheet import GREEN, RED, contact_sheet
from scenes.prepare.footage.gather import gather


def test_frames_without_a_place_are_framed_red(photographed, tmp_path):
    capture = gather(
        photographed.folder, tmp_path, options=CaptureOptions(frames=12, least_frames=3)
    )
    sheet = contact_sheet(capture, failed=(capture.frames[5].name,), columns=4, width_px=80)
    assert sheet.shape == (180, 320, 3)
    corners = sheet[::60, ::80].reshape(-1, 3)
    assert [tuple(c) == RED for c in corners] == [k == 5 for k in range(12)]
    assert sum(tuple(c) == GREEN for c in corners) == 11
