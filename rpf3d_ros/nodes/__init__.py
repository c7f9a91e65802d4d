"""The nodes and programs: parameters, life cycle, topics and publishers."""
