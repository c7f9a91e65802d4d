"""The words of the page on ground that is not known: ranges of the library, values from another slope."""

HEAD = """## Do predictive intervals hold the observed stops?
On a slope without observations, a coefficient is a range. Here the prediction is the distribution of the rocks of 64
parameter sets. A stop is *held along the slope* if it lies within the central 90 % of the rocks, and *across* if it
lies within the central 90 % of those that stopped. Rocks that did not stop count as beyond every stop: if they are 5 %
or more of all rocks, the interval has no far end, and only a stop nearer than its near end is not held. At Tschamut
each stop is compared with the rocks of its own run.

All stops of a site lie on the same ground, so they are not independent trials. Far less than 90 % shows that the
intervals are too narrow; nearly all may only show that they are wide.
"""

BOOKS = """### With ranges from the library, before any calibration
The entries were chosen by the description of the ground: at Authume `talus` and `bedrock`, with a shape `ramms_medium`
and `ramms_hard`; at Tschamut `soil` and `ramms_medium_soft`. They have no friction angle, no rolling friction of
spheres and no rolling resistance, so a scene
[assumes ranges](../howto/unknown-ground.md#take-ground-from-the-library). These ranges are **not independent of the
two sites**: those of the friction angle and the rolling resistance are close to the priors of the calibrations on this
page. In the second line of each pair, one value replaces each assumed range: the default angle of 30 degrees, or the
middle of the range.
"""

TOO_SURE = """**One assumed value makes points and spheres far too sure**, although restitution is still a range:
points then hold a quarter of the stops at Authume and none at Tschamut. With ranges, every model holds at least five
of six stops along the slope; five of the six intervals are open. **Across the slope, intervals of points and spheres
hold too few stops**: 31 and 33 of 41 at Authume with ranges, where many rocks go too far and therefore wide, and 6 of
18 at Tschamut.
"""

ELSEWHERE = """### With a calibration on another slope
The parameter sets of a calibration at one site predict the stops at the other site, without the misfit of the model.
"""

TOO_SURE_ELSEWHERE = """**A calibration on another slope can be far too sure**: the calibrations at Authume hold at
most a third of the stops at Tschamut. Those at Tschamut hold most stops at Authume, except with the
Coulomb-limited model: Tschamut's stops leave most coefficients nearly as uncertain as before, so the intervals stay
wide. No one knows beforehand which of the two it is. On a slope without observations, take ranges of the library.
"""

IMPACTS = """Values from the eleven contacts of Chant Sura, completed by Hoek's values of the simulated site's first
zone, because single impacts cannot calibrate the friction on the ground. At Tschamut the errors are those of Hoek's
values alone, so this says little about single impacts:
"""
