"""Flights of rocks over simple terrains on one or both engines, and the models, rocks and obstacles that they need."""
