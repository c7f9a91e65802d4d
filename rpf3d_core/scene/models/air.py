"""The scene's effects of the air: `drag` and `drag_layer`."""

from typing import ClassVar

from rpf3d_core.scene.models.spec import Confirmed, ModelSpec, parameter
from rpf3d_core.scene.values import InputFile, Number

ACCURACY = (
    "a number of at least 1e-5 (m), the largest position error after a flight of 5 s; in longer flights, the limit "
    "grows with the square of the duration"
)


class DragSpec(ModelSpec):
    """Quadratic air drag on a sphere of the rock's volume: the force F = 1/2 rho C_d pi R^2 v^2 against the motion.

    rho is the `density` of the air, C_d the `coefficient`, R the radius of the sphere and v the speed of the rock.
    """

    PHYSICS: ClassVar[str] = "rpf3d_core.effects.drag:Drag"
    BUILDER: ClassVar[str | None] = "rpf3d_core.setup.builders.drag:drag"
    SOURCE: ClassVar[str] = "quadratic drag; density as in stnParabel's guide"
    CONFIRMED: ClassVar[Confirmed] = "C"

    coefficient: Number = parameter(
        0.5, "a number from 0 to 10, the drag coefficient C_d; the default is that of a smooth sphere and unconfirmed "
        "for rocks", "-", "general knowledge; r.stone declares 0.5", "UNCONFIRMED", ge=0, le=10,
    )  # fmt: skip
    density: Number = parameter(
        1.2, "a number from 0 to 10 (kg/m3), the density of the air", "kg/m3", "stnParabel's guide", "C", ge=0, le=10
    )
    accuracy: Number = parameter(0.01, ACCURACY, "m", "derived in effects/air_step.py", "D", ge=1e-5, le=10)


class DragLayerSpec(ModelSpec):
    """Forest as a layer above the ground: below its top, the force F = -c v slows flying rocks.

    c is the `coefficient`, and v the velocity of the rock.
    """

    PHYSICS: ClassVar[str] = "rpf3d_core.effects.drag_layer:DragLayer"
    BUILDER: ClassVar[str | None] = "rpf3d_core.setup.builders.drag_layer:drag_layer"
    SOURCE: ClassVar[str] = "Leine et al. 2014, equations 10 and 11"
    CONFIRMED: ClassVar[Confirmed] = "C"

    coefficient: Number = parameter(
        ..., "a number from 0 to 1e5 (kg/s); 250, 500 and 750 are quoted as RAMMS' open, medium and dense forest: "
        "unconfirmed", "kg/s", "classes of RAMMS", "UNCONFIRMED", ge=0, le=1e5,
    )  # fmt: skip
    height: Number = parameter(
        30.0, "a number >= 0 (m), the height of the layer's top above the ground; the default is unconfirmed", "m",
        "RAMMS", "UNCONFIRMED", ge=0,
    )  # fmt: skip
    accuracy: Number = parameter(0.05, ACCURACY, "m", "derived in effects/air_step.py", "D", ge=1e-5, le=10)
    polygons: InputFile | None = parameter(
        None, "the path of a file with polygons that contain the forest; left out: the forest is everywhere",
        "-", "", "D",
    )  # fmt: skip
