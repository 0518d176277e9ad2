"""Closed surfaces: solids, foil, tape, cables, and the heads of screws."""
