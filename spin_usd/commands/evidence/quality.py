"""Completeness, representativeness and diversity of the table of pictures, by dqm-ml-core.

Representativeness compares the pictures in the domain with as many in each of its cells; diversity is over the cells.
"""

from importlib.metadata import version
from math import isfinite
from pathlib import Path
from typing import Any

from spin_usd.commands.evidence.domain import Domain
from spin_usd.commands.evidence.picture_table import CELL

PACKAGE = "dqm-ml-core"


def quality_of(table: Path, domain: Domain) -> tuple[dict[str, dict[str, float]], str]:
    """Return the figures of dqm-ml-core by dimension for the table of pictures in that file, and its version."""
    import pandas as pd
    from dqm_ml_core import ProcessorRunner

    frame = pd.read_parquet(table)
    figures = {}
    for name in domain.dimensions:
        found = ProcessorRunner().run(frame, processors_for(name, domain))
        figures[name] = {
            key: float(value) for key, value in found.items() if isinstance(value, int | float) and isfinite(value)
        }
    return figures, version(PACKAGE)


def processors_for(name: str, domain: Domain) -> list[Any]:
    """Return the processors of dqm-ml-core for a dimension."""
    from dqm_ml_core import CompletenessProcessor, DiversityProcessor, RepresentativenessProcessor

    count, cell = domain.dimensions[name].count, f"{name}{CELL}"
    uniform = {
        "type": "representativeness",
        "columns": {"input": [cell]},
        "metrics": ["chi-square", "grte", "shannon-entropy"],
        "distribution": "uniform",
        "mean_std_estimation": "user_provided",
        "distribution_params": [{"column": cell, "min": -0.5, "max": count - 0.5}],
        "histogram": {"bins": count},
    }
    return [
        CompletenessProcessor(config={"columns": {"input": [name]}, "include_overall": False, "type": "completeness"}),
        RepresentativenessProcessor(config=uniform),
        DiversityProcessor(config={"columns": {"input": [cell]}, "type": "diversity"}),
    ]
