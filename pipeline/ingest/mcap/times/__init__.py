"""When a message was measured: stamps, arrival, the clocks of publishers and of the recorder."""
