"""Alerts: make an alert level from evidence and the site's thresholds, and log every decision."""
