"""From readings at native rates to series one can compute with: one clock, unwrapped angles, the common grid."""
