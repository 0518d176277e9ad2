"""The materials of the library, by name: one entry each.

Metals have the colour by which Schlick's formula, which UsdPreviewSurface's metals follow, comes nearest to Fresnel's
at 0, 30 and 60 degrees. Paints and cloths reflect, head-on, 1 minus their solar absorptance. A roughness is the one of
UsdPreviewSurface: its square is the width alpha of the distribution of slopes.
"""

import numpy as np

from materials import cells
from materials import colours as c
from materials import optical_constants as constants
from materials.library_material import LibraryMaterial
from materials.optical_constants import OpticalConstants
from materials.optics import Reflectance, fit_errors, head_on
from materials.values import Colour, MaterialValues, Picture, Sample, worn

FORTESCUE = "Fortescue, Swinerd and Stark, Spacecraft Systems Engineering, 4th edition, 2011, table 11.3"
YANG = "Yang and others, Photonics 12(1), 17 (2025), appendix A"
SPIN = "the Tango that SPIN ships"
OURS = "Roughness and limits are ours."
FILM_ROUGHNESS = 0.385  # of slopes of 0.105 (root mean square), the fit of Yang: (sqrt(2) 0.105) ** 0.5
WHITE_ROUGHNESS = 0.475  # of slopes of 0.158
WHITE_IOR = 1.22  # the same fit at 560 nm

ALUMINIUM, COPPER = c.metal(constants.ALUMINIUM), c.metal(constants.COPPER)
GOLD_FOIL = c.on_metal(constants.KAPTON, constants.ALUMINIUM, c.KAPTON_THICKNESS)
TAPE = c.on_metal(constants.KAPTON, constants.ALUMINIUM, c.TAPE_THICKNESS)
MIRROR = c.on_metal(constants.FUSED_SILICA, constants.SILVER, c.SILICA_THICKNESS)
ANODISED_SHARE = 0.77
ANODISED = c.scaled(ANODISED_SHARE, ALUMINIUM)

GOLD_TONE, AMBER_TONE = head_on(GOLD_FOIL), head_on(TAPE)
SILVER_TONE, COPPER_TONE = head_on(ALUMINIUM), head_on(COPPER)
FOIL_COLOURS = (GOLD_TONE, AMBER_TONE, SILVER_TONE, COPPER_TONE)
CELL_FACTORS = ((1.0, 1.0, 1.0), (0.55, 0.5, 0.35), (1.0, 0.6, 0.75), (0.7, 1.0, 0.6))  # blue, black, purple, teal
WHITES = ((0.85, 0.85, 0.85), (0.74, 0.74, 0.74), (0.66, 0.65, 0.62), (0.55, 0.55, 0.54))
BLACKS = ((0.01, 0.01, 0.01), (0.03, 0.03, 0.03), (0.05, 0.05, 0.052))
FOIL = Picture(file="foil_normal.png", metres=(0.42, 0.42), degrees=17.0)
BRUSHED = Picture(file="brushed_normal.png", metres=(0.12, 0.12))
STREAKS = Sample(picture=Picture(file="brushed_roughness.png", metres=(0.12, 0.12)), output="r", scale=0.30, bias=0.27)
BARS = Picture(file="cell_array_bars.png", metres=cells.AREA)


def _error(reflectance: Reflectance) -> str:
    of_light, relative = fit_errors(reflectance, head_on(reflectance))
    apart = f"{of_light:.3f} of the light, {100 * relative:.1f} % of what is reflected"
    return f"Schlick's formula differs from Fresnel's at 0, 30 and 60 degrees by at most {apart}."


def _metal(
    of: OpticalConstants,
    about: str,
    roughness: float | Sample,
    limits: tuple[float, float],
    *,
    normal: Picture | None = None,
    absorptance: float | None = None,
) -> LibraryMaterial:
    """A bare metal whose index is known; `absorptance` is what is published for sunlight."""
    reflectance = c.metal(of)
    body = head_on(reflectance)
    compared = f"Polished parts absorb {absorptance:.2f} of sunlight ({FORTESCUE}). " if absorptance else ""
    return LibraryMaterial(
        kind="metal",
        about=about,
        source=f"Colour computed from n and k of {of.paper}. {_error(reflectance)} {compared}{OURS}",
        values=MaterialValues(colour=body, metallic=1.0, roughness=roughness, normal=normal),
        body=body,
        reflectance=reflectance,
        colours=(body, _darker(body, 0.85), _darker(body, 0.7)),
        roughness=limits,
    )


