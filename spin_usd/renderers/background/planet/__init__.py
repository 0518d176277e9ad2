"""A planet: rays that meet it, the light they find, and detail finer than its maps."""
