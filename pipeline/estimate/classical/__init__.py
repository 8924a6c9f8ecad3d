"""What others would use, on the same records: estimators that know no disturbances, each a file."""
