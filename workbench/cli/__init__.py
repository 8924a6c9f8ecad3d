"""The command ``kempf``: one file a command, imported when it is called, so that ``--help`` is instant."""

from kempf.workbench.cli.entry import main

__all__ = ["main"]
