"""The ladder of models: which effect is taken, by prediction or likelihood, and how sure that is."""
