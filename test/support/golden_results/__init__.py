"""The golden digests: their scenes and messages, and the program that compares or renews them."""
