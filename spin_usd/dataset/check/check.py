"""Findings on a stage or a dataset."""

import os
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from spin_usd.dataset.check.dataset import dataset_findings
from spin_usd.dataset.check.stage import StageAnswer, stage_call
from spin_usd.dataset.process.shared_calls import results_of
from spin_usd.dataset.store.dataset_folder import Store
from spin_usd.dataset.store.stage_path import root_layer
from spin_usd.errors import InputError
from spin_usd.progress import Progress
from spin_usd.scene.derived.views import Views
from spin_usd.scene.finding import ERROR, Finding


@dataclass(frozen=True, kw_only=True)
class CheckReport:
    """The findings of a check.

    kind: "stage" or "dataset" · findings: what is wrong with it · views: what a stage's own pictures show, where they
    can be read · compared: how many pictures' labels were compared with those that Cycles casts, None where that was
    not asked for.
    """

    kind: str
    findings: list[Finding]
    views: Views | None = None
    compared: int | None = None

    @property
    def errors(self) -> int:
        """The number of findings that are errors: the others are warnings."""
        return sum(finding.severity == ERROR for finding in self.findings)

    def as_json(self) -> dict[str, Any]:
        more: dict[str, Any] = {"views": self.views.as_json()} if self.views else {}
        more |= {} if self.compared is None else {"compared": self.compared}
        return {"kind": self.kind, "findings": [asdict(finding) for finding in self.findings], **more}


def check(path: Path, *, progress: Progress) -> CheckReport:
    """Check the stage or dataset at `path`. Raises InputError when it is neither."""
    if Store(root=path).is_dataset():
        return CheckReport(kind="dataset", findings=list(dataset_findings(path.absolute(), progress=progress)))
    root = root_layer(path)
    if os.path.isfile(root) and root.suffix.lower().startswith(".usd"):
        return check_stage(root, progress=progress)
    if not os.path.exists(path):
        raise InputError("does not exist", where=path, do="check the path")
    do = "give a stage's root layer, the folder of its dataset.usda, or a dataset's folder"
    raise InputError("is neither a stage nor a dataset", where=path, do=do)


def check_stage(root: Path, *, progress: Progress) -> CheckReport:
    """Check the stage whose root layer is `root`."""
    (result,) = results_of([stage_call(root)], 1, progress=progress)
    answer = StageAnswer.of(result, root)
    return CheckReport(kind="stage", findings=list(answer.findings), views=answer.views)
