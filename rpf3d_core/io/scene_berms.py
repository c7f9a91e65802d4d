"""The scene's key `terrain.berms`: ridges that are raised on the ground before anything flies over it."""

from typing import Self

from pydantic import Field, model_validator

from rpf3d_core.io.scene_values import Along, Name, Number, Part, refuse

HIGHEST, WIDEST = 50.0, 200.0
"""m; berms along haul roads stand 2 m, waste dumps above pits some tens."""


class BermSpec(Part):
    """One berm along lines; its facets are the zone `berm_<name>`, so materials and tables know it."""

    name: Name = Field(description="a name that no other berm has")
    along: Along = Field(description="two or more points [x, y] (m) in plan, or the path of a GeoJSON file with lines")
    height: Number = Field(
        gt=0, le=HIGHEST, description=f"a number above 0 up to {HIGHEST:g} (m), of its crest over the ground below it"
    )
    width: Number = Field(gt=0, le=WIDEST, description=f"a number above 0 up to {WIDEST:g} (m), at its foot")
    crest: Number = Field(0.0, ge=0, description="a number from 0 to below width (m), its width at the top")

    @model_validator(mode="after")
    def _narrower_at_the_top(self) -> Self:
        if self.crest >= self.width:
            raise refuse(f"is {self.crest:g}, but must be below the width at the foot, {self.width:g}", "crest")
        return self
