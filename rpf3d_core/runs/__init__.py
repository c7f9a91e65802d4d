"""What a user does with a scene: run, check and compare it, alone or over processes."""
