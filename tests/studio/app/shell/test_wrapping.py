"""A row that goes on in the next line where it does not fit."""

import pytest

from studio.console.display import why_no_window

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]


@pytest.mark.parametrize("width", [90, 150, 240, 800])
def test_all_of_it_is_inside_and_none_over_another(qapp, width):
    from PySide6.QtWidgets import QPushButton, QSizePolicy, QWidget

    from studio.app.shell.wrapping import WrappingRow

    whole = QWidget()
    buttons = [QPushButton("abc") for _ in range(4)]
    for button in buttons:
        button.setFixedWidth(80)
    grows = buttons[1]
    grows.setMinimumWidth(40)
    grows.setMaximumWidth(10_000)
    grows.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
    row = WrappingRow(buttons, gap_px=6)
    whole.setLayout(row)
    row.setContentsMargins(5, 3, 5, 3)
    whole.resize(width, row.heightForWidth(width))
    whole.show()
    qapp.processEvents()
    areas = [button.geometry() for button in buttons]
    assert all(whole.rect().contains(area) for area in areas)
    for at, area in enumerate(areas):
        assert not any(area.intersects(other) for other in areas[:at])
    lines = {area.top() for area in areas}
    assert len(lines) == {90: 4, 150: 3, 240: 2, 800: 1}[width]
    if width == 800:  # the one that can grow takes what is free
        assert areas[-1].right() == width - 5 - 1
        assert row.minimumSize().width() == 90
