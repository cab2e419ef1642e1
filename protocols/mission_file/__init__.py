"""Mission files as ground stations write them."""
