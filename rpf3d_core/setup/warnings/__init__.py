"""Find inputs of a scene that look wrong, such as misplaced sources: warn of them, or refuse them, before a run."""
