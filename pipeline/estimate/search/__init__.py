"""The search for a maximum: where it begins and how it climbs."""
