"""Tables compacted, brought to a later layout, erased in part, and verified."""
