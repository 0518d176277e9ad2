"""Rule: what is in a dataset is a file or a folder, and no link."""

from spin_usd.files.node import Node, NodeType
from spin_usd.scene.finding import ERROR, WARNING, Finding
from spin_usd.store.dataset_folder import LOCK, OWN

LINK, SPECIAL = "link", "special"


def special_file_finding(node: Node) -> Finding:
    """Return a finding on a node that is neither file nor folder: a render refuses it where the dataset's own should
    be."""
    severity = ERROR if node.name.partition("/")[0] in (*OWN, LOCK) else WARNING
    message = f"is a {node.type}, and those are not followed; put what it stands for in its place, or remove it"
    code = LINK if node.type is NodeType.LINK else SPECIAL
    return Finding(code=code, where=node.name, message=message, severity=severity)
