import errno
import json
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.writer import IndexType, Writer

from devices import recording
from devices.clock import ManualClock
from devices.messages import EncodedFrame, Event, VoicePacket
from devices.recorded.index import is_whole
from devices.recorded.people import (
    RecordedAnnotation,
    RecordedAvatar,
    RecordedAvatarGone,
    RecordedPrimitive,
    RecordedProposal,
    RecordedSurface,
)
from devices.recording import (
    Recorder,
    RecordingError,
    RecordingReader,
    read_recording,
    read_session,
)
from devices.recording_codec import FrameStamp, RecordedTrack, RecordedTruth, encode_message
from devices.replay import ReplayCamera
from devices.session_info import (
    ForkOrigin,
    ScenarioChange,
    SessionInfo,
    session_from_json,
    session_to_json,
)
from devices.streams import BoundedQueue, ByteQuota
from devices.video import H264Decoder, H264Encoder
from scenes.cameras import Fisheye, Rig
from scenes.frames import FRONT_FROM_BACK_LENS
from scenes.pose import Pose, rotation_from_vector
from scenes.state import (
    Annotation,
    Avatar,
    AvatarGone,
    LiveSurface,
    Proposal,
    SharedPrimitive,
    TrackedObject,
    TrackState,
)

SIZE, FRAMES = 96, 6
LENS = Fisheye.from_fov(SIZE, np.radians(200))
RIG = Rig((LENS, LENS), (Pose.identity(), FRONT_FROM_BACK_LENS))
SESSION = SessionInfo(
    scene="lab",
    scene_hash="abc",
    seed=7,
    scenario="[scenario]\n",
    scenario_name="lab-short",
    mode="exact",
    methods=("own", "paper"),
    versions={"gaussiannexus-studio": "0.1.0"},
    rig=RIG,
    fps=10.0,
)


FORKED = replace(
    SESSION,
    changes=(ScenarioChange(1_200_000_000, "room = 'lab'\n", "calm"),),
    fork=ForkOrigin("recording.mcap", 64 * "a", 1_200_000_000),
)


def test_where_a_fork_comes_from_is_written_and_read():
    assert plain(session_from_json(session_to_json(FORKED))) == plain(FORKED)


def test_a_session_written_before_there_were_forks_is_read():
    fields = json.loads(session_to_json(FORKED))
    del fields["changes"], fields["fork"]
    assert plain(session_from_json(json.dumps(fields))) == plain(SESSION)


def random_pose(rng):
    return Pose(rotation_from_vector(rng.normal(size=3)), rng.normal(size=3))


def messages(seed=0):
    rng = np.random.default_rng(seed)
    encoder = H264Encoder(2 * SIZE, SIZE, 10, 2_000_000)
    out = []
    for seq in range(FRAMES):
        t_ns = seq * 100_000_000 + 1
        pose = random_pose(rng)
        picture = rng.integers(0, 256, (SIZE, 2 * SIZE, 3)).astype(np.uint8)
        out += [
            RecordedAnnotation(
                t_ns, Annotation("maya-1", "maya", rng.normal(size=(3, 3)), (1.0, 0.25, 1 / 3))
            ),
            RecordedAnnotation(t_ns, Annotation("ben-1", "ben", np.zeros((0, 3)), (0.0, 0.5, 1.0))),
            RecordedAnnotation(
                t_ns,
                Annotation(
                    "ben-2",
                    "ben",
                    np.ones((2, 3)),
                    (0.0, 0.5, 1.0),
                    "chair-1",
                    Pose.from_yaw(0.5, (1.0, 2.0, 0.0)),
                ),
            ),
            RecordedAvatar(
                t_ns, Avatar("maya", "remote", pose, (rng.normal(size=(5, 3)),), np.eye(3)[:2])
            ),
            RecordedAvatar(
                t_ns, Avatar("ben", "remote", pose, (np.zeros((0, 3)), rng.normal(size=(25, 3))))
            ),
            RecordedAvatar(t_ns, Avatar("p1", "local", pose, name="Zoë")),
            RecordedAvatarGone(t_ns, AvatarGone("ann")),
            FrameStamp(
                "camera-360", seq, t_ns, t_ns + 5, pose, (8.5,) * seq, (None, False, True)[seq % 3]
            ),
            *encoder.encode(picture, seq, t_ns),
            Event(t_ns, "scenario", "push", "chair-1 is pushed"),
            RecordedPrimitive(
                t_ns, SharedPrimitive("p1/b", "p1", "arrow", (1 / 3, 0.1, 0.2), (1, 0, 1 / 7), pose)
            ),
            RecordedPrimitive(t_ns, SharedPrimitive("p1/d", "p1", None, (0,) * 3, (1,) * 3, pose)),
            RecordedProposal(t_ns, Proposal("p1/c", "p1", "Zoë", "chair-1", pose)),
            RecordedProposal(t_ns, Proposal("p1/e", "p1", "", "", pose)),
            RecordedSurface(
                t_ns, LiveSurface("board", rng.normal(size=(4, 3)), (320, 200), "camera-360")
            ),
            RecordedSurface(
                t_ns, LiveSurface("tv", np.eye(4, 3), (32, 20), "c", rng.normal(size=(4, 3)))
            ),
            RecordedSurface(t_ns, LiveSurface("desk", np.zeros((0, 3)), (0, 0), "camera-360")),
            RecordedTrack(
                "own",
                TrackedObject(
                    "chair-1", t_ns, pose, np.eye(4) / 3, 0.3, TrackState.OCCLUDED, 0.7, seq
                ),
            ),
            RecordedTruth(
                seq, t_ns, {"chair-1": pose}, {"chair-1": 1 / 3}, frozenset({"chair-1"}), pose
            ),
            VoicePacket(t_ns, t_ns + 5, "maya", seq, 960 * seq, bytes(rng.bytes(40))),
        ]
    return out


