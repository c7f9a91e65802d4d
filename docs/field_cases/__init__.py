"""Make the validation page: field cases, the models that are compared with them, calibrations, pictures and text."""
