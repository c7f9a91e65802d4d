"""Set the number of examples of each property test: a few fixed examples, or the examples of a campaign.

`make campaign` sets RPF3D_EXAMPLES and a seed; test/properties/README.md has the results.
"""

import os

from hypothesis import HealthCheck, Phase, settings

CAMPAIGN = int(os.environ.get("RPF3D_EXAMPLES", "0"))
"""Number of examples for each property; 0 outside a campaign."""


def examples(few: int) -> settings:
    """Return Hypothesis settings for `few` fixed examples, or in a campaign for CAMPAIGN random examples."""
    return settings(
        max_examples=CAMPAIGN or few, derandomize=not CAMPAIGN, deadline=None, database=None,
        suppress_health_check=list(HealthCheck),
        phases=[Phase.explicit, Phase.generate],  # no shrinking, which takes minutes: failing cases are small
    )  # fmt: skip
