"""Damaged and earlier warehouses."""
