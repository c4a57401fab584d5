"""The program's own typefaces: every sign it writes is in them, and pages bring them along."""

import re
from pathlib import Path

from PIL import ImageFont

from studio.view.fonts import FACES, FIXED, SYMBOLS, TEXT, font_faces, font_files

STUDIO = Path(__file__).resolve().parents[3] / "studio"
LIMIT_BYTES = 1_500_000


def signs_written():
    """Every character beyond ASCII in what the studio's own code and pages say."""
    kinds = {".py", ".js", ".html", ".j2", ".css", ".toml"}
    texts = (path.read_text(encoding="utf-8") for path in STUDIO.rglob("*") if path.suffix in kinds)
    return {sign for text in texts for sign in text if ord(sign) > 126}


def coverage(path):
    from fontTools.ttLib import TTFont

    return {chr(code) for code in TTFont(path).getBestCmap()}


def test_every_sign_that_is_written_is_in_the_text_or_the_symbols():
    for family in ("AtkinsonHyperlegibleNext", "AtkinsonHyperlegibleMono"):
        held = coverage(FACES / f"{family}-Regular.ttf")
        held |= coverage(FACES / "NexusSymbols-Regular.ttf")
        missing = signs_written() - held
        assert not missing, f"no face of the program has {sorted(missing)}: choose other signs"


def test_families_are_named_as_the_files_name_themselves():
    names = {ImageFont.truetype(str(path)).getname()[0] for path in font_files()}
    assert names == {TEXT, FIXED, SYMBOLS}


def test_a_figure_space_is_as_wide_as_a_digit():
    from fontTools.ttLib import TTFont

    symbols = TTFont(FACES / "NexusSymbols-Regular.ttf")
    space = symbols["hmtx"][symbols.getBestCmap()[0x2007]][0]
    for weight in ("Regular", "Bold"):
        text = TTFont(FACES / f"AtkinsonHyperlegibleNext-{weight}.ttf")
        assert {text["hmtx"][f"{digit}.tf"][0] for digit in ("zero", "one", "eight")} == {space}


def test_the_files_are_small_and_their_licence_lies_beside_them():
    assert sum(path.stat().st_size for path in font_files()) < LIMIT_BYTES
    licence = (FACES / "OFL.txt").read_text(encoding="utf-8")
    assert "SIL OPEN FONT LICENSE Version 1.1" in licence


def test_pages_bring_the_faces_along():
    faces = font_faces()
    assert re.findall(r"font-weight: (\d+)", faces) == ["400", "700"]
    assert f'"{TEXT}"' in faces
    assert "http" not in faces
