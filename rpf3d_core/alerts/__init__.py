"""Alerts: from evidence and the site's thresholds to a level, and the log from which that can be reproduced."""
