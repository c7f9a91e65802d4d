"""Bodies (rocks with a shape): made, flown and in contact, with independent checks of solids, overlap and rotation."""
