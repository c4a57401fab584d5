"""How many splats the page draws, in the browser: by times that are given, and with real splats."""

import pytest

READY = "document.documentElement?.dataset.state === 'ready'"

FAKE = """
const changes = [];
const spark = {};
const mesh = { numSplats: 1000, createLodSplats: async () => { mesh.hasTree = true; } };
const detail = new Detail(spark, () => changes.push(1));
let now = 0;
const play = async (count, ms, more = {}) => {
  for (let i = 0; i < count; i++) {
    now += ms;
    detail.before(now, { isMoving: true, wantedMs: 20, isLast: true, ...more });
    await null;
  }
  return [mesh.enableLod, spark.lodSplatCount ?? null, detail.share];
};
"""


@pytest.fixture
def played(page, hub, assets):
    """A function that plays pictures to a `Detail` of a thousand splats."""
    page.visit(f"{hub.url}check", width=400, height=300)
    page.wait_for(READY)
    address = next(path for path in assets if path.startswith("/assets/shared/detail-"))

    def play(body):
        script = f"const {{ Detail }} = await import('{address}'); {FAKE} {body}"
        return page.evaluate(f"(async () => {{ {script} }})()")

    return play


def test_a_computer_that_keeps_up_draws_all_of_them(played):
    found = played("detail.watch(mesh); return [await play(500, 20), mesh.hasTree ?? false]")
    assert found == [[False, None, 1], False]


def test_pictures_that_come_late_have_fewer_splats_until_they_come_in_time(played):
    fewer, fewest, more, whole = played(
        "detail.watch(mesh);"
        "return [await play(16, 40), await play(500, 40), await play(95, 20), await play(3000, 20)]"
    )
    assert fewer == [True, 750, 0.75]
    assert fewest == [True, 120, 0.12]
    assert more[1] == 144
    assert whole[0] is False
    assert whole[2] == 1


def test_a_hiccup_changes_nothing(played):
    found = played(
        "detail.watch(mesh); await play(8, 40); await play(8, 20); return await play(8, 40)"
    )
    assert found == [False, None, 1]


def test_coarser_pixels_come_first(played):
    assert played("detail.watch(mesh); return await play(99, 40, { isLast: false })")[2] == 1


def test_at_rest_all_are_drawn(played):
    found, asked = played(
        "detail.watch(mesh); await play(30, 40);"
        "return [await play(1, 900, { isMoving: false }), changes.length]"
    )
    assert found[0] is False
    assert asked == 1


def test_spark_draws_fewer_of_a_room_and_then_all_again(page, hub):
    page.visit(hub.invite().url, width=300, height=200)
    page.wait_for("document.documentElement?.dataset.state === 'join'")
    page.evaluate("document.getElementById('name').value = 'Ada'")
    page.evaluate("document.getElementById('join-button').click()")
    page.wait_for(READY)
    page.wait_for("live.isWhole()")
    page.evaluate("live.detail.watch(live.room.solid); window.all = live.room.solid.numSplats")
    page.evaluate(
        "window.slow = setInterval(() => { const d = live.detail;"
        " for (let i = 0; i < 13; i++) d.before(d.at + 999,"
        " { isMoving: true, wantedMs: 20, isLast: true });"
        " live.room.render(); }, 50)"
    )
    page.wait_for("live.room.solid.numSplats < 0.3 * all")
    page.evaluate(
        "clearInterval(slow);"
        " live.detail.before(live.detail.at + 999, { isMoving: false }); live.room.render()"
    )
    page.wait_for("live.room.render(), live.room.solid.numSplats === all")
    assert [words for words in page.messages if not words.startswith("log: Tiny LoD")] == []
