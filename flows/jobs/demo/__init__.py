"""The demonstration and the paper's own experiment."""
