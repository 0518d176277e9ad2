"""The numbers of the spacecraft: metres, Tango's body axes (origin in the plane of the bottom plate, +z to the panel).

The eleven official points are facts of the SPEED+ data set (tango3Dpoints, in their published order); the model is
built around them and holds them exactly. The other proportions were estimated from published pictures. Tango's
sides are taken as upright: its body was 0.57 m deep, which is the depth of the bottom plate, and the panel
stands over it on both sides.
"""

# name, x, y, z; the order is the official one, 1 to 11, and the number ends the name.
OFFICIAL_POINTS: tuple[tuple[str, float, float, float], ...] = (
    ("top_corner_1", -0.3700, -0.3850, 0.3215),
    ("top_corner_2", -0.3700, 0.3850, 0.3215),
    ("top_corner_3", 0.3700, 0.3850, 0.3215),
    ("top_corner_4", 0.3700, -0.3850, 0.3215),
    ("bottom_corner_5", -0.3700, -0.2640, 0.0000),
    ("bottom_corner_6", -0.3700, 0.3040, 0.0000),
    ("bottom_corner_7", 0.3700, 0.3040, 0.0000),
    ("bottom_corner_8", 0.3700, -0.2640, 0.0000),
    ("antenna_tip_9", -0.5427, 0.4877, 0.2535),
    ("antenna_tip_10", 0.5427, 0.4877, 0.2591),
    ("antenna_tip_11", 0.3050, -0.5790, 0.2515),
)
POINT = {name: (x, y, z) for name, x, y, z in OFFICIAL_POINTS}

# Body: a deck below, blankets around; they stay inside the corner points by the depth of their wrinkles.
X = 0.370
Y_BACK, Y_FRONT = -0.264, 0.304
Y_MIDDLE = (Y_BACK + Y_FRONT) / 2
DECK = 0.010
BLANKET_INSET = 0.0080
BLANKET_WRINKLE = 0.0075
BLANKET_CELL, BLANKET_CELL_BELOW = 0.022, 0.026
SEAM_X, SEAM_HEIGHT = (-0.185, 0.185), 0.0026  # seams up the y walls, and how far tape stands above held foil
BUTTON_RADIUS, BUTTON_HEIGHT = 0.0080, 0.0030
TAPE_WIDTH = 0.014

# Solar panel: a honeycomb plate with a rim; two halves of 4 x 18 cells (80 x 40 mm class, two corners cropped).
PANEL_Y = 0.385
PANEL_BOTTOM, PANEL_TOP = 0.2995, 0.3215
PANEL_RIM, PANEL_RECESS = 0.006, 0.0012
CELL_THICKNESS = 0.0008
CELL_AREA_X = (0.022, 0.350)
CELL_AREA_Y = (-0.369, 0.369)
CELL_COLUMNS, CELL_ROWS = 4, 18
CELL_GAP = 0.0020
CELL_CROP = 0.006
COVERGLASS_EDGE = 0.00015
TABS, TAB_SIZE = 4, (0.0055, 0.0046)  # interconnects from each cell to the next, each over gap and rims
BUS_BAR_Y, RIVET_X = 0.3740, 0.3570
CELL_SIZE = tuple(
    (high - low) / count - CELL_GAP for (low, high), count in ((CELL_AREA_X, CELL_COLUMNS), (CELL_AREA_Y, CELL_ROWS))
)
CELL_TILT = 0.3  # degrees, either way: no two cells lie quite alike, so each has its own glint
CELL_TONES = (4, 6)  # shades of cells, side by side in their texture, and how much st that texture covers
CELL_ATLAS = (CELL_TONES[0] * CELL_SIZE[0], CELL_TONES[1] * CELL_SIZE[1])

