"""A network that learns poses from pictures, and experiments that say which pictures it learns best from."""
