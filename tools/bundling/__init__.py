"""What tools/bundle is made of."""
