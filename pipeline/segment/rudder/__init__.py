"""What the rudder did, leg by leg, and the heading and yaw rate measured against it."""
