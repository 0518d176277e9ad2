"""Noise on a sphere, octave by octave, the same on all processors."""
