"""``python -m kempf`` is the command ``kempf``."""

from kempf.workbench.cli import main

if __name__ == "__main__":
    main()
