"""CDR and protobuf in a log: what is read without a profile, what a profile names, what is void, whose clock counts."""

import io
import json
import math

import pytest
from mcap.writer import Writer
from mcap_ros2.writer import Writer as RosWriter

from kempf.schemas.errors import UsageError
from kempf.schemas.known_messages import OFFERED
from kempf.schemas.profile import VesselProfile
from tests.ingest.ros_definitions import DEFINITIONS
from tests.ingest.test_protobuf import described
from tests.reading import read_log

START = 1_755_497_274_000_000_000


def header(k, frame="map"):
    return {"stamp": {"sec": START // 10**9 + k, "nanosec": 250}, "frame_id": frame}


def quaternion(yaw, pitch=0.0, roll=0.0):
    """The rotation about z, then the new y, then the new x."""
    (cy, sy), (cp, sp), (cr, sr) = ((math.cos(a / 2), math.sin(a / 2)) for a in (yaw, pitch, roll))
    return {
        "x": sr * cp * cy - cr * sp * sy,
        "y": cr * sp * cy + sr * cp * sy,
        "z": cr * cp * sy - sr * sp * cy,
        "w": cr * cp * cy + sr * sp * sy,
    }


def ros(messages):
    """Write (topic, type, message), a second between them, a little later than they were stamped."""
    out = io.BytesIO()
    writer = RosWriter(out)
    schemas = {}
    for k, (topic, kind, message) in enumerate(messages):
        if kind not in schemas:
            schemas[kind] = writer.register_msgdef(kind, DEFINITIONS[kind])
        at = START + k * 10**9 + 5_000_000
        writer.write_message(topic=topic, schema=schemas[kind], message=message, log_time=at, publish_time=at)
    writer.finish()
    return out.getvalue()


def imu(k, **other):
    still = {"x": 0.0, "y": 0.0, "z": 0.0}
    return {
        "header": header(k), "orientation": quaternion(0.3, 0.02, -0.1), "orientation_covariance": [0.0] * 9,
        "angular_velocity": {"x": 0.0, "y": 0.0, "z": 0.05}, "angular_velocity_covariance": [0.0] * 9,
        "linear_acceleration": still, "linear_acceleration_covariance": [0.0] * 9, **other,
    }  # fmt: skip


def fix(k, status=0):
    return {
        "header": header(k), "status": {"status": status, "service": 1}, "latitude": 59.9 + k / 1e3, "longitude": 24.6,
        "altitude": 1.0, "position_covariance": [0.0] * 9, "position_covariance_type": 0,
    }  # fmt: skip


def profile(channels, **source):
    return VesselProfile.model_validate({"sources": [{"match": "*.mcap", "channels": channels, **source}]})


def as_profile(offered):
    return {key: one.model_dump(exclude_defaults=True) for key, one in offered.items()}


def test_a_fix_needs_no_profile_and_one_without_satellites_is_void():
    kind = "sensor_msgs/msg/NavSatFix"
    readings = read_log("a.mcap", ros([("/fix", kind, fix(k, -1 if k == 2 else 0)) for k in range(5)]), VesselProfile())
    assert readings.frame["record"].to_list() == [0, 1, 3, 4]
    assert readings.tally.by_reason == {"void": 1}
    assert readings.frame["latitude_rad"][1] == pytest.approx(math.radians(59.901), abs=1e-15)
    assert readings.notes == ("Read without a profile, by the definition of the messages: /fix (latitude, longitude).",)


def test_what_depends_on_mounting_and_frame_is_offered_and_not_taken():
    data = ros([("/imu", "sensor_msgs/msg/Imu", imu(k)) for k in range(3)])
    with pytest.raises(UsageError) as refused:
        read_log("a.mcap", data, VesselProfile())
    assert refused.value.code == "no_source_for_log"
    assert "'/imu.angular_velocity.z: {channel: yaw_rate, unit: rad/s, positive: port}'" in refused.value.next_step


def test_the_offered_lines_give_the_canonical_channels():
    offered = OFFERED["sensor_msgs/Imu"]
    data = ros([("/imu", "sensor_msgs/msg/Imu", imu(k)) for k in range(3)])
    frame = read_log("a.mcap", data, profile({f"/imu.{k}": v for k, v in as_profile(offered).items()})).frame
    # bow 0.3 rad to the north of east is a heading of 90 deg less that; she turns to port, bow down, port side down
    assert frame["heading_rad"].to_list() == pytest.approx([math.pi / 2 - 0.3] * 3, abs=1e-12)
    assert frame["yaw_rate_rad_s"].to_list() == [-0.05] * 3
    assert frame["pitch_rad"].to_list() == pytest.approx([-0.02] * 3, abs=1e-12)
    assert frame["roll_rad"].to_list() == pytest.approx([-0.1] * 3, abs=1e-12)


def test_an_imu_says_what_it_does_not_measure_and_a_rotation_that_is_none_is_no_number():
    given = profile({f"/imu.{k}": v for k, v in as_profile(OFFERED["sensor_msgs/Imu"]).items()})
    nothing = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 0.0}
    messages = [imu(0, orientation_covariance=[-1.0] + [0.0] * 8), imu(1, orientation=nothing), imu(2)]
    readings = read_log("a.mcap", ros([("/imu", "sensor_msgs/msg/Imu", m) for m in messages]), given)
    assert readings.tally.records_kept == 3
    assert readings.frame["heading_rad"].is_null().to_list() == [True, True, False]
    assert readings.frame["yaw_rate_rad_s"].null_count() == 0
    assert readings.tally.by_reason == {"not_a_number": 3}


def test_nested_fields_elements_and_plain_numbers_by_profile():
    given = profile(
        {
            "/odom.twist.twist.linear.x": {"channel": "speed_through_water", "unit": "m/s"},
            "/vel.twist.linear.x": {"channel": "velocity_east", "unit": "m/s"},
            "/vel.twist.linear.y": {"channel": "velocity_north", "unit": "m/s"},
            "/joints.position.1": {"channel": "rudder_angle", "unit": "rad", "positive": "port"},
            "/depth.data": {"channel": "water_depth", "unit": "ft"},
        }
    )
    zero = {"x": 0.0, "y": 0.0, "z": 0.0}
    pose = {"pose": {"position": zero, "orientation": quaternion(0.0)}, "covariance": [0.0] * 36}
    twist = {"linear": {"x": 3.0, "y": 4.0, "z": 0.0}, "angular": zero}
    joints = {"header": header(2), "name": ["a", "bb"], "position": [1.0, 0.2], "velocity": [], "effort": []}
    odometry = {
        "header": header(0),
        "child_frame_id": "base_link",
        "pose": pose,
        "twist": {"twist": twist, "covariance": [0.0] * 36},
    }
    messages = [
        ("/odom", "nav_msgs/msg/Odometry", odometry),
        ("/vel", "geometry_msgs/msg/TwistStamped", {"header": header(1), "twist": twist}),
        ("/joints", "sensor_msgs/msg/JointState", joints),
        ("/joints", "sensor_msgs/msg/JointState", {**joints, "position": [1.0]}),
        ("/depth", "std_msgs/msg/Float32", {"data": 10.0}),
    ]
    readings = read_log("a.mcap", ros(messages), given)
    assert readings.tally.by_reason == {"void": 1}
    row = readings.frame.drop("record", "time_utc_ns", "source").max().row(0, named=True)
    assert {k: v for k, v in row.items() if v is not None} == {
        "speed_through_water_m_s": 3.0, "velocity_north_m_s": 4.0, "velocity_east_m_s": 3.0,
        "rudder_angle_rad": -0.2, "water_depth_m": 3.048,
    }  # fmt: skip


def test_the_stamp_of_the_messages_on_request():
    given = profile(
        {
            "/imu.angular_velocity.z": {"channel": "yaw_rate", "unit": "rad/s"},
            "/rudder.data": {"channel": "rudder_angle", "unit": "rad"},
        },
        time={"column": "header.stamp"},
    )
    data = ros([("/imu", "sensor_msgs/msg/Imu", imu(0)), ("/rudder", "std_msgs/msg/Float64", {"data": 0.1})])
    readings = read_log("a.mcap", data, given)
    assert readings.frame["time_utc_ns"].to_list() == [START + 250, START + 10**9 + 5_000_000]
    assert readings.notes == ("Messages of /rudder without header.stamp have log time.",)


def protobuf(values, schema_encoding="protobuf"):
    schema, made = described()
    out = io.BytesIO()
    writer = Writer(out)
    writer.start()
    number = writer.register_schema("yard.Part", schema_encoding, schema)
    channel = writer.register_channel("/gyro", "protobuf", number)
    for k, value in enumerate(values):
        message = made(f_double=value)
        message.sub.f_float = value
        writer.add_message(channel, START + k, message.SerializeToString(), START + k)
    writer.finish()
    return out.getvalue()


def test_protobuf_by_profile_and_zero_is_a_number():
    given = profile(
        {
            "/gyro.f_double": {"channel": "heading", "unit": "deg"},
            "/gyro.sub.f_float": {"channel": "roll", "unit": "deg"},
        }
    )
    frame = read_log("a.mcap", protobuf([0.0, 90.0, 45.0]), given).frame
    assert frame["heading_rad"].to_list() == [0.0, math.pi / 2, math.pi / 4]
    assert frame["roll_rad"].to_list() == [0.0, math.pi / 2, math.pi / 4]


def test_a_topic_that_cannot_be_read_is_named_and_the_others_are_read():
    given = profile({"/gyro.f_double": {"channel": "heading", "unit": "deg"}})
    with pytest.raises(Exception, match="Topic /gyro is encoded as protobuf with a schema in flatbuffer"):
        read_log("a.mcap", protobuf([1.0], "flatbuffer"), given)
    given = profile(
        {"/gyro.f_string": {"channel": "heading", "unit": "deg"}, "/gyro.f_double": {"channel": "roll", "unit": "deg"}}
    )
    readings = read_log("a.mcap", protobuf([1.0]), given)
    assert readings.notes == ("No message of /gyro has the field f_string: f_string is not a number.",)


def test_the_longest_topic_that_fits_owns_a_key_even_where_it_comes_last():
    given = profile({"/a.b.x": {"channel": "heading", "unit": "deg"}, "/a.y": {"channel": "roll", "unit": "deg"}})
    out = io.BytesIO()
    writer = Writer(out, use_chunking=False, use_summary_offsets=False, repeat_channels=False, use_statistics=False)
    writer.start()
    for k, (topic, message) in enumerate([("/a", {"y": 1, "b": {"x": 8}}), ("/a.b", {"x": 7})]):
        channel = writer.register_channel(topic, "json", 0)
        writer.add_message(channel, START + k, json.dumps(message).encode(), START + k)
    writer.finish()
    frame = read_log("a.mcap", out.getvalue(), given).frame
    assert frame["heading_rad"].to_list() == [None, math.radians(7)]
    assert frame["roll_rad"].to_list() == [math.radians(1), None]


def test_a_refused_payload_that_is_no_text_is_shown_as_its_bytes():
    data = ros([("/imu", "sensor_msgs/msg/Imu", imu(0)), ("/fix", "sensor_msgs/msg/NavSatFix", fix(1))])
    rejected = read_log("a.mcap", data, VesselProfile()).rejected
    assert rejected["raw"][0].startswith("00010000") and rejected["raw"][0].endswith("... 316 bytes")
