"""The parts of the spacecraft, each a function that returns its surface."""
