"""What the validation report is made of: field cases, the models flown on them, and the search that calibrates them."""
