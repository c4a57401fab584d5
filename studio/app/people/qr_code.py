"""An address as a QR code for the camera of a phone or headset."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

QUIET = 4
"""Modules of white around the code, as its standard (ISO/IEC 18004) asks for."""


@lru_cache(maxsize=4)
def qr_modules(text: str) -> NDArray[np.bool_]:
    """Return (N, N) whether each module of a text's QR code is dark, with white around.

    Raises:
        ValueError: the text is empty or too long for one.
    """
    import zxingcpp

    if not text:
        raise ValueError("qr code: the text is empty")
    library: Any = zxingcpp
    code = library.create_barcode(text, library.BarcodeFormat.QRCode, ec_level="M")
    picture = library.write_barcode_to_image(code, scale=1, add_quiet_zones=False)
    dark = np.pad(np.array(picture) < 128, QUIET)
    dark.setflags(write=False)
    return dark
