import cv2
import numpy as np
import pytest
import zxingcpp

from scenes.prepare.align.codes.symbols import april_tag, qr_symbol, symbol_of


def read(picture):
    (barcode,) = zxingcpp.read_barcodes(np.ascontiguousarray(picture))
    return barcode


@pytest.mark.parametrize("payload", ["room:1", "HELLO 42", "https://example.org/a/long/path?x=1"])
@pytest.mark.parametrize("level", ["L", "M", "Q", "H"])
def test_a_printed_symbol_reads_back_and_is_found_again(payload, level):
    symbol = qr_symbol(payload, level=level)
    barcode = read(symbol.picture(module_px=5))
    assert barcode.text == payload
    again = symbol_of(barcode)
    assert again is not None
    np.testing.assert_array_equal(again.dark, symbol.dark)


def test_another_encoder_with_wrong_modules_is_met_exactly():
    """OpenCV's encoder takes other options, and a stain hides two modules."""
    printed = cv2.QRCodeEncoder.create().encode("nexus:lab:1")
    rows = np.flatnonzero((printed < 128).any(axis=1))
    wanted = printed[rows[0] : rows[-1] + 1, rows[0] : rows[-1] + 1] < 128
    stained = np.pad(wanted, 4)
    stained[-6:-4, -6] ^= True
    picture = np.kron(np.where(stained, 20, 230), np.ones((6, 6), int)).astype(np.uint8)
    symbol = symbol_of(read(picture))
    assert symbol is not None
    np.testing.assert_array_equal(symbol.dark, wanted)


def test_an_unknown_packing_is_taken_as_seen():
    """OpenCV marks text beyond Latin with a prefix that our writer leaves out."""
    printed = cv2.QRCodeEncoder.create().encode("Büro 好")
    picture = np.kron(np.pad(printed, 4, constant_values=255), np.ones((6, 6), np.uint8))
    symbol = symbol_of(read(picture))
    assert symbol is not None
    assert symbol.payload == "Büro 好"
    rows = np.flatnonzero((printed < 128).any(axis=1))
    np.testing.assert_array_equal(
        symbol.dark, printed[rows[0] : rows[-1] + 1, rows[0] : rows[-1] + 1] < 128
    )


@pytest.mark.parametrize("turns", [0, 1, 2, 3])
def test_a_mirrored_symbol_is_no_symbol(turns):
    picture = np.rot90(qr_symbol("room:1").picture(module_px=5), turns)
    assert symbol_of(read(picture)) is not None
    assert symbol_of(read(picture[:, ::-1])) is None


@pytest.mark.parametrize("payload", ["room:1", "Büro 好", "x" * 200])
def test_a_mirrored_symbol_of_another_encoder_is_no_symbol(payload):
    printed = cv2.QRCodeEncoder.create().encode(payload)
    picture = np.kron(np.pad(printed, 4, constant_values=255), np.ones((6, 6), np.uint8))
    assert symbol_of(read(picture)) is not None
    assert symbol_of(read(picture[:, ::-1])) is None


def test_april_tags_have_a_black_border_and_are_detected():
    symbol = april_tag(17)
    assert symbol.modules == 8
    assert symbol.dark[0].all()
    assert symbol.dark[:, -1].all()
    family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    found = cv2.aruco.ArucoDetector(family).detectMarkers(symbol.picture(module_px=10))[1]
    assert found.ravel().tolist() == [17]


@pytest.mark.parametrize("number", [-1, 587])
def test_a_tag_that_is_not_there_is_refused(number):
    with pytest.raises(ValueError, match="0 to 586"):
        april_tag(number)


def test_a_payload_that_does_not_fit_is_refused():
    with pytest.raises(ValueError, match="shorten"):
        qr_symbol("x" * 4000)
