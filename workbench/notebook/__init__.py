"""What ``import kempf`` hands out: a warehouse, its vessels, and results that draw themselves in a notebook."""
