"""Definitions of ROS 2 messages as recorders write them into a file: the message, then all that it refers to."""

STAMP = ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec")
HEADER = ("std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id")
VECTOR3 = ("geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z")
QUATERNION = ("geometry_msgs/Quaternion", "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1")
POINT = ("geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z")
POSE = ("geometry_msgs/Pose", "Point position\nQuaternion orientation")
TWIST = ("geometry_msgs/Twist", "Vector3  linear\nVector3  angular")
POSE_COVARIANCE = ("geometry_msgs/PoseWithCovariance", "Pose pose\nfloat64[36] covariance")
TWIST_COVARIANCE = ("geometry_msgs/TwistWithCovariance", "Twist twist\n\n# row major\nfloat64[36] covariance")
STATUS = (
    "sensor_msgs/NavSatStatus",
    "int8 STATUS_NO_FIX =  -1        # unable to fix position\nint8 STATUS_FIX =      0\nint8 status\n"
    "uint16 SERVICE_GPS =     1\nuint16 service",
)
STAMPED = [HEADER, STAMP]


def joined(own, *others):
    separator = "=" * 80
    return own + "".join(f"\n{separator}\nMSG: {name}\n{text}" for name, text in others)


DEFINITIONS = {
    "std_msgs/msg/Float64": "float64 data",
    "std_msgs/msg/Float32": "float32 data",
    "std_msgs/msg/Bool": "bool data",
    "std_msgs/msg/Int64": "int64 data",
    "std_msgs/msg/UInt64": "uint64 data",
    "sensor_msgs/msg/NavSatFix": joined(
        "uint8 COVARIANCE_TYPE_UNKNOWN = 0\nstd_msgs/Header header\nNavSatStatus status\nfloat64 latitude\n"
        "float64 longitude\nfloat64 altitude\nfloat64[9] position_covariance\nuint8 position_covariance_type",
        *STAMPED,
        STATUS,
    ),
    "sensor_msgs/msg/Imu": joined(
        "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\n"
        "float64[9] orientation_covariance # Row major about x, y, z axes\ngeometry_msgs/Vector3 angular_velocity\n"
        "float64[9] angular_velocity_covariance\ngeometry_msgs/Vector3 linear_acceleration\n"
        "float64[9] linear_acceleration_covariance",
        *STAMPED,
        QUATERNION,
        VECTOR3,
    ),
    "sensor_msgs/msg/MagneticField": joined(
        "std_msgs/Header header\ngeometry_msgs/Vector3 magnetic_field\nfloat64[9] magnetic_field_covariance",
        *STAMPED,
        VECTOR3,
    ),
    "geometry_msgs/msg/TwistStamped": joined("std_msgs/Header header\nTwist twist", *STAMPED, TWIST, VECTOR3),
    "geometry_msgs/msg/TwistWithCovarianceStamped": joined(
        "std_msgs/Header header\nTwistWithCovariance twist", *STAMPED, TWIST_COVARIANCE, TWIST, VECTOR3
    ),
    "geometry_msgs/msg/Vector3Stamped": joined("std_msgs/Header header\nVector3 vector", *STAMPED, VECTOR3),
    "geometry_msgs/msg/QuaternionStamped": joined(
        "std_msgs/Header header\nQuaternion quaternion", *STAMPED, QUATERNION
    ),
    "geometry_msgs/msg/PoseStamped": joined("std_msgs/Header header\nPose pose", *STAMPED, POSE, POINT, QUATERNION),
    "nav_msgs/msg/Odometry": joined(
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
        "geometry_msgs/TwistWithCovariance twist",
        *STAMPED,
        POSE_COVARIANCE,
        POSE,
        POINT,
        QUATERNION,
        TWIST_COVARIANCE,
        TWIST,
        VECTOR3,
    ),
    "sensor_msgs/msg/JointState": joined(
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort", *STAMPED
    ),
    "yard_msgs/msg/Everything": joined(
        '# every kind of field\nstring NAME="a # b"\nuint8 mode 3\nstring<=8 label "x"\nPart[2] pair\nPart[] parts\n'
        "int16[<=4] few\nuint8[] blob\nbool[3] flags\nNothing nothing\nstring[2] two\nfloat32 last\nint64 count",
        ("yard_msgs/Part", "string name\nfloat64 mass\nNothing[] nothings\nint8 grade"),
        ("yard_msgs/Nothing", "# empty"),
    ),
}
