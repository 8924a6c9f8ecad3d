"""What a command prints with ``--json``, and what the page of the same thing has at its address with ``.json``."""
