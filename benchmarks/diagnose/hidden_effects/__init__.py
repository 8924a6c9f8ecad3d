"""Hidden-effect benchmark: raw logs of simulated ships, each with one effect that the plain model lacks, or none.

`write` makes the cases in a process of its own and seals the answers; nothing in a case gives its effect away.
The plant (`plant`) shares no dynamics code with `pipeline.model`, `pipeline.estimate` or `pipeline.simulate`. `effects`
and `outsiders` hold the exact equation and unit of every effect.
"""
