"""Time series for the charts: reduced to what a screen can show, as binary frames."""
