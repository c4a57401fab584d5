import pytest
from hypothesis import given
from hypothesis import strategies as st

from studio.app.model.script import ScriptError, read_script, script_line

values = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(st.characters(exclude_categories=("Cs",))),
    lambda inner: st.lists(inner, max_size=3),
    max_leaves=6,
)


@given(st.dictionaries(st.sampled_from(["x", "object", "path"]), values))
def test_a_written_step_reads_as_the_same_step(arguments):
    line = script_line("twin.move", arguments)
    (step,) = read_script(line.replace("\n", " "), source="test")
    assert step.action_id == "twin.move"
    assert dict(step.values) == arguments


def test_comments_and_empty_lines_are_left_out():
    steps = read_script("# begin\n\ntwin.move object=chair-1 x=0.5  # a note\n", source="test")
    assert [(s.line, s.action_id, dict(s.values)) for s in steps] == [
        (3, "twin.move", {"object": "chair-1", "x": 0.5})
    ]


@pytest.mark.parametrize("line", ["twin.move 3", "twin.move 'x", "twin.move a-b=3"])
def test_a_bad_line_is_named(line):
    with pytest.raises(ScriptError, match=r"tour\.script:2"):
        read_script(f"\n{line}", source="tour.script")
