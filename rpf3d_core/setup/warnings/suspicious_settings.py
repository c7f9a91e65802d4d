"""Warn about settings of a scene that are valid but suspicious, such as a value in a wrong unit."""

from collections.abc import Iterator

from rpf3d_core.ensemble.outward import three_figures
from rpf3d_core.ensemble.sizes import UNIT_SPHERE_VOLUME, diameter_of, mass_range
from rpf3d_core.formats.units import LENGTHS, SI
from rpf3d_core.formats.words import either
from rpf3d_core.scene.draws import Draw, distribution_of
from rpf3d_core.scene.material import Material
from rpf3d_core.scene.measured import MeasuredList, sizes_from
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.models.sphere import SPHERE_GROUND
from rpf3d_core.scene.releases import SIZES, RockSpec, SourceSpec
from rpf3d_core.scene.zone_materials import used_coefficients
from rpf3d_core.setup.shapes import rock_of_scene
from rpf3d_core.setup.warnings.line_order import warnings_of_lines
from rpf3d_core.setup.warnings.scales import warnings_of_scales, words_on_low_density
from rpf3d_core.setup.warnings.source_lines import warnings_of_source_lines

LEAST_FRICTION = 1.0
"""Smallest plausible friction angle (degrees); a smaller value is probably in radians, or a tangent.

Ice on ice has 2 degrees.
"""
MOST_ROLLING = 2.0
"""Largest plausible rolling friction (-), the tangent of 63 degrees; a larger value is probably in degrees."""
LEAST_STEM = 2.0
"""Smallest plausible stem diameter (cm); a smaller value is probably in metres.

A thinner stem would stop no rock.
"""
LARGEST_ROCK, SMALLEST_ROCK = 25.0, 0.005
"""Largest and smallest plausible diameter (m) of a rock; a rockfall of 8,000 m^3 falls as many rocks, not as one."""
SMALL_ROCK = 0.15
"""Diameter (m), that of 4.8 kg of rock; if all rocks of a scene are smaller, a wrong unit is likely."""
SMALL_MEASURED = 0.05
"""Diameter (m); if all measured diameters of a column in cm or mm are smaller, its numbers are probably in m."""
LIGHT_ROCK = 50.0
"""Mass (kg), that of a block 0.33 m wide; masses in a column without a unit are probably in t if all are smaller."""
UNITS_OF_SIZES = ("cm", "mm")
"""Units in which the size of a rock may be given by mistake."""
MOST_SPEED = 150.0
"""Largest plausible speed (m/s) of a rock, that of a free fall of 1,150 m; no rockfall was measured faster."""
LEAST_DENSITY = 100.0
"""Smallest plausible rock density (kg/m^3); a smaller value is probably in t/m^3.

Pumice has 250 kg/m^3.
"""
MOST_POUNDS = 300.0
"""Largest density (kg/m^3) that is probably in lb/ft^3; magnetite has 325 lb/ft^3, most rock 150 to 190."""
POUND_PER_CUBIC_FOOT = 0.45359237 / 0.3048**3
"""Density of 1 lb/ft^3 (kg/m^3)."""
SWAPPED = 1.5
"""Ratio R_n / R_t (-) above which both are probably swapped; sheets of plywood have 1.2, rock less than 1."""
LEAST_RESTITUTION = {"normal_restitution": 0.06, "tangential_restitution": 0.2}
"""Smallest plausible coefficients of restitution (-), except 0; no range of the library is below these values."""
GRAVITY = (9.0, 10.5)
"""Smallest and largest plausible gravity (m/s^2); a lab may tilt its model, but not the gravity."""
LEAST_TERMINAL_SPEED = 1.0
"""Smallest plausible sink speed (m/s) of rocks in a drag layer.

A slower rock needs more than half a minute to sink through a layer 30 m high.
"""


