"""Alerts: decide on alert levels from evidence and the site's thresholds, and log every decision."""
