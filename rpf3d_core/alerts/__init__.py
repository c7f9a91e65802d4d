"""Alerts: from evidence and the site's thresholds to a level, with a log from which each decision can be reproduced."""
