"""Figures that the server draws, as SVG without script or inline style."""