def warnings_of(scene: Scene) -> Iterator[str]:
    """Yield a warning for each probable mistake in a scene: a wrong unit, a key without effect, a poor choice."""
    if scene.rock.density < LEAST_DENSITY:
        yield words_on_low_density(scene.rock.density)
    else:
        yield from _pounds(scene.rock.density)
        yield from _sizes(scene)
    yield from _doubtful_units(scene)
    yield from warnings_of_scales(scene)
    yield from warnings_of_lines(scene)
    yield from warnings_of_source_lines(scene)
    for name, material in scene.materials.items():
        if material.is_of_a_body:
            continue
        yield from _swapped(name, material)
        yield from _small_restitution(name, material)
        friction = distribution_of(material.friction_angle_deg).high
        if scene.ground_model.name != "none" and friction < LEAST_FRICTION:
            yield f"`materials.{name}.friction_angle_deg` is {friction:g} degrees; is it in radians, or a tangent?"
    forest = scene.effects.forest
    if forest is not None and forest.stems_per_ha and forest.dbh_mean_cm < LEAST_STEM:
        yield f"`effects.forest.dbh_mean_cm` is {forest.dbh_mean_cm:g} cm; is it in metres?"
    if scene.effects.fragmentation is not None:
        yield (
            "`effects.fragmentation` is unconfirmed: neither its least_ratio nor the sizes of its pieces were compared "
            "with measured fragments; compare them with those of your site"
        )
    yield from _rolling(scene)
    yield from _idle_rolling_friction(scene)
    if scene.impact_model.name == "coulomb_limited" and scene.ground_model.name == "none":
        yield (
            "`rebound: coulomb_limited` leaves a rock its speed along the ground when its bounces die out, and "
            "`ground: none` carries no rock on: it ends as unresolved_contact if it is faster than stop_speed; name "
            "`ground: sliding`"
        )
    yield from _floating(scene)
    if not GRAVITY[0] <= scene.gravity <= GRAVITY[1]:
        yield f"`gravity` is {scene.gravity:g} m/s2; on Earth it is 9.76 to 9.84 m/s2"
    if "target" in scene.model_fields_set and scene.rocks != "auto":
        yield "`target` has no effect, for `rocks` is not auto"


def _small_restitution(name: str, material: Material) -> Iterator[str]:
    """Yield a warning for each coefficient of restitution that is smaller than any published one, but not 0."""
    for key, least in LEAST_RESTITUTION.items():
        value = getattr(material, key)
        if value is not None and 0.0 < distribution_of(value).high < least:
            yield (f"`materials.{name}.{key}` is at most {distribution_of(value).high:g}, less than all published "
                   "values (`rpf3d materials`): is its decimal point right?")  # fmt: skip


def warnings_of_speed(fastest: float) -> Iterator[str]:
    """Yield a warning if the fastest rock of a run (m/s) is faster than any rockfall."""
    if fastest > MOST_SPEED:
        yield (
            f"a rock reaches {fastest:,.0f} m/s, faster than any rockfall: are terrain and sources in metres? Compare "
            "the extents that `rpf3d check` prints"
        )


def _sizes(scene: Scene) -> Iterator[str]:
    """Yield warnings on rocks larger or smaller than in any rockfall, and on rocks whose size is probably misread."""
    smallest, largest = (diameter_of(mass, scene.rock.density) for mass in mass_range(rock_of_scene(scene)))
    if largest > LARGEST_ROCK:
        yield (
            f"`rock` reaches {three_figures(largest)} m in diameter, more than any rock of a rockfall; is "
            f"{_units_in_words(largest)}its mass in g?"
        )
    if smallest < SMALLEST_ROCK:
        yield f"`rock` has {three_figures(smallest)} m in diameter, less than gravel; is its mass in t?"
    else:
        yield from _small_rocks(scene)


def _pounds(density: float) -> Iterator[str]:
    """Yield a warning if a density (kg/m^3) is too low for rock, but is plausible for rock in lb/ft^3."""
    if density <= MOST_POUNDS:
        yield (
            f"`rock.density` is {density:g} kg/m3, far less than rock; did you mean "
            f"{three_figures(density * POUND_PER_CUBIC_FOOT)} kg/m3 ({density:g} lb/ft3)?"
        )


def _small_rocks(scene: Scene) -> Iterator[str]:
    """Yield a warning for each size in the scene that makes all rocks so small that its unit is probably wrong."""
    for place, section in _sections_with_sizes(scene):
        for measure in SIZES:
            size = getattr(section, measure)
            if size is not None and (doubt := _small(size, measure, scene.rock.density)):
                yield f"`{place}.{measure}` {doubt}"


def _small(size: float | Draw | MeasuredList, measure: str, density: float) -> str:
    """Return the end of a warning on a size whose rocks are all very small; "" if its unit is plausible.

    Two mistakes are found: masses in t without a unit, and sizes that were converted although they were in m, kg or m3.

    measure : the key of the size, such as `mass`; density : kg/m^3
    """
    column = size.column_of(measure) if isinstance(size, MeasuredList) else None
    name, unit = (None, None) if column is None else (column.name, column.unit)
    if (measure != "mass" or unit is not None) and (unit is None or unit.factor >= 1.0):
        return ""
    if isinstance(size, MeasuredList) and size.doubt(measure):
        return ""  # `_doubtful_units` asks for the unit
    largest = size if isinstance(size, float) else sizes_from(size, measure).high
    volume = {"diameter": UNIT_SPHERE_VOLUME * (0.5 * largest) ** 3, "mass": largest / density}.get(measure, largest)
    mass, diameter = density * volume, float(diameter_of(density * volume, density))
    is_light = name is not None and unit is None and mass < LIGHT_ROCK
    if diameter >= (SMALL_MEASURED if measure == "diameter" else SMALL_ROCK) and not is_light:
        return ""
    found = f"has no rock above {three_figures(mass)} kg, {three_figures(diameter)} m in diameter"
    if unit is not None:
        return f"{found}: are the numbers of the column {name!r} in {SI[unit.quantity]}, not in {unit.name}?"
    if name is None:
        return f"{found}; is its mass in t?"
    return f"{found}; are its masses in t? Write their unit in brackets: '{name} (t)' or '{name} (kg)'"


