"""Arithmetic with the same bytes on all processors: elementary functions, and interpolation."""