def _darker(colour: Colour, by: float) -> Colour:
    return c.tuple_of(by * np.array(colour))


def _foil(about: str, source: str, reflectance: Reflectance, roughness: Sample, normal: Picture) -> LibraryMaterial:
    """A metallised film, crinkled."""
    body = head_on(reflectance)
    return LibraryMaterial(
        kind="foil",
        about=about,
        source=f"{source} {_error(reflectance)}",
        values=MaterialValues(colour=body, metallic=1.0, roughness=roughness, normal=normal),
        body=body,
        reflectance=reflectance,
        colours=FOIL_COLOURS,
        roughness=(0.15, 0.55),
    )


def _body(
    kind: str,
    about: str,
    source: str,
    values: MaterialValues,
    body: Colour,
    *,
    colours: tuple[Colour, ...],
    roughness: tuple[float, float],
) -> LibraryMaterial:
    """A dielectric over a body that scatters, under a clearcoat where its values have one."""
    below = c.dielectric(values.ior, body)
    return LibraryMaterial(
        kind=kind,
        about=about,
        source=source,
        values=values,
        body=body,
        reflectance=c.coated(below) if values.clearcoat else below,
        colours=colours,
        roughness=roughness,
    )


def _cells(about: str, source: str, file: str, body: Colour, clearcoat: float) -> LibraryMaterial:
    """An area of solar cells, of whose light a part is scattered."""
    values = MaterialValues(
        colour=Sample(picture=Picture(file=file, metres=cells.AREA, raw=False), output="rgb"),
        metallic=Sample(picture=BARS, output="r", scale=0.57, bias=0.43),
        roughness=Sample(picture=BARS, output="r", scale=0.25, bias=0.15),
        clearcoat=clearcoat,
        ior=1.0,
    )
    return LibraryMaterial(
        kind="cell",
        about=about,
        source=f"{source} Metalness 0.43 and roughness 0.15 are those of {SPIN}; pattern, tones and limits are ours.",
        values=values,
        body=body,
        reflectance=c.coated(c.uniform(body)) if clearcoat else c.uniform(body),
        colours=CELL_FACTORS,
        roughness=(0.05, 0.35),
    )


WHITE = c.body_for(0.26, WHITE_IOR)
BLACK = c.body_for(0.95, 1.5)
CLOTH = c.body_for(0.37, 1.35, (1.02, 1.0, 0.98))
BLACK_FOIL = (0.030, 0.030, 0.032)
TWILL = 0.030
LAMINATE = (0.62, 0.58, 0.48)

