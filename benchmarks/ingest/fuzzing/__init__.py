"""Fuzzing of the readers.

Small valid inputs (`corpus`) are damaged from a seed (`mutate`, `words`) and judged by oracles that share no code with
the readers (`oracles`), for as long as one likes (`campaign`).
"""
