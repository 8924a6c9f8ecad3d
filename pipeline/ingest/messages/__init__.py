"""What stands in a message, by its definition in the file: JSON, protobuf, ROS 2 CDR; in columns."""
