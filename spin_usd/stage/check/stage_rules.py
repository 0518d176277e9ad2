"""The rules on a composed stage. A new one is a file of its own and an entry here."""

from collections.abc import Callable, Iterator
from typing import TypeAlias

from pxr import Usd

from spin_usd.scene.finding import Finding
from spin_usd.stage.check.layers import layer_findings
from spin_usd.stage.check.poses_and_cameras import camera_findings, capture_findings, norm_findings, pose_findings
from spin_usd.stage.check.prims import (
    draw_mode_findings,
    extent_findings,
    kind_findings,
    label_findings,
    light_findings,
)
from spin_usd.stage.check.properties import property_findings
from spin_usd.stage.check.variant_opinions import variant_findings

StageRule: TypeAlias = Callable[[Usd.Stage], Iterator[Finding]]

STAGE_RULES: tuple[StageRule, ...] = (
    layer_findings,
    capture_findings,
    pose_findings,
    norm_findings,
    camera_findings,
    kind_findings,
    label_findings,
    light_findings,
    extent_findings,
    draw_mode_findings,
    property_findings,
    variant_findings,
)
"""All rules, in the order in which findings are reported."""
