"""Tango, the smaller PRISMA spacecraft, as a parametric model; run by tools/build_tango."""
