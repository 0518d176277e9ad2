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

    frame, runner, figures = pd.read_parquet(table), ProcessorRunner(), {}
    for name, cells in domain.dimensions.items():
        if frame[name].isna().all():  # dqm-ml-core cannot count a column of nothing
            continue
        inside = frame.dropna(subset=[name + CELL])  # dqm-ml-core counts null as a value of its own
        found = runner.run(frame, [_completeness(name)]) | runner.run(inside, _over_cells(name + CELL, cells.count))
        figures[name] = {
            key: float(value) for key, value in found.items() if isinstance(value, int | float) and isfinite(value)
        }
    return figures, version(PACKAGE)


def _completeness(column: str) -> Any:
    from dqm_ml_core import CompletenessProcessor

    return CompletenessProcessor(
        config={"type": "completeness", "columns": {"input": [column]}, "include_overall": False}
    )


def _over_cells(column: str, count: int) -> list[Any]:
    """Return the processors for a column of numbers of cells."""
    from dqm_ml_core import DiversityProcessor, RepresentativenessProcessor

    uniform = {
        "type": "representativeness",
        "columns": {"input": [column]},
        "metrics": ["chi-square", "grte", "shannon-entropy"],
        "distribution": "uniform",
        "mean_std_estimation": "user_provided",
        "distribution_params": [{"column": column, "min": -0.5, "max": count - 0.5}],
        "histogram": {"bins": count},
    }
    diversity = {"type": "diversity", "columns": {"input": [column]}}
    return [RepresentativenessProcessor(config=uniform), DiversityProcessor(config=diversity)]
