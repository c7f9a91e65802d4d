"""A rock for models that need no data of it."""

from rpf3d_core.materials.rock_context import RockContext

ANY_ROCK = RockContext(rock=None, key=None, impacts=0)
