"""Spirals, pull-outs and manoeuvres of random orders."""
