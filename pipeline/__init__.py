"""Pure functions: frames and arrays in, results out. Knows neither Prefect nor the disk."""
