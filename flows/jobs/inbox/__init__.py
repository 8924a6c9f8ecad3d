"""A folder or bucket into which logs are delivered, and its quarantine."""
