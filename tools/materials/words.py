"""The words by which `author --materials auto` tells what is made of each material of the library.

All the words of an entry must be in a name, in any order, but for `grey` and `black` beside others, which its colour
may say; one that begins or ends in * goes on there; an s at the end of a word says nothing. They are without accents.
Of the entries that a name holds the one of most words counts, then the longest. SUBSTANCES count before PARTS in the
same name; GUESSES count where no name holds either and no colour contradicts.

From 3,237 names in 411 public models of spacecraft, most of them NASA's and their descendants, where `fl` and `sm` mean
flat and smooth, `krinkle` a crinkled film, `bronze` an amber blanket and `nofoil` that it is none. Words of other
languages than English were in none of them.
"""

Words = dict[str, tuple[str, ...]]

SUBSTANCES: Words = {
    "gold_foil": (
        "*foil", "foil*", "gold", "*gold", "golden", "gold foil", "foil orange", "gold kapton", "gold blanket",
        "gold mli", "kapton*", "mli", "amber", "bronze", "*bronze", "folie", "goldfolie", "krinkle", "crinkle",
    ),
    "silver_foil": (
        "silver foil", "silver foil*", "silver mli", "silver kapton", "silver blanket", "silver teflon",
        "grey foil", "grey mli", "grey kapton", "grey krinkle", "gray foil", "alu foil", "aluminum foil",
        "aluminium foil", "silver krinkle", "silberfolie",
    ),
    "black_foil": ("black foil", "black mli", "black kapton", "black blanket", "black krinkle", "black crinkle"),
    "beta_cloth": ("beta cloth", "betacloth*", "beta fabric", "thermal cloth", "white mli", "white blanket"),
    "solar_cell": (
        "solar*", "*solar", "cell", "sacell*", "shiny panel", "sarray*", "photovoltaic*", "fotovolt*", "solaire*",
        "sonnen*", "cellule*", "cella", "celle", "celda", "celula", "taiyodenchi*",
    ),
    "solar_panel_substrate": (
        "substrate*", "backsheet", "array back", "panel back", "solar back", "solar back*", "solar rear",
        "solar edge", "solar frame", "solar base", "solar core", "solar plate", "solar trim", "solar board",
        "cell edge", "solar panel back", "solar panel edge", "solar panel bronze", "solarpanel back",
        "solarpanel gold", "solarback*", "solarpanel bronze", "solarpanel black", "solarpanel edge",
        "solarpanel red", "solarpanel sil", "solar gold", "wing backing",
    ),
    "white_paint": ("white", "*white", "white paint", "weiss", "blanc", "bianco", "blanco"),
    "black_paint": (
        "black", "*black", "blk*", "black metal", "black paint", "black nofoil", "dark", "aeroglaze*", "schwarz*",
        "noir", "nero", "negro", "rubber*",
    ),
    "optical_solar_reflector": ("osr", "optical solar reflector", "ssm", "second surface mirror"),
    "aluminium": (
        "alu", "alumin*", "alluminio", "grey nofoil", "gray nofoil", "silver nofoil", "nofoil", "no foil", "metal",
        "*metal", "metall*", "grey", "gray", "silver", "array lock", "solar shield", "solar strut", "solar truss",
        "solar brace", "solar bracket", "solar arm", "solar drive", "solar panel brace", "solar panel bracket",
        "solarpanel brace", "solarpanel bracket", "solar panel arm", "solar array arm", "solar array drive",
        "solar sensor", "sun sensor",
    ),
    "milled_aluminium": ("milled", "machined*"),
    "brushed_aluminium": ("brushed*",),
    "anodised_aluminium": ("anod*", "elox*", "gold nofoil", "foil nofoil", "gold foil nofoil", "bronze nofoil"),
    "titanium": ("titanium", "titan", "titane", "titanio", "gunmetal"),
    "stainless_steel": (
        "stainless*", "steel", "edelstahl", "stahl", "acier", "acciaio", "acero", "inox", "chrome", "*chrome",
        "nickel*", "nickle", "iron",
    ),
    "gold_plating": ("gold plat*", "goldplat*", "gold mirror", "brass", "messing", "laiton"),
    "copper": ("copper*", "kupfer*", "cuivre", "cobre"),
    "carbon_fibre": ("carbon", "cfrp", "cfk", "kohlefaser*"),
    "glass": ("glass", "*glass", "window", "fenster", "vetro", "vidrio"),
    "kapton_tape": ("kapton tape", "tape"),
}  # fmt: skip

PARTS: Words = {
    "gold_foil": ("blanket", "insulation", "insu", "couverture", "coperta"),
    "solar_cell": ("blue wing", "left wing", "right wing"),
    "white_paint": (
        "antenna", "antennae", "antenn*", "antena*", "dish", "hga", "lga", "mga", "reflector", "subreflect*",
        "parabol*", "radiator", "radiat*", "lens cover", "lens cap",
    ),
    "aluminium": ("gimbal", "hinge", "antenna strut", "dish strut", "reflector strut"),
    "stainless_steel": ("bolt", "screw", "fastener", "schraub*", "spring", "wheel", "motor"),
    "lens": ("lens", "lense", "linse*", "objektiv*", "lente"),
    "antenna_radome": ("radom*", "horn", "helix", "feed", "feednetwork", "phased array"),
    "thruster_nozzle": (
        "nozzle", "*nozzle", "thruster*", "engine", "engine bell", "rcs", "duse", "duese", "triebwerk*", "tuyere",
        "propuls*", "ugello", "tobera",
    ),
    "patch_antenna": ("patch", "patch antenna", "gps antenna", "gnss antenna"),
    "star_tracker_baffle": ("star tracker", "startrack*", "star camera", "baffle", "sternsensor*", "sternkamera*"),
    "silver": ("mirror", "interconnect", "busbar", "bus bar"),
    "cable_jacket": ("cable", "conduit", "harness", "wire", "wiring", "kabel*", "cavo"),
}  # fmt: skip

GUESSES: Words = {
    "gold_foil": ("bus", "body", "main body", "mainbody", "spacecraft base"),
    "solar_cell": ("array", "wing", "sa", "sp", "pv"),
    "white_paint": ("module",),
    "black_paint": ("camera", "telescope"),
    "aluminium": (
        "strut", "truss", "rail", "frame", "plate", "adapter", "bracket", "mast", "boom", "leg", "chassis",
        "structur*", "struktur*",
    ),
    "titanium": ("tank",),
}  # fmt: skip

TIERS = {"substances": SUBSTANCES, "parts": PARTS, "guesses": GUESSES}
