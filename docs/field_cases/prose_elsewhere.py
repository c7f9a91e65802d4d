"""Texts of docs/explanation/validation.md on unknown ground: ranges of the library, values from another slope."""

HEAD = """## Do predicted intervals contain the observed stops?
On a slope without observations, each coefficient has a range. Here the prediction is the distribution of the rocks of
64 parameter sets. The 90 % interval *along the slope* contains the central 90 % of all rocks. The interval *across the
slope* contains the central 90 % of the rocks that stopped. At Tschamut each stop is compared with the rocks of its run.

Rocks that did not stop count as beyond every stop along the slope. If they are 5 % or more of all rocks, the interval
has no far end (*open*), and contains every stop beyond its near end.

All stops of a site lie on the same ground, so they are not independent trials. An interval that contains far less than
90 % of the stops is too narrow; an interval that contains nearly all stops may just be wide.
"""

BOOKS = """### With ranges from the library, before any calibration
The library is [rpf3d's own](../howto/unknown-ground.md#take-ground-from-the-library) (`rpf3d materials` lists it). Its
entries were chosen by the description of the ground. At Authume they are `talus` and `bedrock`, for rocks with a shape
`ramms_medium` and `ramms_hard`. At Tschamut they are `soil`, for rocks with a shape `ramms_medium_soft`.

The entries have no friction angle, no rolling friction of spheres and no rolling resistance, so a scene
[assumes ranges](../howto/unknown-ground.md#take-ground-from-the-library). The assumed ranges are **not independent of
the two sites**: the ranges of the friction angle and the rolling resistance are close to the priors of the calibrations
on this page. Each model has two rows at each site. In the second row, one value replaces each assumed range: the
default angle of 30 degrees, or the middle of the range.
"""

TOO_SURE = """**With one assumed value, the intervals of points and spheres are far too narrow**, although restitution
is still a range. For points, the intervals contain a quarter of the stops at Authume and none at Tschamut. With
ranges, the intervals of every model contain at least five sixths of the stops along the slope; four of the six
intervals are open.

**Across the slope, intervals of points and spheres contain too few stops**: with ranges, 33 and 30 of 41 at Authume,
and 6 and 5 of 18 at Tschamut. At Authume many rocks go too far, and therefore spread more.
"""

ELSEWHERE = """### With a calibration on another slope
The parameter sets of a calibration at one site predict the stops at the other site, without the misfit of the model.
"""

TOO_SURE_ELSEWHERE = """**A calibration on another slope can give far too narrow intervals**, and you cannot
know beforehand whether it does. With the calibrations at Authume, the intervals contain at most a third of the stops
at Tschamut. With the calibrations at Tschamut, the intervals along the slope contain most stops at Authume, except for
`coulomb_limited`. The reason: Tschamut's stops leave most coefficients nearly as uncertain as before. On a
slope without observations, use ranges of the library.
"""

IMPACTS = """The next table has predictions with values from the eleven contacts of Chant Sura. Single impacts cannot
calibrate the friction on the ground, so the missing values are Hoek's values for the first zone of the simulated site.
At Tschamut, Hoek's values alone give nearly the same errors, so the table shows little about single impacts:
"""
