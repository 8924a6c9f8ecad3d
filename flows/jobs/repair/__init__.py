"""Damaged warehouses made whole, earlier ones brought to the layout of this version."""