LIBRARY: dict[str, LibraryMaterial] = {
    "gold_foil": _foil(
        "Multi-layer insulation whose outer sheet is amber polyimide, aluminised on its inside, crinkled.",
        f"Colour computed: aluminium ({constants.ALUMINIUM.paper}) behind 25 um of Kapton ({constants.KAPTON.paper}); "
        f"aluminised Kapton, Kapton outside, absorbs 0.40 of sunlight, infrared included ({FORTESCUE}). Roughness near "
        f"the 0.355 of {SPIN}; wear, crinkles and limits are ours.",
        GOLD_FOIL,
        worn(0.34, 0.30, size=0.43),
        FOIL,
    ),
    "silver_foil": _foil(
        "Multi-layer insulation whose outer sheet is aluminised on its outside, crinkled.",
        f"Colour computed from n and k of aluminium ({constants.ALUMINIUM.paper}); aluminised Kapton, aluminium "
        f"outside, absorbs 0.14 of sunlight ({FORTESCUE}). Roughness by slopes of 0.105 of silver polyimide film "
        f"({YANG}); wear, crinkles and limits are ours.",
        ALUMINIUM,
        worn(FILM_ROUGHNESS, 0.25, size=0.43),
        FOIL,
    ),
    "black_foil": _body(
        "foil",
        "Multi-layer insulation whose outer sheet is black, carbon-filled polyimide, crinkled.",
        "All numbers are ours: it reflects 0.07 head-on.",
        MaterialValues(
            colour=BLACK_FOIL,
            roughness=0.28,
            normal=Picture(file="foil_normal.png", metres=(0.36, 0.36), degrees=-31.0),
        ),
        BLACK_FOIL,
        colours=(BLACK_FOIL, (0.015, 0.015, 0.016), (0.06, 0.058, 0.056)),
        roughness=(0.18, 0.5),
    ),
    "beta_cloth": _body(
        "cloth",
        "Beta cloth, glass-fibre fabric in fluoropolymer over an aluminised film, off-white and matt.",
        "It reflects 0.63 head-on, its index is 1.35 as of fluoropolymers, its weave is of 0.75 mm threads: all ours.",
        MaterialValues(
            colour=CLOTH, roughness=0.75, ior=1.35, normal=Picture(file="weave_normal.png", metres=(0.003, 0.003))
        ),
        CLOTH,
        colours=(CLOTH, (0.72, 0.71, 0.69), (0.55, 0.53, 0.48)),
        roughness=(0.6, 0.95),
    ),
    "solar_cell": _cells(
        "Solar cells of 80 x 40 mm under coverglass, with fingers and bus bars, in an array with gaps.",
        f"Colour computed: silicon ({constants.SILICON.paper}) under titanium dioxide ({constants.TITANIA.paper}) of a "
        "quarter wave at 600 nm under glass; a smooth coat of index 1.5 is the coverglass.",
        "cell_array.png",
        c.CELL,
        1.0,
    ),
    "solar_cell_bare": _cells(
        "Solar cells of 80 x 40 mm without coverglass, with fingers and bus bars, in an array with gaps.",
        f"Colour computed: silicon ({constants.SILICON.paper}) under silicon nitride ({constants.NITRIDE.paper}) of a "
        "quarter wave at 600 nm.",
        "cell_array_bare.png",
        c.CELL_BARE,
        0.0,
    ),
    "solar_panel_substrate": _body(
        "panel",
        "The back of a solar panel: a carbon composite sheet below a film of polyimide.",
        f"Colour computed: a body that scatters 0.05 (ours) behind 25 um of Kapton ({constants.KAPTON.paper}), whose "
        f"index is 1.8. {OURS}",
        MaterialValues(colour=c.BETWEEN_CELLS, roughness=worn(0.40, 0.30), ior=1.8),
        c.BETWEEN_CELLS,
        colours=(c.BETWEEN_CELLS, (0.02, 0.02, 0.02), (0.30, 0.27, 0.20), (0.52, 0.50, 0.46)),
        roughness=(0.25, 0.7),
    ),
    "white_paint": _body(
        "paint",
        "White thermal-control paint, a silicone.",
        f"It absorbs 0.26 of sunlight ({FORTESCUE}; a silicate 0.12). Index 1.22 and slopes of 0.158 of a white "
        f"coating ({YANG}); wear and limits are ours.",
        MaterialValues(colour=WHITE, roughness=worn(WHITE_ROUGHNESS, 0.30, size=0.37, degrees=61.0), ior=WHITE_IOR),
        WHITE,
        colours=(WHITE, *WHITES),
        roughness=(0.35, 0.8),
    ),
    "black_paint": _body(
        "paint",
        "Black thermal-control paint, epoxy or polyurethane.",
        f"It absorbs 0.95 of sunlight ({FORTESCUE}). Wear, roughness and limits are ours.",
        MaterialValues(colour=BLACK, roughness=worn(0.42, 0.36, size=0.23)),
        BLACK,
        colours=(BLACK, *BLACKS[1:]),
        roughness=(0.3, 0.9),
    ),
    "optical_solar_reflector": LibraryMaterial(
        kind="mirror",
        about="Second-surface mirrors, 40 mm tiles of silvered fused silica, each with a lean of its own.",
        source=f"Colour computed: silver ({constants.SILVER.paper}) behind 0.15 mm of fused silica "
        f"({constants.FUSED_SILICA.paper}); such mirrors absorb 0.07 of sunlight ({FORTESCUE}). {_error(MIRROR)} "
        "Tiles, leans, roughness and limits are ours.",
        values=MaterialValues(
            colour=Sample(
                picture=Picture(file="mirror_tiles.png", metres=(0.32, 0.32)), output="rgb", scale=head_on(MIRROR)
            ),
            metallic=1.0,
            roughness=0.06,
            normal=Picture(file="mirror_tiles_normal.png", metres=(0.32, 0.32)),
        ),
        body=head_on(MIRROR),
        reflectance=MIRROR,
        colours=((1.0, 1.0, 1.0), (0.93, 0.93, 0.93), (0.85, 0.83, 0.78)),
        roughness=(0.05, 0.2),
    ),
    "aluminium": _metal(
        constants.ALUMINIUM,
        "Bare aluminium, fairly smooth.",
        worn(0.24, 0.16, size=0.31),
        (0.1, 0.45),
        absorptance=0.24,
    ),
    "milled_aluminium": _metal(
        constants.ALUMINIUM,
        "Aluminium as a face mill leaves it, in passes of arcs.",
        worn(0.28, 0.14, size=0.31),
        (0.18, 0.5),
        absorptance=0.24,
        normal=Picture(file="milled_normal.png", metres=(0.10, 0.10)),
    ),
    "brushed_aluminium": _metal(
        constants.ALUMINIUM, "Aluminium brushed along s.", STREAKS, (0.25, 0.6), normal=BRUSHED, absorptance=0.24
    ),
    "anodised_aluminium": LibraryMaterial(
        kind="metal",
        about="Clear anodised aluminium, satin.",
        source=f"Colour: {ANODISED_SHARE} (ours) of what aluminium reflects, by n and k of "
        f"{constants.ALUMINIUM.paper}. {OURS} Dyes are ours.",
        values=MaterialValues(
            colour=head_on(ANODISED), metallic=1.0, roughness=worn(0.46, 0.16, size=0.33, degrees=23.0)
        ),
        body=head_on(ANODISED),
        reflectance=ANODISED,
        colours=(head_on(ANODISED), (0.04, 0.04, 0.045), (0.62, 0.45, 0.16), (0.10, 0.18, 0.42), (0.45, 0.08, 0.06)),
        roughness=(0.35, 0.7),
    ),
    "titanium": _metal(constants.TITANIUM, "Bare titanium.", worn(0.36, 0.20, size=0.29), (0.2, 0.6), absorptance=0.60),
    "stainless_steel": _metal(
        constants.STEEL, "Austenitic stainless steel.", worn(0.30, 0.18, size=0.29), (0.12, 0.55)
    ),
    "gold_plating": _metal(
        constants.GOLD, "Gold plating on machined parts.", worn(0.22, 0.14, size=0.27), (0.1, 0.45), absorptance=0.25
    ),
    "copper": _metal(constants.COPPER, "Bare copper.", worn(0.30, 0.20, size=0.27), (0.15, 0.55)),
    "silver": _metal(constants.SILVER, "Silver, as of interconnects between cells.", 0.30, (0.15, 0.5)),
    "carbon_fibre": _body(
        "composite",
        "Carbon-fibre composite, a twill of 2 mm tows in epoxy.",
        "The tows reflect 0.03 at most, the resin's index is 1.55, roughness 0.28: all ours.",
        MaterialValues(
            colour=Sample(
                picture=Picture(file="twill_tone.png", metres=(0.016, 0.016)), output="rgb", scale=(TWILL,) * 3
            ),
            roughness=0.28,
            ior=1.55,
            normal=Picture(file="twill_normal.png", metres=(0.016, 0.016)),
        ),
        (TWILL,) * 3,
        colours=((1.0, 1.0, 1.0), (0.5, 0.5, 0.52), (2.0, 2.0, 1.9)),
        roughness=(0.15, 0.5),
    ),
    "glass": _body(
        "glass",
        "A window of glass over the dark: two surfaces that reflect, and next to nothing behind them.",
        "Index 1.5 of the surface and of a coat over it; the dark behind it, roughness and limits are ours.",
        MaterialValues(colour=(0.010, 0.010, 0.014), roughness=0.05, clearcoat=1.0, clearcoat_roughness=0.01),
        (0.010, 0.010, 0.014),
        colours=((0.010, 0.010, 0.014), (0.004, 0.004, 0.004), (0.006, 0.016, 0.012)),
        roughness=(0.03, 0.15),
    ),
    "lens": _body(
        "optics",
        "The front lens of a camera, coated against reflections.",
        f"Index {c.LENS_IOR}: it reflects head-on as crown glass (1.52) under a quarter wave of magnesium fluoride "
        "(1.38) at 550 nm does, computed as a thin film. The dark behind it, roughness and limits are ours.",
        MaterialValues(colour=(0.006, 0.004, 0.010), roughness=0.05, ior=c.LENS_IOR),
        (0.006, 0.004, 0.010),
        colours=((0.006, 0.004, 0.010), (0.003, 0.008, 0.006), (0.012, 0.005, 0.004)),
        roughness=(0.03, 0.12),
    ),
    "antenna_radome": _body(
        "plastic",
        "The radome of an antenna: glass-fibre laminate, painted white.",
        f"It absorbs 0.26 of sunlight as white silicone paint does ({FORTESCUE}); index 1.5. {OURS}",
        MaterialValues(colour=c.body_for(0.26, 1.5), roughness=worn(0.48, 0.20, size=0.41)),
        c.body_for(0.26, 1.5),
        colours=(c.body_for(0.26, 1.5), (0.60, 0.57, 0.48), (0.30, 0.30, 0.30), (0.05, 0.05, 0.05)),
        roughness=(0.3, 0.8),
    ),
    "thruster_nozzle": LibraryMaterial(
        kind="metal",
        about="A thruster's nozzle of niobium, with the colours of its oxide in bands across t.",
        source=f"Colours computed: niobium ({constants.NIOBIUM.paper}) under 12 to 62 nm of an oxide of index 2.3, a "
        f"thin film. Of bare niobium: {_error(c.metal(constants.NIOBIUM))} Thicknesses, bands, roughness and limits "
        "are ours.",
        values=MaterialValues(
            colour=Sample(picture=Picture(file="heat_tint.png", metres=(0.30, 0.30), raw=False), output="rgb"),
            metallic=1.0,
            roughness=worn(0.36, 0.20, size=0.21),
        ),
        body=head_on(c.metal(constants.NIOBIUM)),
        reflectance=c.metal(constants.NIOBIUM),
        colours=((1.0, 1.0, 1.0), (0.6, 0.6, 0.6), (1.2, 1.1, 1.0)),
        roughness=(0.2, 0.6),
    ),
    "patch_antenna": LibraryMaterial(
        kind="composite",
        about="A patch antenna: square patches of tinned metal on a pale laminate, one in 60 mm.",
        source="All numbers are ours: a laminate of index 1.5, and patches of a metal of the same colour.",
        values=MaterialValues(
            colour=LAMINATE,
            metallic=Sample(picture=Picture(file="patch_antenna.png", metres=(0.06, 0.06)), output="r"),
            roughness=Sample(
                picture=Picture(file="patch_antenna.png", metres=(0.06, 0.06)), output="r", scale=-0.15, bias=0.45
            ),
        ),
        body=LAMINATE,
        reflectance=c.dielectric(1.5, LAMINATE),
        colours=(LAMINATE, (0.70, 0.70, 0.68), (0.75, 0.53, 0.24), (0.25, 0.30, 0.18)),
        roughness=(0.2, 0.6),
    ),
    "star_tracker_baffle": _body(
        "optics",
        "The inside and outside of a star tracker's baffle: a very black, matt coating.",
        "It reflects 0.03 head-on, with an index of 1.3: all ours.",
        MaterialValues(colour=(0.013, 0.013, 0.013), roughness=0.85, ior=1.3),
        (0.013, 0.013, 0.013),
        colours=((0.013, 0.013, 0.013), (0.005, 0.005, 0.005), (0.03, 0.03, 0.03)),
        roughness=(0.6, 1.0),
    ),
    "kapton_tape": _foil(
        "Amber polyimide tape over foil.",
        f"Colour computed: aluminium ({constants.ALUMINIUM.paper}) behind 51 um of Kapton ({constants.KAPTON.paper}), "
        "film and adhesive. Roughness, wear, crinkles and limits are ours.",
        TAPE,
        worn(0.32, 0.30, size=0.29, degrees=41.0),
        Picture(file="foil_normal.png", metres=(0.30, 0.30)),
    ),
    "cable_jacket": _body(
        "plastic",
        "The jacket of a cable, off-white fluoropolymer.",
        "All numbers are ours, by pictures of harnesses.",
        MaterialValues(colour=(0.66, 0.65, 0.61), roughness=0.38),
        (0.66, 0.65, 0.61),
        colours=((0.66, 0.65, 0.61), (0.80, 0.79, 0.76), (0.12, 0.12, 0.12), (0.35, 0.10, 0.06)),
        roughness=(0.25, 0.6),
    ),
}
