"""What the parameter sets of one vessel say together: may they be pooled, and did the ship change, when and in what."""
