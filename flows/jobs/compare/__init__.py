"""A model beside the measurements."""
