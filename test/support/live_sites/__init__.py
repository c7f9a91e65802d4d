"""Sites of the live simulator: surveys, answers to sources, evidence and alerts."""
