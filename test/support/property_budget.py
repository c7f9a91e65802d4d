"""How many examples a property is tried on: a few, always the same, or a campaign's.

`make campaign` sets RPF3D_EXAMPLES and a seed; what came of it stands in test/properties/README.md.
"""

import os

from hypothesis import HealthCheck, Phase, settings

CAMPAIGN = int(os.environ.get("RPF3D_EXAMPLES", "0"))
"""Examples of each property; 0 for the few of every test run."""


def examples(few: int) -> settings:
    """Settings for so many examples, or the campaign's."""
    return settings(
        max_examples=CAMPAIGN or few, derandomize=not CAMPAIGN, deadline=None, database=None,
        suppress_health_check=list(HealthCheck),
        phases=[Phase.explicit, Phase.generate],  # a failing case of a few numbers needs no minutes of shrinking
    )  # fmt: skip