def record(path, values, **options):
    with Recorder(path, SESSION, **options) as recorder:
        for value in values:
            recorder.write(value)
    return path


def plain(value):
    """Nested plain values, so that arrays and poses compare exactly."""
    if isinstance(value, Pose):
        return value.matrix().tolist()
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, (tuple, list)):
        return [plain(v) for v in value]
    if isinstance(value, dict):
        return {k: plain(v) for k, v in value.items()}
    if hasattr(value, "__slots__"):
        return type(value).__name__, [plain(getattr(value, n)) for n in value.__slots__]
    return value


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return record(tmp_path_factory.mktemp("recording") / "whole.mcap", messages())


def test_everything_comes_back_exactly_and_in_order(whole):
    assert plain(list(read_recording(whole))) == plain(messages())
    assert plain(read_session(whole)) == plain(SESSION)
    assert not whole.with_name("whole.mcap.part").exists()


def test_faults_of_a_frame_come_back_and_old_truths_have_none(tmp_path):
    pose = Pose.identity()
    plain_truth = RecordedTruth(0, 1, {}, {}, frozenset(), pose)
    faulty = RecordedTruth(1, 2, {}, {}, frozenset(), pose, {"blur": 2.0, "exposure": -1.0}, 5)
    assert b"faults" not in encode_message(plain_truth).data
    assert b"captured_ns" not in encode_message(plain_truth).data
    path = record(tmp_path / "faults.mcap", [plain_truth, faulty])
    old, new = (v for v in read_recording(path) if isinstance(v, RecordedTruth))
    assert (dict(old.faults), old.captured_ns) == ({}, None)
    assert (dict(new.faults), new.captured_ns) == ({"blur": 2.0, "exposure": -1.0}, 5)


def test_replayed_frames_are_the_decoded_packets(whole):
    decoder = H264Decoder()
    pictures = [decoder.decode(m) for m in messages() if isinstance(m, EncodedFrame)]
    frames = list(ReplayCamera(whole).frames())
    assert [f.seq for f in frames] == list(range(FRAMES))
    for frame, picture in zip(frames, pictures, strict=True):
        assert np.array_equal(np.concatenate(frame.images, axis=1), picture)
        assert frame.received_ns == frame.t_ns + 5
        assert frame.world_from_rig is not None


def test_replay_is_a_device_that_closes_its_sink(whole):
    queue, clock = BoundedQueue(FRAMES + 1), ManualClock()
    camera = ReplayCamera(whole)
    camera.start(queue, clock)
    seen = []
    while (frame := queue.take(timeout_s=10)) is not None:
        seen.append(frame.seq)
    camera.stop()
    assert seen == list(range(FRAMES))
    assert queue.closed
    assert not camera.status().running
    assert clock.now_ns() == (FRAMES - 1) * 100_000_000 + 1
    with pytest.raises(ValueError, match="started before"):
        camera.start(queue, clock)


def test_a_recording_that_is_cut_off_anywhere_is_read_as_far_as_it_goes(whole, tmp_path):
    data, expected = whole.read_bytes(), plain(messages())
    cut = tmp_path / "cut.mcap.part"
    most = 0
    for length in [*range(64), *range(64, len(data), 997), len(data) - 1]:
        cut.write_bytes(data[:length])
        assert not is_whole(cut)
        if not most:
            with suppress(RecordingError):
                most = len(list(read_recording(cut)))
            continue
        found = plain(list(read_recording(cut)))
        assert found == expected[: len(found)]
        assert len(found) >= most
        most = len(found)
    assert most == len(expected)