def _sections_with_sizes(scene: Scene) -> list[tuple[str, RockSpec | SourceSpec]]:
    """Return the key path and the content of each section of the scene that may state a size of rocks."""
    return [("rock", scene.rock), *((f"sources[{number}]", source) for number, source in enumerate(scene.sources))]


def _units_in_words(diameter: float) -> str:
    """Return the first part of a question: the units in which a number would be a plausible diameter of a rock.

    The result is "" if no unit fits.

    diameter : the number, which the scene reads in m
    """
    sizes = {unit: diameter * LENGTHS[unit][1] for unit in UNITS_OF_SIZES}
    fitting = [f"in {unit} ({three_figures(size)} m)" for unit, size in sizes.items()
               if SMALLEST_ROCK <= size <= LARGEST_ROCK]  # fmt: skip
    return f"its size {either(fitting)}, or " if fitting else ""


def _doubtful_units(scene: Scene) -> Iterator[str]:
    """Yield a warning for each file of sizes whose column name leaves the unit or the kind of length in doubt."""
    for place, section in _sections_with_sizes(scene):
        for measure in SIZES:
            size = getattr(section, measure)
            if isinstance(size, MeasuredList) and (doubt := size.doubt(measure)):
                yield f"`{place}.{measure}`: {doubt}"


def _swapped(name: str, material: Material) -> Iterator[str]:
    """Yield a warning if R_n of a material is far above its R_t, as if the two were swapped.

    A material from the library gets no warning. name : key of the material in the scene
    """
    if material.library is not None:
        return
    normal = distribution_of(material.normal_restitution).low
    tangential = distribution_of(material.tangential_restitution).high
    if normal > SWAPPED * tangential > 0.0:
        yield (
            f"`materials.{name}`: R_n ({normal:g}) is far above R_t ({tangential:g}); most ground has a larger R_t: "
            "are R_n and R_t swapped?"
        )


def _rolling(scene: Scene) -> Iterator[str]:
    """Yield a warning for each material without rolling friction, if the scene lets spheres roll."""
    if not scene.rock.is_sphere or scene.ground.name != SPHERE_GROUND:
        return
    for name, material in scene.materials.items():
        given = material.rolling_friction
        if given is None or distribution_of(given).high <= 0.0:
            yield (
                f"`materials.{name}.rolling_friction` is {'not given and taken as 0' if given is None else 0}: a "
                "sphere loses no spin at impacts there and does not stop on level ground, so it may roll across "
                "the whole pit; give a rolling friction (-), the tangent of the slope that just keeps a rock rolling"
            )


def _idle_rolling_friction(scene: Scene) -> Iterator[str]:
    """Yield a warning for each material with a rolling friction that the ground model of the scene does not use.

    There is no warning with `ground: none`, and none for materials of rocks with a shape.
    """
    if scene.ground_model.name == "none":
        return
    for name, material in scene.materials.items():
        given = material.rolling_friction
        if given is None or material.is_of_a_body or "rolling_friction" in used_coefficients(scene, material):
            continue
        high = distribution_of(given).high
        doubt = f"; {high:g} is the tangent of a slope, not an angle in degrees" if high > MOST_ROLLING else ""
        yield (
            f"`materials.{name}.rolling_friction` has no effect with `ground: {scene.ground.name}`: only ground models "
            f"that roll, and spheres, use it{doubt}"
        )


def _floating(scene: Scene) -> Iterator[str]:
    """Yield a warning if the lightest rock or fragment would nearly float in the effect `drag_layer`.

    Its terminal speed of fall in the layer is then below LEAST_TERMINAL_SPEED (m/s).
    """
    layer, breaking = scene.effects.drag_layer, scene.effects.fragmentation
    if layer is None or layer.coefficient == 0.0:
        return
    from rpf3d_core.effects.drag_layer import terminal_speed

    rock, mass = "rock", mass_range(rock_of_scene(scene))[0]
    if breaking is not None and (fragment := breaking.least_volume * scene.rock.density) < mass:
        rock, mass = "fragment", fragment
    speed = terminal_speed(layer.coefficient, mass, scene.gravity)
    if speed < LEAST_TERMINAL_SPEED:
        yield (
            f"`effects.drag_layer` lets the lightest {rock} ({three_figures(mass)} kg) sink at no more than "
            f"{speed:.2g} m/s, below {LEAST_TERMINAL_SPEED:g} m/s: it floats and may end as max_impacts; lower "
            f"`coefficient` ({layer.coefficient:g} kg/s is that of heavier rocks) or leave light rocks out"
        )
