"""Materials of spacecraft as USD layers: their numbers, where these are from, and the textures."""
