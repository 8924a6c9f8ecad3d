"""Many vessels at once: the plan, the Prefect flows, the report."""
