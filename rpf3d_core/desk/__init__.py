"""The desk: a scene in the browser of this machine, to place sources, edit materials, fly rocks and read results."""
