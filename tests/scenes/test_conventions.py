"""Conventions that a reader relies on and a type checker cannot see."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("scenes", "devices", "sim", "tracking", "studio", "benchmarks")
SOURCES = sorted(p for package in PACKAGES for p in (ROOT / package).rglob("*.py"))
POSE_NAME = re.compile(r"\w+_from_\w+", re.IGNORECASE)
# The algebra of poses itself has no frames to name: composing, comparing, filtering.
GENERIC = {
    "scenes/pose.py",
    "studio/evaluate/metrics.py",
    "tracking/baseline/smoothing.py",
    "tracking/solve/motion.py",
}


def relative(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def is_pose(annotation: ast.expr | None) -> bool:
    """`Pose`, `Pose | None` and `"Pose"`, but no containers of poses."""
    if isinstance(annotation, ast.Constant) and isinstance(annotation.value, str):
        annotation = ast.parse(annotation.value, mode="eval").body
    if isinstance(annotation, ast.BinOp):
        return is_pose(annotation.left) or is_pose(annotation.right)
    return isinstance(annotation, ast.Name) and annotation.id == "Pose"


def pose_names(tree: ast.AST) -> list[tuple[int, str]]:
    """Names annotated as poses, but for parameters of private functions.

    Those stay in one file, next to their callers, and are often algebra on any pose.
    """
    private: set[ast.arg] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef) and re.match(r"_(?!_)", node.name):
            arguments = node.args
            private |= {*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs}
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.arg) and node not in private and is_pose(node.annotation):
            found.append((node.lineno, node.arg))
        elif isinstance(node, ast.AnnAssign) and is_pose(node.annotation):
            target = node.target
            name = target.id if isinstance(target, ast.Name) else getattr(target, "attr", "")
            found.append((node.lineno, name))
    return found


def signed_axis(row: ast.expr) -> tuple[int, int] | None:
    """(axis, sign) of a literal row such as `(0, -1, 0)`."""
    if not isinstance(row, ast.Tuple | ast.List) or len(row.elts) != 3:
        return None
    try:
        values = [float(ast.literal_eval(element)) for element in row.elts]
    except (ValueError, TypeError, SyntaxError):
        return None
    if sorted(abs(v) for v in values) != [0.0, 0.0, 1.0]:
        return None
    axis = next(i for i, v in enumerate(values) if v)
    return axis, int(values[axis])


def axis_matrices(tree: ast.AST) -> list[int]:
    """Lines with a literal 3×3 matrix that permutes or flips axes, as rows or as a diagonal."""
    found = []
    for node in ast.walk(tree):
        rows: list[ast.expr] = []
        if isinstance(node, ast.Tuple | ast.List):
            rows = node.elts
        elif isinstance(node, ast.Call):
            rows = node.args
        axes = [signed_axis(row) for row in rows]
        known = [axis for axis in axes if axis is not None]
        permutes = len(axes) == 3 and {axis for axis, _ in known} == {0, 1, 2}
        if permutes and known != [(0, 1), (1, 1), (2, 1)]:
            found.append(node.lineno)
        if isinstance(node, ast.Call) and getattr(node.func, "attr", "") == "diag" and node.args:
            try:
                diagonal = [abs(float(v)) for v in ast.literal_eval(node.args[0])]
                flips = min(float(v) for v in ast.literal_eval(node.args[0])) < 0
            except (ValueError, TypeError, SyntaxError):
                continue
            if flips and set(diagonal) == {1.0}:
                found.append(node.lineno)
    return found


def test_there_is_something_to_look_at():
    assert {"scenes/pose.py", "scenes/frames.py", "devices/messages.py"} <= set(
        map(relative, SOURCES)
    )


@pytest.fixture(scope="module")
def found():
    """Poses' names and lines with axis flips of every source file, by its name."""
    said = {}
    for path in SOURCES:
        tree = ast.parse(path.read_text(encoding="utf-8"))
        said[relative(path)] = pose_names(tree), axis_matrices(tree)
    return said


def test_names_of_poses_say_from_what_to_what(found):
    assert not [
        f"{source}:{line} {name}"
        for source, (names, _) in found.items()
        if source not in GENERIC
        for line, name in names
        if not POSE_NAME.fullmatch(name)
    ]


def test_axis_flips_are_written_in_frames_only(found):
    assert not [
        f"{source}:{line}"
        for source, (_, lines) in found.items()
        if source != "scenes/frames.py"
        for line in lines
    ]


@pytest.mark.parametrize(
    ("code", "found"),
    [
        ("def f(pose: Pose): ...", ["pose"]),
        ("def f(*, camera_pose: Pose | None = None): ...", ["camera_pose"]),
        ("class A:\n    offset: 'Pose'", ["offset"]),
        ("self.offset: Pose = p", ["offset"]),
        ("def f(a: int, b: tuple[Pose, ...]) -> Pose: ...", []),
        ("def __init__(self, pose: Pose): ...", ["pose"]),
        ("def _helper(pose: Pose):\n    first: Pose = pose", ["first"]),
    ],
)
def test_the_name_check_sees_poses(code, found):
    assert [name for _, name in pose_names(ast.parse(code))] == found


@pytest.mark.parametrize(
    ("code", "seen"),
    [
        ("np.diag([1, -1, -1])", True),
        ("np.diag((1.0, -1.0, -1.0, 1.0))", True),
        ("np.array([[1, 0, 0], [0, -1, 0], [0, 0, -1]])", True),
        ("np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]])", True),
        ("_axes((1, 0, 0), (0, -1, 0), (0, 0, -1))", True),
        ("np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1]])", False),
        ("np.array([[1, 0, 0], [0, c, -s], [0, s, c]])", False),
        ("np.array([[1, 0, 0], [1, 0, 0], [0, -1, 0]])", False),
        ("np.diag([2, 3, -1])", False),
    ],
)
def test_the_flip_check_sees_matrices(code, seen):
    assert bool(axis_matrices(ast.parse(code))) == seen
