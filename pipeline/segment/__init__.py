"""Manoeuvres found in whole logs - zigzags, turning circles, pull-outs, spirals, random ones - and the IMO criteria."""
