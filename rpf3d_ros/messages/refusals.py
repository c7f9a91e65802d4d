"""Messages that are refused: the node says why and lives on."""

from rpf3d_core.errors import InputError


class MessageRefused(InputError):
    """A received message cannot be used; the sentence names the topic's field and what would be right."""
