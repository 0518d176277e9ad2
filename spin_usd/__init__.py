"""spin_usd: labelled, traceable, reproducible imagery of a target spacecraft from layered USD stages."""

__version__ = "0.1.0"
