"""The scene file: its keys, the models and effects that it may name, and the messages about its errors."""
