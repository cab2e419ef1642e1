"""The simulated Naze: a Harakiri flight controller that lies well enough to be tested against."""
