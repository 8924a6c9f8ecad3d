"""Standard manoeuvres of a ship with an identified model, sailed closed loop: tracks, figures, intervals, criteria."""
