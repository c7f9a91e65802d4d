"""Messages to values and back; no node, no thread."""