@pytest.mark.parametrize(
    "options",
    [
        {"use_summary_offsets": False, "use_statistics": False},
        {"index_types": IndexType.NONE},
        {"use_chunking": False},
        {"use_chunking": False, "index_types": IndexType.NONE, "use_statistics": False},
        {"enable_crcs": False},
        {"repeat_channels": False, "repeat_schemas": False},
    ],
)
def test_what_the_format_leaves_optional_may_be_missing(whole, tmp_path, options):
    bare = tmp_path / "bare.mcap"
    with whole.open("rb") as file, bare.open("wb") as target:
        reader = make_reader(file)
        writer = Writer(target, **options)
        writer.start()
        for metadata in reader.iter_metadata():
            writer.add_metadata(metadata.name, metadata.metadata)
        channels = {}
        for schema, channel, message in reader.iter_messages():
            if channel.topic not in channels:
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.topic] = writer.register_channel(
                    channel.topic, channel.message_encoding, number
                )
            writer.add_message(
                channels[channel.topic],
                message.log_time,
                message.data,
                message.publish_time,
                message.sequence,
            )
        writer.finish()
    assert is_whole(bare)
    assert plain(list(read_recording(bare))) == plain(messages())
    with RecordingReader(bare) as opened:
        times = [m.t_ns for m in opened.messages()]
        assert opened.span_ns == (times[0], times[-1])
        assert [m.t_ns for m in opened.messages(from_ns=times[5], before_ns=times[-1])] == [
            t for t in times if times[5] <= t < times[-1]
        ]


def test_a_flipped_byte_is_an_error_or_changes_nothing(whole, tmp_path):
    data = whole.read_bytes()
    expected = plain(messages())
    damaged = tmp_path / "damaged.mcap"
    refused = 0
    positions = range(8, len(data) - 8, 1009)
    for position in positions:
        damaged.write_bytes(data[:position] + bytes([data[position] ^ 0x41]) + data[position + 1 :])
        try:
            found = plain(list(read_recording(damaged)))
        except RecordingError:
            refused += 1
        else:
            assert found == expected
    assert refused > len(positions) // 2


def test_foreign_files_are_refused_by_name(tmp_path):
    text = tmp_path / "notes.mcap"
    text.write_text("hello, this is not a recording")
    with pytest.raises(RecordingError, match=r"notes\.mcap: not a recording"):
        list(read_recording(text))
    foreign = tmp_path / "foreign.mcap"
    with foreign.open("wb") as file:
        writer = Writer(file)
        writer.start()
        writer.finish()
    with pytest.raises(RecordingError, match="not a GaussianNexus recording"):
        list(read_recording(foreign))


def test_an_error_while_recording_leaves_only_the_part_file(tmp_path):
    path = tmp_path / "a.mcap"

    def fall_over():
        with Recorder(path, SESSION) as recorder:
            recorder.write(messages()[0])
            raise KeyError("tracker fell over")

    with pytest.raises(KeyError):
        fall_over()
    assert not path.exists()
    assert path.with_name("a.mcap.part").exists()


def test_a_full_disk_is_named_and_leaves_only_the_part_file(tmp_path, monkeypatch):
    path = tmp_path / "a.mcap"

    def full(*_args, **_kwargs):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(recording.Writer, "finish", full)
    with pytest.raises(OSError, match=r"disk is full.*a\.mcap\.part") as caught:
        record(path, messages()[:1])
    assert caught.value.errno == errno.ENOSPC
    assert not path.exists()


def test_quota_sheds_video_before_poses_and_says_so(tmp_path):
    values = messages()
    total = sum(len(recording.encode_message(v).data) for v in values)
    path = record(tmp_path / "short.mcap", values, quota=ByteQuota(int(0.6 * total)))
    found = list(read_recording(path))
    kept = [v for v in found if isinstance(v, EncodedFrame)]
    assert len(kept) < FRAMES
    assert [v.seq for v in kept] == list(range(len(kept)))
    assert sum(isinstance(v, RecordedTrack) for v in found) == FRAMES
    shed = [v for v in found if isinstance(v, Event) and v.kind == "video-shed"]
    assert len(shed) == 1
    assert f"video stops at frame {len(kept)}" in shed[0].text


def test_numbers_that_are_not_finite_are_refused(tmp_path):
    track = TrackedObject(
        "x", 0, Pose.identity(), np.full((4, 4), np.inf), 1.0, TrackState.STATIC, 1.0, 0
    )
    with pytest.raises(ValueError, match="/tracks/own at 0 ns: a number is not finite"):
        record(tmp_path / "a.mcap", [RecordedTrack("own", track)])
