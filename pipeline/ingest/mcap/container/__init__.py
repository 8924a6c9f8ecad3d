"""The container: chunks, records and batches of messages, whole or torn."""
