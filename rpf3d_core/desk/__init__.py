"""The desk: a page in a browser of this machine, to place sources, edit materials, fly rocks and read results."""
