"""QR codes, read back by a reader."""

import numpy as np
import pytest
import zxingcpp

from studio.app.people.invitation_view import QUIET, qr_modules

URL = "https://192.168.178.101:58443/#code=123456"


def test_a_reader_reads_the_address():
    modules = qr_modules(URL)
    picture = np.where(np.kron(modules, np.ones((4, 4), bool)), 0, 255).astype(np.uint8)
    assert [found.text for found in zxingcpp.read_barcodes(picture)] == [URL]
    assert not modules[:QUIET].any()
    assert not modules[:, -QUIET:].any()


def test_of_nothing_there_is_none():
    with pytest.raises(ValueError, match="empty"):
        qr_modules("")
