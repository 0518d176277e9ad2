"""The looks of Tango: constants of UsdPreviewSurface, one line a material."""

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Look:
    """Inputs of one UsdPreviewSurface; colour is linear Rec. 709 reflectance."""

    colour: tuple[float, float, float]
    metallic: float = 0.0
    roughness: float = 0.5
    clearcoat: float = 0.0
    clearcoat_roughness: float = 0.03


LOOKS: dict[str, Look] = {
    "SolarCell": Look(colour=(0.012, 0.022, 0.075), roughness=0.22, clearcoat=1.0, clearcoat_roughness=0.02),
    "PanelSubstrate": Look(colour=(0.52, 0.50, 0.46), roughness=0.55),
    "GoldMli": Look(colour=(0.83, 0.60, 0.22), metallic=0.8, roughness=0.40),
    "KaptonTape": Look(colour=(0.62, 0.38, 0.10), metallic=0.35, roughness=0.42),
    "BlackMli": Look(colour=(0.030, 0.030, 0.032), roughness=0.38),
    "BlackPaint": Look(colour=(0.045, 0.045, 0.048), roughness=0.55),
    "BrushedAluminium": Look(colour=(0.66, 0.67, 0.68), metallic=0.85, roughness=0.40),
    "WhitePaint": Look(colour=(0.80, 0.80, 0.77), roughness=0.60),
    "Glass": Look(colour=(0.010, 0.010, 0.014), roughness=0.08, clearcoat=1.0, clearcoat_roughness=0.01),
}
