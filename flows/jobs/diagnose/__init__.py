"""What a model lacks, and the effects that are added to it."""
