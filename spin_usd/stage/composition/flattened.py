"""The text of a flattened stage, the same in every process.

USD numbers and writes the prototypes of instances in the order in which its threads find them, which varies.
"""

import re

from pxr import Sdf

PROTOTYPE = re.compile(r"\bFlattened_Prototype_\d+\b")


def flattened_text(flat: Sdf.Layer) -> str:
    """Return the text of the layer `flat`, with its prototypes numbered and ordered by their first reference, from the
    stage's own prims down. The prototypes are removed from `flat`."""
    prototypes = {prim.name: prim.GetAsText() for prim in flat.rootPrims if PROTOTYPE.fullmatch(prim.name)}
    if len(prototypes) < 2:
        return str(flat.ExportToString())
    for name in prototypes:
        del flat.rootPrims[name]
    texts = [flat.ExportToString()]
    numbers: dict[str, str] = {}
    for text in texts:  # the list grows by every prototype that is found
        for name in (name for name in PROTOTYPE.findall(text) if name in prototypes and name not in numbers):
            numbers[name] = f"Flattened_Prototype_{len(numbers) + 1}"
            texts.append(prototypes[name])
    texts += [text for name, text in sorted(prototypes.items()) if name not in numbers]  # a stage's own of that name
    return "\n".join(PROTOTYPE.sub(lambda found: numbers.get(found[0], found[0]), text) for text in texts)
