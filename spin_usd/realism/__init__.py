"""Formulas of the gap between real pictures and rendered ones, and of the fits that close it."""
