"""NMEA 0183: sentences, their clock, fields to channels in SI."""
