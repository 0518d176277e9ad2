"""What mutants are made of: extreme numbers, and words that mean something to a parser."""

NUMBERS = (
    b"nan", b"NaN", b"inf", b"-inf", b"Infinity", b"1e308", b"-1e308", b"1e400", b"1e-320", b"5e-324", b"0", b"-0.0",
    b"-1", b"1", b"2", b"255", b"256", b"65535", b"65536", b"2147483647", b"2147483648", b"-2147483648", b"4294967295",
    b"4294967296", b"9223372036854775807", b"9223372036854775808", b"-9223372036854775808", b"18446744073709551616",
    b"1e38", b"3.5e38", b"1e-45", b"0.1", b"1.0000001", b"99999999", b"1e999999999", b"0x10", b"1_000", b"1e", b"--1",
    b"9" * 400, b"null", b"true", b'"1"', b"[]", b"{}", b"()", b"(1, 2)", b"None",
)  # fmt: skip
_REALS = (float("nan"), float("inf"), -float("inf"), 1e38, 1e-40, -1.0)
BINARY_NUMBERS: tuple[tuple[str, float], ...] = (
    *((order + kind, value) for order in "<>" for kind in "hiq" for value in (-1, 0, 1, 0x7FFF, -0x8000)),
    *((order + kind, value) for order in "<>" for kind in "iq" for value in (0x7FFFFFFF, -0x80000000, 1 << 20)),
    *((order + kind, value) for order in "<>" for kind in "fd" for value in _REALS),
)
"""Formats of `struct`, with a number for each."""
WORDS = (
    # paths
    b"../../outside/secret.usda", b"../outside/private.png", b"../outside/secret.mtl", b"/etc/passwd", b"/dev/zero",
    b"file:///etc/passwd", b"http://127.0.0.1:9/a.usda", b"..", b".", b"", b"a" * 5000, b"a\\b", b"a.<UDIM>.png",
    b"C:\\a.usda", b"./a\x00b.usda", b"anon:0x1", b"a.usdz[b.usda]", b"${HOME}/a.usda", b"~/a.usda", b"stage.usda",
    # text
    b"\xff\xfe", b"\xef\xbb\xbf", b"\xc3\x28", b"\xed\xa0\x80", "\u202e".encode(), b"\x1b[31m", b"\r\n", b"\x00",
    "\U0001f680".encode(), b"%s%n", b"'", b'"', b"@", b"\\", b"\\u0000", b"\\ud800", b"`id`", b"$(id)", b"<!--",
    # USD
    b"def", b"over", b"class", b"Mesh", b"Xform", b"Camera", b"Scope", b"PointInstancer", b"DistantLight", b"DomeLight",
    b"Sphere", b"BasisCurves", b"timeSamples", b"variantSet", b"references", b"payload", b"inherits", b"specializes",
    b"subLayers", b"clips", b"instanceable = true", b"token", b"string", b"double", b"float", b"int", b"int64", b"bool",
    b"asset", b"matrix4d", b"quath", b"quatf", b"half", b"double3[]", b"opaque", b"dkuble", b"rel", b"uniform",
    b"custom", b"None", b"delete", b"</World/Target>", b"</>", b"<>", b"nameChildren", b"interpolation", b"primvars:st",
    b"xformOp:transform", b"!invert!xformOp:translate", b"!resetXformStack!", b"faceVarying", b"leftHanded",
    # tables and JSON
    b"null", b"true", b"[]", b"{}", b"[[]]", b'{"a": 1, "a": 2}', b"/*", b"# ", b"nominal", b"record-1", b"dataset-1",
    b"schema", b"sha256", b"path", b"img000001", b"image/nominal/img000001.png", b"a.a.a", b"[[a]]", b"'''", b'"""',
    # models
    b"f 1 1 1", b"f 99 1 2", b"f -9 -1 -2", b"v 1 2", b"v nan nan nan", b"usemtl none", b"mtllib /etc/passwd",
    b"element face 99999999", b"property list uchar int vertex_indices", b"property list int64 double x", b"end_header",
    b"format binary_big_endian 1.0", b"endsolid", b"facet normal", b"KHR_draco_mesh_compression",
    b"EXT_meshopt_compression", b"KHR_texture_transform", b"sparse", b"extensionsRequired",
    b"data:image/png;base64,AAAA", b"map_Kd -s nan 1 1 ../outside/private.png", b"newmtl red", b"Tr 2",
    b"Kd 1e308 -1 nan",
)  # fmt: skip
