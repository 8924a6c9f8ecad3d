"""A trial simulator for tests, benchmarks and the demo: hull, weather, helmsman, instruments and loggers.

Nothing here may import `pipeline.model` or `pipeline.estimate`: an error shared by plant and estimator would hide
itself. The plant is integrated finer than any instrument samples it. The entry is `kempf.pipeline.simulate.trial`.
"""