# Main antennas: where each rod starts, its radii at base and tip, and the height of the collar at its base.
ANTENNA_BASE = {
    "antenna_tip_9": (-0.3660, 0.3720, 0.2545),
    "antenna_tip_10": (0.3660, 0.3720, 0.2545),
    "antenna_tip_11": (0.3000, -0.3000, 0.2470),
}
ANTENNA_RADII = {
    "antenna_tip_9": (0.0410, 0.0290),
    "antenna_tip_10": (0.0410, 0.0290),
    "antenna_tip_11": (0.0310, 0.0250),
}
COLLAR_HEIGHT = 0.030
WHIP_BASE = (X, 0.0, 0.2530)
WHIP_TIP_X, WHIP_RADIUS = 0.500, 0.0018
PATCH_RADIUS, PATCH_HEIGHT = 0.0367, 0.010
PATCH_CENTRE = (X, -0.120, 0.250)

# Struts that carry the panel and stiffen the corners: flat bars of this section.
STRUT_WIDTH, STRUT_THICKNESS = 0.010, 0.010

# The +y side: a radiator in two steps, and the optical heads below the panel's edge.
RADIATOR = ((-0.070, 0.180, 0.012, 0.150), (-0.150, -0.072, 0.014, 0.120))
RADIATOR_THICKNESS = 0.015
HEAD_X = (-0.018, 0.028, 0.074)
HEAD_END_Y = (0.455, 0.415, 0.415)
HEAD_Z, HEAD_RADIUS = 0.2830, 0.0110

# Below: the separation ring, and three release feet around it.
RING_RADII, RING_HEIGHT = (0.128, 0.142), 0.011
FOOT_RADIUS, FOOT_HEIGHT, HOOK_HEIGHT = 0.205, 0.010, 0.020

# The mock-up in the test bed of SPEED+, as the look `mockup` paints it: read off real pictures that were rectified by
# their poses, to about 3 mm. The panel has two fields of cells (x from, x to, the cropped side of a cell: +y or -y).
MOCKUP_FIELDS = ((-0.3410, -0.0105, 1), (0.0185, 0.3520, -1))
MOCKUP_FIELD_Y = (-0.3700, 0.3620)
MOCKUP_COLUMNS, MOCKUP_ROWS = 4, 17
MOCKUP_GAP, MOCKUP_CROP = 0.0024, 0.0105
MOCKUP_FOLD_WIDTH, MOCKUP_FOLD_HEIGHT = 0.0080, 0.0026  # standard deviation across a fold of the film, and its ridge
MOCKUP_FILM = 0.004  # metres by which the film stands below the deck, over its bolts
MOCKUP_DOME, MOCKUP_DOME_CENTRE = (0.051, 0.024), (X, -0.071, 0.240)  # radius and height; -x has its mirror image
MOCKUP_DOME_SCREWS = 0.0245  # how far its four screws are from its middle, along y and along z
MOCKUP_FEET = ((-0.205, 0.200), (0.228, 0.205), (0.006, -0.188))  # the middles of three pads below the deck
# The plates of the radiator (x from, x to, z from, z to, height above the wall), and each mast's radii at base and tip.
MOCKUP_RADIATOR = ((-0.075, 0.206, 0.022, 0.166, 0.032), (-0.157, -0.073, 0.022, 0.128, 0.010))
MOCKUP_MAST = {
    "antenna_tip_9": (0.030, 0.0225),
    "antenna_tip_10": (0.030, 0.0225),
    "antenna_tip_11": (0.026, 0.0210),
}
# Ball antennas, one on each x wall: the ball's radius, and by the side of the x axis where its box stands (y, z).
MOCKUP_BALL = 0.0165
MOCKUP_BALLS = {1: (-0.013, 0.287), -1: (0.096, 0.283)}
# Small black boxes on walls and edges, low and high corner.
MOCKUP_BOXES = (
    ((X - 0.002, 0.128, 0.262), (0.402, 0.164, 0.311)),
    ((-0.384, -0.067, 0.001), (0.002 - X, -0.035, 0.027)),
    ((-0.178, PANEL_Y - 0.002, 0.280), (-0.130, 0.400, 0.318)),
    ((-0.372, -0.389, 0.286), (-0.337, 0.002 - PANEL_Y, 0.319)),
)
MOCKUP_ROD = (-0.405, 0.236, -0.085, 0.225)  # beside the -x wall: x, y, and z from and to
