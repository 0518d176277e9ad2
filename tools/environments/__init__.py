"""The images of the environments, made by formulas: see tools/build_environments."""
