"""What an estimator is given: a segment's inputs and measurements, checked, and their errors."""
