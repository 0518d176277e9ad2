"""Root layers as text, over a stage that `spin-usd author` made."""

HEAD = """#usda 1.0
(
    defaultPrim = "World"
    endTimeCode = {end}
    framesPerSecond = 24
    metersPerUnit = 1
    renderSettingsPrimPath = "/Render/Settings"
    startTimeCode = 0
    subLayers = [@./dataset.usda@]
    timeCodesPerSecond = 24
    upAxis = "Z"
)
"""


def over_stage(*, frames: int, metadata: str = "", body: str = "") -> str:
    """A layer to lie beside dataset.usda, which has so many pictures, with these opinions on /World."""
    return f'{HEAD.format(end=frames - 1)}\nover "World" (\n{metadata}\n)\n{{\n{body}\n}}\n'
