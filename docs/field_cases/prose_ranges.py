"""The words of the page on predictive intervals of ground that is not known."""

HEAD = """## Do predictive intervals hold the observed stops?
The figures above use one value for each coefficient. Here the coefficients have ranges, and the prediction is the
distribution of the rocks of 64 parameter sets. A stop is *held along the slope* if it lies within the central 90 % of
the rocks, and *across* if it lies within the central 90 % of those that stopped. Rocks that did not stop, most of which
left the terrain, count as beyond every stop: if they are 5 % or more, the interval has no far end and can only fail on
the near side.

All stops of a site lie on the same ground, so they are not independent trials. Far less than 90 % shows that the
intervals are too narrow; nearly all may only show that they are wide. `python docs/validation.py --ranges` measures
this section.
"""

BOOKS = """### With ranges from the library, before any calibration
The entries were chosen by the description of the ground: at Authume `talus` and `bedrock`, with a shape `ramms_medium`
and `ramms_hard`; at Tschamut `soil` and `ramms_medium_soft`. They have no friction angle, no rolling friction of
spheres and no rolling resistance, so a scene
[assumes ranges](../howto/unknown-ground.md#take-ground-from-the-library). These ranges are **not independent of the
two sites**: those of the friction angle and the rolling resistance are close to the priors of the calibrations on this
page. In the second line of each pair, one value replaces each assumed range: the default angle of 30 degrees, or the
middle of the range. Points have the model `coulomb_limited`.
"""

CALIBRATED = """**One assumed value makes points and spheres far too sure**, although restitution is still a range:
points then hold a quarter of the stops at Authume and none at Tschamut. With ranges, every model holds nearly all
stops along the slope; many of these intervals are open. **Across the slope, points and spheres spread too little** on
any ground.

### With a calibration on the same slope
`rpf3d calibrate` with its defaults: each fold of the stops is kept out, and the others predict it.
"""

ELSEWHERE = """### With a calibration on another slope
The parameter sets of a calibration at one site predict the stops at the other site, without the misfit of the model.
"""

TOO_SURE = """**A calibration on another slope can be far too sure.** Tschamut's sets of rocks with a shape hold nearly
all stops at Authume only because Tschamut's stops hardly narrow the prior. On a slope without observations, take
ranges of the library.
"""
