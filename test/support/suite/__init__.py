"""What serves the run of the tests itself: their order, selection and number of examples; checked words and files."""
