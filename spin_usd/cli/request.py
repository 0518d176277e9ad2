"""What `plan` and `render` are asked to make, from the options that they share."""

from collections.abc import Mapping
from typing import Any


def render_request(options: Mapping[str, Any]) -> Any:
    """The RenderRequest that the options, by the names of the commands' parameters, describe."""
    from spin_usd.dataset.render import RenderRequest
    from spin_usd.labels.label import LABELS

    names = {"all": tuple(LABELS), "none": ()}
    labels = names.get(options["labels"], _names(options["labels"]))
    return RenderRequest(
        stage=options["stage"],
        frames=options["frames"],
        variants=_names(options["variants"]),
        samples=options["samples"],
        seed=options["seed"],
        renderer=options["renderer"],
        labels=labels,
        image=not options["labels_only"],
        radiance=options["radiance"],
        image_suffix="." + options["image_format"],
    )


def _names(text: str) -> tuple[str, ...]:
    return tuple(name.strip() for name in text.split(",") if name.strip())
