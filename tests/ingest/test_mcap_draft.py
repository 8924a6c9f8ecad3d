"""What a draft of a profile offers of an MCAP log: every number that may be a measurement, and no clock or counter."""

from __future__ import annotations

import io
from fnmatch import fnmatch

import pytest
import yaml
from mcap_ros2.writer import Writer as RosWriter

from kempf.pipeline.ingest.draft_profile import draft_profile, draft_topics
from kempf.pipeline.ingest.log_file import LogFile
from kempf.pipeline.ingest.mcap.topics.fields import fields_of
from kempf.pipeline.ingest.mcap.topics.joint_names import joint_names
from tests.ingest.ros_definitions import DEFINITIONS, joined
from tests.ingest.test_mcap import START, write
from tests.ingest.test_mcap_messages import header, imu

ARRAY = joined(
    "MultiArrayLayout layout\nfloat64[] data",
    ("std_msgs/MultiArrayLayout", "MultiArrayDimension[] dim\nuint32 data_offset"),
    ("std_msgs/MultiArrayDimension", "string label\nuint32 size\nuint32 stride"),
)
JOINTS = "sensor_msgs/msg/JointState"


def ros(topic: str, kind: str, definition: str, messages: list[dict[str, object]]) -> bytes:
    out = io.BytesIO()
    writer = RosWriter(out)
    schema = writer.register_msgdef(kind, definition)
    for k, message in enumerate(messages):
        writer.write_message(topic, schema, message, log_time=START + k, publish_time=START + k)
    writer.finish()
    return out.getvalue()


def drafted(data: bytes, name: str = "day.mcap") -> dict[str, str]:
    (source,) = yaml.safe_load(draft_topics(name, fields_of(name, LogFile(data))))["sources"]
    return {key: one["channel"].rstrip("?") for key, one in (source["channels"] or {}).items()}


def array(*data: float) -> dict[str, object]:
    return {"layout": {"dim": [], "data_offset": 0}, "data": list(data)}


@pytest.mark.parametrize(("frame", "turned"), [("imu_link", ("port", "port")), ("imu_ned", ("starboard",) * 2)])
def test_axes_of_a_frame_that_points_down_are_not_turned(frame: str, turned: tuple[str, str]) -> None:
    messages = [imu(k, header=header(k, frame)) for k in range(2)]
    offered = fields_of(
        "a.mcap", LogFile(ros("/imu", "sensor_msgs/msg/Imu", DEFINITIONS["sensor_msgs/msg/Imu"], messages))
    )
    sides = [offered["/imu"][field].positive for field in ("angular_velocity.z", "orientation.yaw")]
    assert tuple(sides) == turned


def test_the_elements_that_a_list_of_ros_has_are_offered() -> None:
    data = ros("/rudder", "std_msgs/msg/Float64MultiArray", ARRAY, [array(), array(4.5, 55.0)])
    assert drafted(data) == {"/rudder.data.0": "rudder_angle", "/rudder.data.1": "rudder_angle"}
    scan = ros("/scan", "std_msgs/msg/Float64MultiArray", ARRAY, [array(*range(9))])
    assert drafted(scan) == {}


def test_a_list_of_fixed_length_is_offered_where_it_is_no_matrix() -> None:
    definition = (
        "float64[3] wind\nfloat64[9] turn\nfloat64[9] position_covariance\nfloat64[2] covariance\nfloat64 depth"
    )
    message = {
        "wind": [1.0] * 3,
        "turn": [0.0] * 9,
        "position_covariance": [0.0] * 9,
        "covariance": [0.0] * 2,
        "depth": 1.0,
    }
    data = ros("/met", "yard_msgs/msg/Met", definition, [message])
    assert list(drafted(data)) == ["/met.wind.0", "/met.wind.1", "/met.wind.2", "/met.depth"]


def test_joints_are_offered_under_the_names_that_the_log_gives_them() -> None:
    joints = {"header": header(0), "name": ["rudder", "prop"], "position": [0.1, 0.2], "velocity": [], "effort": []}
    data = ros("/joint_states", JOINTS, DEFINITIONS[JOINTS], [joints])
    assert drafted(data) == {"/joint_states.position.0": "rudder_angle", "/joint_states.position.1": ""}
    lines = draft_topics("a.mcap", fields_of("a.mcap", LogFile(data))).splitlines()
    assert lines[-2].endswith("unit: \"rad?\"}  # 'rudder' in the log")


@pytest.mark.parametrize("message", [b"", b"\x00\x01", b"\x00\x01\x00\x00" + bytes(8) + b"\xff" * 40])
def test_names_of_a_damaged_message_are_none(message: bytes) -> None:
    assert joint_names(message) == []


def test_times_and_counters_are_not_offered_as_the_channel_of_their_topic() -> None:
    stamp = {"sec": 1, "nsec": 2}
    data = write([("/gyro/heading", 0, {"heading": 1, "t": 1.5, "seq": 3, "id": 7, "timestamp": stamp, "Time": 2})])
    assert drafted(data) == {"/gyro/heading.heading": "heading"}


def test_numbers_as_text_in_lists_and_behind_empty_messages_are_offered() -> None:
    messages = [
        ("/gyro", 0, {"status": "starting", "heading": None}),
        ("/gyro", 1, {"heading": "21.5", "name": "gyro 1", "bad": "nan"}),
        ("/steering", 2, {"rudder": [1.5, {"order": 2}], "scan": [0] * 9, "ok": [True]}),
    ]
    assert drafted(write(messages)) == {
        "/gyro.heading": "heading",
        "/steering.rudder.0": "rudder_angle",
        "/steering.rudder.1.order": "",
    }


@pytest.mark.parametrize("name", ["trial [1].mcap", "trial*.mcap", "[a].mcap", "a].mcap"])
def test_the_pattern_of_a_draft_fits_its_own_file(name: str) -> None:
    for text in (draft_topics(name, {"/gyro": {"heading": None}}), draft_profile(name, ["t", "heading"])):
        (source,) = yaml.safe_load(text)["sources"]
        assert fnmatch(name, source["match"])
