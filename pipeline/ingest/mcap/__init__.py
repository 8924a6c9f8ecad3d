"""MCAP: chunks, records, topics, and the way from messages to channels."""
