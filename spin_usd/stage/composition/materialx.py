"""MaterialX documents (.mtlx), which usd-core cannot read: a stage that references one composes without it."""

import re

from pxr import Pcp, Sdf, Usd

DOCUMENT = ".mtlx"
NAMED = re.compile(r"@[^@]*\.mtlx@")


def composition_errors(stage: Usd.Stage) -> list[str]:
    """List the stage's composition errors, sorted, without those about MaterialX documents."""
    return sorted(str(error) for error in stage.GetCompositionErrors() if not _of_document(error))


def names_document(message: str) -> bool:
    """Return whether a message of USD is about an asset path to a MaterialX document."""
    return NAMED.search(message) is not None


def _of_document(error: Pcp.ErrorBase) -> bool:
    return isinstance(error, Pcp.ErrorInvalidAssetPath) and names_document(str(error))


def document_of(stage: Usd.Stage, path: Sdf.Path) -> str:
    """Return the asset path of the MaterialX document that would define the prim at `path`; "" where none does."""
    for prefix in path.GetPrefixes():
        prim = stage.GetPrimAtPath(prefix)
        for spec in prim.GetPrimStack() if prim else ():
            for arcs in (spec.referenceList, spec.payloadList):
                for arc in arcs.GetAddedOrExplicitItems():
                    if arc.assetPath.lower().endswith(DOCUMENT):
                        return str(arc.assetPath)
    return ""
