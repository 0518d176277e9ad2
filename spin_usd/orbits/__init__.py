"""Positions of spacecraft, Sun, Moon, Earth and stars at given times, and attitudes of spacecraft."""
