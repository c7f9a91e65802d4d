"""The context of a rock for tests of models that read no data of the rock."""

from rpf3d_core.materials.rock_context import RockContext

ANY_ROCK = RockContext(rock=None, key=None, impacts=0)
