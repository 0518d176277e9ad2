"""A planet: rays that meet it, the light they find, and noise finer than its maps."""
