"""Find the key of a scene that a user meant by another word, such as `weight` for `mass`, for "did you mean"."""

from collections.abc import Sequence

SAME = (
    ("friction", "phi", "friction_angle", "angle_of_friction", "friction_deg", "mu", "friction_angle_deg", "friction"),
    ("rn", "r_n", "kn", "cor", "cor_n", "cor_normal", "en", "e_n", "restitution_normal", "normal", "bounce",
     "restitution", "coefficient_of_restitution", "elasticity", "normal_restitution", "restitution"),
    ("rt", "r_t", "kt", "cor_t", "cor_tangential", "et", "e_t", "restitution_tangential", "tangential",
     "tangential_restitution"),
    ("rolling", "mu_r", "rolling_resistance_angle", "rolling_friction", "rolling_resistance"),
    ("size", "width", "d", "dia", "diam", "block_size", "radius", "diameter"),
    ("weight", "kg", "block_mass", "mass"),
    ("unit_weight", "rho", "specific_weight", "density_kg_m3", "density"),
    ("m3", "block_volume", "volume"),
    ("mesh", "file", "path", "dem", "dtm", "surface", "stl", "topography", "topo", "files"),
    ("epsg", "srs", "projection", "coordinate_system", "reference_system", "crs"),
    ("units", "scale", "length_unit", "unit"),
    ("axis", "up_axis", "vertical", "up"),
    ("tolerance", "merge", "weld_tolerance", "weld"),
    ("layer", "material", "zone_name", "zone"),
    ("count", "n", "number", "number_of_rocks", "n_rocks", "blocks", "particles", "rocks"),
    ("height", "z_offset", "offset", "drop_height", "release_height", "above", "above_ground"),
    ("crest", "polyline", "edge", "path_line", "line"),
    ("area", "outline", "region", "seeder", "polygon", "polygons"),
    ("point", "position", "location", "xyz", "coordinates", "points"),
    ("csv", "xyz_file", "file", "points_file"),
    ("initial_velocity", "v0", "v", "velocity"),
    ("initial_speed", "speed_m_s", "speed"),
    ("direction", "bearing", "heading", "azimuth", "dip_direction", "azimuth_deg"),
    ("angle", "pitch", "elevation", "elevation_deg"),
    ("min_slope", "slope", "steeper_than", "least_slope", "steeper_than_deg"),
    ("grid", "resolution", "cell_size", "pixel", "raster", "cell"),
    ("restitution_model", "bounce_model", "impact", "model", "rebound"),
    ("sliding", "rolling_model", "ground_model", "ground"),
    ("g", "gravitation", "gravity"),
    ("random_seed", "rng", "seed"),
    ("receptors", "targets", "areas", "areas_of_interest"),
    ("benches", "domains", "zones"),
    ("angle", "slope_angle", "batter_angle", "face_angle", "bench_face_angle", "bench_angle", "face_angle_deg"),
    ("berms", "berm_width", "bench_width", "catch_bench", "berm"),
    ("bench_height", "face_height", "height"),
    ("surfaces", "soils", "ground_types", "materials"),
    ("seeders", "releases", "release", "source", "sources"),
    ("block", "boulder", "rock"),
    ("fences", "fence", "barrier", "nets", "barriers"),
    ("trees", "vegetation", "forest"),
    ("min_velocity", "stop_velocity", "cutoff", "stopping_speed", "stop_speed"),
    ("duration", "t_max", "time", "max_time"),
    ("paths", "tracks", "trajectories"),
    ("images", "plots", "maps", "pictures"),
    ("rerun", "rrd", "recording"),
    ("mass", "masses", "mass_col", "weight_column", "mass_column"),
    ("shape", "shapes", "shape_col", "shape_number", "shape_column"),
)  # fmt: skip
"""Groups of words with the same meaning; each group ends with keys of a scene, the most likely key first."""


def keys_meant(word: str, known: Sequence[str]) -> list[str]:
    """Return the known keys that a word may mean, the likeliest key first; the word itself is left out.

    word : a key as the user wrote it; known : the valid keys
    """
    spoken = word.lower().replace("-", "_").strip("_")
    groups = [dict.fromkeys(reversed(group)) for group in SAME if spoken in group]
    return list(dict.fromkeys(key for group in groups for key in reversed(group) if key in known and key != word))
