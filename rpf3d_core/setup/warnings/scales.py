"""Warn about energies, densities, speeds and spreads of a scene that are far out of scale: wrong units are likely."""

from collections.abc import Iterator

from rpf3d_core.ensemble.outward import three_figures
from rpf3d_core.formats.words import either
from rpf3d_core.scene.draws import Lognormal, LognormalSpec, Normal
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.values import StrictModel

MOST_CAPACITY = 50_000.0
"""Largest plausible capacity (kJ) of a barrier; the strongest nets are tested with 10,000 kJ, and dams hold more."""
MOST_DENSITY = 8_000.0
"""Largest plausible rock density (kg/m^3); lead ore (galena) has 7,500 kg/m^3."""
WEIGHTS = (10.0, 100.0)
"""Range of numbers that are too small for a density in kg/m^3, but plausible for a weight of rock in kN/m^3."""
STANDARD_GRAVITY = 9.80665
"""Gravity (m/s^2) that converts a weight of rock into its density."""
ROCK = (1_000.0, MOST_DENSITY)
"""Range of densities (kg/m^3) of rock and ore."""
MOST_RELEASE_SPEED = 30.0
"""Largest plausible speed (m/s) of a release, that of a free fall of 46 m; blasts throw some rocks faster."""
MOST_STOP_SPEED, STOPS_ALL = 3.0, 100.0
"""Largest plausible stop speed (m/s), that of r.stone; and the stop speed from which a material stops every rock.

Materials that stop every rock on contact, such as water, have a stop speed above the second limit.
"""
KMH = 3.6
"""1 m/s in km/h."""
WIDE = 2.0
"""Ratio (-) of a draw's standard deviation to the range between its bounds; above it, the range alone decides."""


def warnings_of_scales(scene: Scene) -> Iterator[str]:
    """Yield a warning for each number of a scene that is far too large for its unit; most warnings suggest a unit."""
    yield from _heavy(scene.rock.density)
    yield from _strong_barriers(scene)
    yield from _speeds(scene)
    yield from _spreads(scene)


def words_on_low_density(density: float) -> str:
    """Return a warning on a density (kg/m^3) below that of any rock, with the units that may be meant."""
    low, high = WEIGHTS
    weight = f", or in kN/m3 ({_as_density(1000.0 * density)} kg/m3)" if low <= density < high else ""
    return f"`rock.density` is {density:g} kg/m3; is it in t/m3{weight}?"


def _as_density(weight: float) -> str:
    """Return the density (kg/m^3) of a weight (N/m^3) as text."""
    return three_figures(weight / STANDARD_GRAVITY)


def _heavy(density: float) -> Iterator[str]:
    """Yield a warning if a density (kg/m^3) is above that of any ore."""
    if density <= MOST_DENSITY:
        return
    units = {"N/m3": density / STANDARD_GRAVITY, "g/m3": density / 1000.0}
    fitting = [f"in {unit} ({three_figures(size)} kg/m3)" for unit, size in units.items() if ROCK[0] <= size <= ROCK[1]]
    question = f"is it {either(fitting)}?" if fitting else "is it in another unit?"
    yield f"`rock.density` is {density:,.10g} kg/m3, more than any ore; {question}"


def _strong_barriers(scene: Scene) -> Iterator[str]:
    """Yield a warning for each barrier whose capacity is above that of any net."""
    barriers = scene.effects.barriers
    for number, panel in enumerate(() if barriers is None else barriers.panels):
        if panel.capacity_kj > MOST_CAPACITY:
            yield (
                f"`effects.barriers.panels[{number}].capacity_kj` of {panel.name!r} is {panel.capacity_kj:,.10g} kJ; "
                "the strongest nets are tested with 10,000 kJ: is it in J "
                f"({three_figures(panel.capacity_kj / 1000.0)} kJ)?"
            )


def _speeds(scene: Scene) -> Iterator[str]:
    """Yield a warning for each release speed too high for a loose rock, and each stop speed that is too high.

    A stop speed is too high if it stops rocks that still move fast. A stop speed of STOPS_ALL (m/s) or more stops every
    rock, which is intended, and gives no warning.
    """
    for number, source in enumerate(scene.sources):
        if source.fastest > MOST_RELEASE_SPEED:
            key = "velocity" if source.speed is None else "speed"
            yield (
                f"`sources[{number}].{key}` of {source.name!r} reaches {three_figures(source.fastest)} m/s, more than "
                f"a rock has when it comes loose; is it in km/h ({three_figures(source.fastest / KMH)} m/s)?"
            )
    stops = {"stop_speed": scene.stop_speed}
    stops |= {f"materials.{name}.stop_speed": its.stop_speed or 0.0 for name, its in scene.materials.items()}
    for place, speed in stops.items():
        if MOST_STOP_SPEED < speed < STOPS_ALL:
            yield (
                f"`{place}` is {speed:g} m/s: a rock counts as stopped as soon as it is slower, and its runout becomes "
                "too short; the default is 0.5 m/s"
            )


def _spreads(scene: Scene) -> Iterator[str]:
    """Yield a warning for each normal or lognormal draw whose sd is far above the range between its bounds."""
    sections: dict[str, StrictModel] = {"rock": scene.rock}
    sections |= {f"sources[{number}]": source for number, source in enumerate(scene.sources)}
    sections |= {f"materials.{name}": material for name, material in scene.materials.items()}
    for place, section in sections.items():
        for key, value in section:
            draw = value.lognormal if isinstance(value, Lognormal) else value
            if isinstance(draw, Normal) and draw.sd > WIDE * (draw.max - draw.min):
                name = f"{key}.lognormal" if isinstance(draw, LognormalSpec) else key
                yield (
                    f"`{place}.{name}.sd` is {draw.sd:g}, far more than the range from min {draw.min:g} to max "
                    f"{draw.max:g}, so that mean {draw.mean:g} hardly matters; is it in percent of the mean "
                    f"({three_figures(0.01 * draw.sd * abs(draw.mean))})?"
                )
