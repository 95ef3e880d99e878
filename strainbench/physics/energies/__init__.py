"""The parts of a cloth's energy."""
