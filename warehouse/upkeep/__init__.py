"""Tables made smaller, brought to a later layout, and checked."""
