"""The web pages: a ship, her logs, manoeuvres, models and diagnoses, each at an address of its own.

Pages read and write nothing. What is shown at ``X`` is at ``X.json`` as the document that ``--json`` prints.
"""
