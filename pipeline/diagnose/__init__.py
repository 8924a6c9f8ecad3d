"""Which physical effect a model lacks: screen, confirm, sets, step, verdict."""
