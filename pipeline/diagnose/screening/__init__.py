"""Which effects the innovations ask for: scores of all candidates, and the noise and instants beside them."""
