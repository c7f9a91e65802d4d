"""Check the guards of the hard cases: without the guard in the code, the test of the case must fail.

    python test/hard/guards.py            apply each change to a copy of the package; its test must fail there
    python test/hard/guards.py --list     print the list of README.md, which a test compares

A change replaces a text that occurs exactly once in a file. All named tests first run without a change. Tests of
the reference engine are preferred, because each change of a kernel compiles the other engine again.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import textwrap
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
COPIED = ("rpf3d_core", "test", "config", "pyproject.toml")
FAILED = 1
"""Exit code of pytest if tests ran and some failed; larger codes mean that the tests could not run."""
LONGEST = 240.0
"""Time (s) after which a running test counts as failed: without some guards a rock bounces until max_impacts."""
ARC = "rpf3d_core/arc.py"
SPHERES, SEGMENTS = "rpf3d_core/detection/sphere_contact.py", "rpf3d_core/simulation/sphere_segments.py"
ROLLING, SPHERE_IMPACTS = "rpf3d_core/simulation/sphere.py", "rpf3d_core/simulation/sphere_impacts.py"
NARROW, SEARCH = "rpf3d_core/detection/narrow_phase.py", "rpf3d_core/detection/search.py"
GEOMETRY = "rpf3d_core/terrain/facet_geometry.py"
TIES = "rpf3d_core/detection/ties.py"
MARCH, SUSTAINED = "rpf3d_core/simulation/march.py", "rpf3d_core/simulation/sustained.py"
LANDING, HOLDING = "rpf3d_core/simulation/landing.py", "rpf3d_core/simulation/carrying.py"
SETTLING = "rpf3d_core/simulation/settling.py"
SLIDING, REBOUND = "rpf3d_core/kinetics/sliding.py", "rpf3d_core/kinetics/rebound.py"


class Guard(NamedTuple):
    """A test and the guard in the code without which the test fails.

    test : file and id of the test, below test/hard
    file, text, becomes : the change that removes the guard: in the file, `text` becomes `becomes`
    guard : what the guard does, with its function; without : what happens without it
    """

    test: str
    file: str
    text: str
    becomes: str
    guard: str
    without: str


GUARDS = (
    Guard(
        "test_grazing.py::test_a_rock_that_falls_along_a_wall_touches_it_at_the_angle_it_has[1e-09-reference]",
        ARC,
        "    t = 2.0 * c / denominator\n",
        "    t = (-b - math.sqrt(discriminant)) / (2.0 * a)\n",
        "`falling_time`: the root without a cancellation and without a division by `a`, which is 0 for a wall",
        "the rock fails: a division by zero",
    ),
    Guard(
        "test_grazing.py::test_a_rock_that_leaves_the_ground_at_a_grazing_angle_comes_back_to_it[0.0-1e-06-reference]",
        NARROW,
        "    if b * b <= GRAZING * GRAZING * dot(arc.v, arc.v):\n",
        "    if b * b <= 1e-6 * dot(arc.v, arc.v):\n",
        "`_time_from_near`, GRAZING: only a sine of 1e-9 counts as along the ground",
        "a bounce of 1e-6 rad is swallowed, with the time and the way that it takes",
    ),
    Guard(
        "test_grazing.py::test_a_flight_a_nanometre_above_a_crest_passes_it_and_one_below_does_not[reference]",
        "rpf3d_core/terrain/facets.py",
        "    return facets_from(geometry, zone, low, high, contact_tolerance(low, high, terrain.frame.origin))\n",
        "    return facets_from(geometry, zone, low, high, 1e-6)\n",
        "`facets_of`: a tolerance of 2^-40 of the diagonal",
        "a rock a nanometre above the crest hits it",
    ),
    Guard(
        "test_grazing.py::test_a_parabola_that_touches_a_roof_just_at_its_apex_flies_on_as_if_it_had_not[0.0-reference]",
        NARROW,
        "    return -rising / bending if rising > 0.0 and bending < 0.0 else math.inf\n",
        "    return abs(rising / bending)\n",
        "`_return_time`: a rock comes back only to a facet that gravity brings it back to",
        "having touched the roof, it is caught by it again at once",
    ),
    Guard(
        "test_edges_and_vertices.py::test_no_rock_falls_between_two_facets[reference]",
        GEOMETRY,
        "not (distance >= 0.0 or near)",
        "not distance > 0.0",
        "`contains`: facets include their rim, and a tolerance more",
        "rocks dropped on edges and diagonals fall between two facets",
    ),
    Guard(
        "test_bad_meshes.py::test_a_rock_that_falls_past_the_tip_of_a_needle_falls_to_the_ground[1e-05-reference]",
        GEOMETRY,
        "    return deep or is_at_box(facets, f, on_plane(facets, f, p), TIP * slack)\n",
        "    return True\n",
        "`contains`: beyond the corners of a facet there is none, however near to its edges a place is",
        "a rock hits the air past a needle, on the engine whose locator offered it there",
    ),
    Guard(
        "test_edges_and_vertices.py::"
        "test_a_rock_released_at_rest_on_level_ground_stays_there[on a vertex-1e-12 m below-sliding-reference]",
        NARROW,
        "    if -NEAR * facets.crack <= s * c <= NEAR * facets.tolerance:\n",
        "    if c == 0.0:\n",
        "`earlier_contact`: within NEAR tolerances of a plane a rock is on it",
        "a rock 1e-12 m under a floor falls through it",
    ),
    Guard(
        "test_edges_and_vertices.py::"
        "test_a_rock_released_at_rest_on_a_steep_slope_slides_off_it_wherever_it_lies[on a vertex-on it-reference]",
        LANDING,
        "    if state.left.resting or released_on_ground:\n",
        "    if state.left.resting:\n",
        "`land_point`: a release on the ground is no impact",
        "the rock is given an impact of no speed before it slides",
    ),
    Guard(
        "test_edges_and_vertices.py::"
        "test_a_rock_at_rest_on_a_vertex_of_a_slope_that_nothing_holds_leaves_it[0.5-reference]",
        NARROW,
        "(_passes_over(facets, f, arc, left) or _goes_elsewhere(facets, f, arc, left))",
        "_passes_over(facets, f, arc, left)",
        "`_goes_elsewhere`: a sliding rock is held only by facets that it moves onto, in plan",
        "facets around a vertex catch a rock in turn until it is called stopped",
    ),
    Guard(
        "test_gullies.py::test_a_rock_that_slides_along_the_line_of_a_meshed_gully_passes_its_vertices[40-compiled]",
        HOLDING,
        "    return ZERO if not slight and _is_thrown_out(physics, state, contact, n, m, rock) else line\n",
        "    return ZERO\n",
        "`_held_line`: two facets that both push hold a rock on their line",
        "the rock goes from side to side and is braked by the wrong friction",
    ),
    Guard(
        "test_gullies.py::test_a_rock_that_slides_into_a_sharp_gully_bounces_out_of_it_again[35.0-0.7-reference]",
        HOLDING,
        "    return ZERO if not slight and _is_thrown_out(physics, state, contact, n, m, rock) else line\n",
        "    return line\n",
        "`_is_thrown_out`: a gully holds no rock that several bounces lead out of it",
        "below 45 degrees the first bounce leads deeper into a gully: the rock loses all its speed across it",
    ),
    Guard(
        "test_edges_and_vertices.py::"
        "test_a_rock_in_the_ground_straight_above_an_edge_of_an_overhang_is_refused[on a diagonal-reference]",
        "rpf3d_core/ensemble/release_heights.py",
        "    some = _to_look_around(engine, found)\n",
        "    some = np.empty(0, dtype=np.int64)\n",
        "`ground_below_releases`: lines around a release meet the backs that the line straight down passes between",
        "a rock is released in the ground, without a word",
    ),
    Guard(
        "test_edges_and_vertices.py::"
        "test_a_rock_in_the_ground_straight_above_the_foot_of_an_overhang_is_refused[0.001-reference]",
        "rpf3d_core/ensemble/release_heights.py",
        " or _closest_shows_its_back(engine, x[some[i]], height[i]):",
        ":",
        "`_closest_shows_its_back`: above the foot of an overhang, the closest facet says where the ground is",
        "a line next to the release runs along the foot and meets the floor: the rock is released in the ground",
    ),
    Guard(
        "test_edges_and_vertices.py::"
        "test_a_rock_that_flies_into_a_crack_at_a_crest_is_not_sent_into_the_ground[released-5e-10-reference]",
        SEARCH,
        "    return left.facet != NO_ROCK and contact.side",
        "    return left.facet >= 0 and contact.side",
        "`meets_the_other_side`: a rock without a last facet may also have passed through a crack",
        "the rock hits the back of the next facet, and is sent into the ground",
    ),
    Guard(
        "test_edges_and_vertices.py::"
        "test_a_rock_that_meets_a_crack_at_a_small_angle_does_not_pass_below_the_next_facet[0.03-reference]",
        NARROW,
        "    if facets.tolerance >= facets.crack:\n        return True\n    return approach",
        "    return approach",
        "`_glances`: in a second search a rock at any angle meets a facet at its edge",
        "the rock passes below the edge of the next facet and falls",
    ),
    Guard(
        "test_gullies.py::test_a_slight_ridge_takes_no_speed_from_a_rock_that_slides_over_it[1e-05-9.0-reference]",
        HOLDING,
        "    if lies_below(facets, contact.facet, last, contact.side, NEAR * facets.tolerance):\n",
        "    if False:\n",
        "`_held_line`: facets that meet at a ridge hold nothing",
        "a rock that slides over a slight ridge loses its speed across it",
    ),
    Guard(
        "test_walls_and_overhangs.py::"
        "test_a_rock_that_flies_along_a_wall_meets_the_next_one_however_slightly_it_turns_into_the_first[3e-09-reference]",
        NARROW,
        "        return falling_time(max(c + NEAR * facets.tolerance, 0.0), b, a)\n",
        "        return math.inf\n",
        "`_time_from_near`: a path into a wall by less than GRAZING meets the wall once it is no longer near",
        "the rock drifts behind the wall, misses the next one, and flies on inside the ground",
    ),
    Guard(
        "test_gullies.py::test_a_rock_dropped_into_a_corner_of_three_facets_stops_in_it[sliding-reference]",
        NARROW,
        "    if -NEAR * facets.crack <= s * c <= NEAR * facets.tolerance:\n",
        "    if False:\n",
        "`earlier_contact`: within NEAR tolerances of a plane a rock that moves into it hits it now",
        "a rock in the corner falls between the three facets",
    ),
    Guard(
        "test_gullies.py::test_a_rock_dropped_into_a_needle_pit_stays_in_it[3-sliding-reference]",
        NARROW,
        "    if -NEAR * facets.crack <= s * c <= NEAR * facets.tolerance:\n",
        "    if False:\n",
        "`earlier_contact`: within NEAR tolerances of a plane a rock that moves into it hits it now",
        "a rock in the tip of the pit falls through it",
    ),
    Guard(
        "test_walls_and_overhangs.py::test_a_rock_that_flies_up_into_the_back_of_a_sheet_rebounds_from_it[reference]",
        NARROW,
        "    return _prefer(facets, f, arc, n, falling_time(-c, -b, -a), -1.0, best)\n",
        "    return best\n",
        "`earlier_contact`: contact is two-sided",
        "a bench without thickness is a trapdoor from below",
    ),
    Guard(
        "test_walls_and_overhangs.py::"
        "test_a_rock_that_rises_in_a_sharp_corner_of_upright_walls_does_not_pass_between_them[v0-60.0-reference]",
        NARROW,
        "    if near and abs(n[2]) <= UPRIGHT:\n",
        "    if False and n[2] == 0.0:\n",
        "`_edge_band`: a rock that rounding takes behind two walls in their sharp corner still meets them",
        "the rock passes both walls and rises inside the ground",
    ),
    Guard(
        "test_walls_and_overhangs.py::"
        "test_a_rock_that_falls_down_a_vertical_face_without_a_speed_towards_it_reaches_the_foot_freely[0.0-reference]",
        NARROW,
        "        if a < 0.0:\n            return 0.0 if _carries(",
        "        if a <= 0.0:\n            return 0.0 if _carries(",
        "`_time_from_near`: moving along a plane is contact only where gravity presses the rock on it",
        "the wall holds a rock that falls along it",
    ),
    Guard(
        "test_zeno.py::test_infinitely_many_bounces_end_when_and_where_their_series_does[0.5-6-none-reference]",
        SETTLING,
        "    in_time = rest.ends and ",
        "    in_time = False and ",
        "`settle`: the rest of the bouncing is summed in closed form",
        "bouncing is cut off where it is, short of its end",
    ),
    Guard(
        "test_zeno.py::test_without_losses_ten_thousand_bounces_keep_the_energy[level-reference]",
        REBOUND,
        "scale(-R_n * v_n, n)",
        "scale(-R_n * (1.0 - 1e-12) * v_n, n)",
        "by construction: the rebound as a vector, and heights that are put back on their facet, round without a drift",
        "a loss of 1e-12 at each impact adds up to more than 1e-9",
    ),
    Guard(
        "test_zeno.py::test_a_scene_without_gravity_is_refused_by_name",
        "rpf3d_core/scene/model.py",
        'gt=0, description="a number above 0 (m/s2)"',
        'ge=0, description="a number above 0 (m/s2)"',
        "`Scene.gravity`: refused at the door, since every formula divides by it",
        "a weightless scene is accepted",
    ),
    Guard(
        "test_zeno.py::test_a_slide_of_10_km_down_a_slope_reaches_the_speed_of_its_fall[500-reference]",
        NARROW,
        "    return _comes_over(facets, f, arc, left.side)\n",
        "    return False\n",
        "`_carries`: the next facet carries a rock that slides onto it",
        "the rock falls through the slope at the first edge",
    ),
    Guard(
        "test_zeno.py::test_friction_exactly_at_the_angle_of_the_slope_holds_a_rock_at_rest_and_keeps_the_speed_of_one_"
        "that_moves[0.0-33.7-reference]",
        SLIDING,
        "HOLDS = 1.0 - 1e-9\n",
        "HOLDS = 1.0 + 1e-9\n",
        "`slide_on_facet`, HOLDS: friction holds a rock if it reaches the pull but for rounding",
        "a rock at rest on a slope at the friction angle creeps off it",
    ),
    Guard(
        "test_bad_meshes.py::test_a_faulty_facet_changes_nothing[zero length-none-reference]",
        "rpf3d_core/terrain/facets.py",
        "    return 0.0, 0.0, 0.0\n",
        "    return 1.0, 1.0, 1.0\n",
        "`_unit_normal`: a facet without area has no normal, so `earlier_contact` passes it over",
        "a facet that is a point stops rocks in the air",
    ),
    Guard(
        "test_bad_meshes.py::test_no_rock_falls_through_a_crack_of_a_nanometre[t_junction-0.5-sliding-reference]",
        "rpf3d_core/terrain/facets.py",
        "CRACK = 64.0\n",
        "CRACK = 1.0\n",
        "`contact_or_crack`: a rock that would leave looks again for facets a little wider",
        "rocks fall through the T-junction",
    ),
    Guard(
        "test_never_below.py::"
        "test_rocks_that_a_campaign_saw_fall_stay_above_the_ground[scattered-35-coulomb_limited-206]",
        NARROW,
        "if side * n[2] > UPRIGHT else without(v, n)",
        "if False else without(v, n)",
        "`_comes_over`: which of the facets that meet at a vertex a rock goes over is decided in plan",
        "the rock falls through the vertex",
    ),
    Guard(
        "test_never_below.py::test_rocks_that_a_campaign_saw_fall_stay_above_the_ground[junctions-35-coulomb_limited-17]",
        NARROW,
        "    if -NEAR * facets.crack <= s * c",
        "    if -NEAR * facets.tolerance <= s * c",
        "`earlier_contact`: down to NEAR cracks below a facet a rock is on its free side",
        "the rock meets the next facet from behind, and is sent into the ground",
    ),
    Guard(
        "test_bad_meshes.py::test_no_rock_slips_between_facets_that_are_rough_by_nanometres[1e-08-reference]",
        NARROW,
        "    if side < 0.0 or not _glances(",
        "    if True or not _glances(",
        "`_entry_time`: a glancing arc meets a facet where it comes over it",
        "sliding rocks slip between two facets at a seam",
    ),
    Guard(
        "test_nearly_one_plane.py::test_no_sphere_sinks_into_the_plane[1e-09]",
        SPHERES,
        "            t = _entry_time(facets, f, course, n, t)\n",
        "            pass\n",
        "`_entry_time` (spheres): a sphere that reaches a plane outside the facet meets the facet at its edge",
        "spheres sink into the ground at a seam",
    ),
    Guard(
        "test_nearly_one_plane.py::test_no_sphere_sinks_into_a_wall[0.0001]",
        SPHERES,
        "course.a[2] == -course.gravity and",
        "dot(n, course.a) < -0.01 * course.gravity and",
        "`_earlier_on_face`: this holds for every flying sphere, also where gravity hardly presses it onto the facet",
        "spheres sink into a steep wall at a seam",
    ),
    Guard(
        "test_nearly_one_plane.py::test_no_sphere_sinks_into_the_plane[1e-08]",
        SEGMENTS,
        "(1.5 if turns else 0.5) * RIM",
        "1.5 * RIM",
        "`put_back`: on a facet a sphere must not sink as deep as edges are lowered",
        "the edges of its own facet stop the sphere",
    ),
    Guard(
        "test_nearly_one_plane.py::test_spheres_released_in_motion_on_a_seam_leave_it[0.0-1e-09-5.0]",
        ROLLING,
        "        if tries == TRIES or not pulled:\n",
        "        if tries >= 0:\n",
        "`_ahead`: friction or gravity that pulls a sphere into a facet of the same plane does not stop the sphere",
        "spheres in motion stop, or end as `unresolved_contact`, on a seam where nothing holds them",
    ),
    Guard(
        "test_nearly_one_plane.py::test_spheres_released_in_motion_in_a_groove_move_on[0.05-1e-09]",
        ROLLING,
        " or (held.contacts == 2 and dot(held.second.n, n) >= ALIKE)\n",
        "\n",
        "`_continues`: in a groove, a facet may continue either flank",
        "spheres in a groove stop, or end as `unresolved_contact`, on a seam of the second flank",
    ),
    Guard(
        "test_nearly_one_plane.py::test_spheres_released_in_motion_on_a_seam_leave_it[1.0-1e-08-5.0]",
        SPHERE_IMPACTS,
        "    height = NEAR * physics.facets.tolerance\n",
        "    height = 0.0\n",
        "`strike`: a bounce that would rise by less than NEAR contact tolerances ends, also with R_n 1",
        "spheres bounce on a seam without progress, and end as `unresolved_contact` or `max_impacts`",
    ),
    Guard(
        "test_bad_meshes.py::test_a_rock_that_comes_down_on_the_lowest_facet_of_a_level_terrain_is_followed_to_it"
        "[reference]",
        SEARCH,
        "facets.low[2] + NEAR * CRACK * slack",
        "facets.low[2] + slack",
        "`flight_end`: a flight is followed for NEAR CRACK tolerances below the terrain",
        "a rock is reported to have left just before it lands",
    ),
    Guard(
        "test_bad_meshes.py::test_flipped_facets_are_turned_back_at_load_and_change_nothing[0.5-sliding-reference]",
        "test/support/flights/on_both_engines.py",
        "    return replace(terrain, triangles=winding.triangles)\n",
        "    return terrain\n",
        "`repair_winding`, called when a terrain is read",
        "rocks that roll from a facet onto a turned one are on its wrong side",
    ),
    Guard(
        "test_scales.py::test_a_rough_slope_of_any_size_gives_the_same_answer_to_the_last_bit[6 cm-none-reference]",
        "rpf3d_core/terrain/facets.py",
        "    return facets_from(geometry, zone, low, high, contact_tolerance(low, high, terrain.frame.origin))\n",
        "    return facets_from(geometry, zone, low, high, 1e-4)\n",
        "`facets_of`: the tolerance is a share of the terrain's diagonal",
        "0.1 mm, which no pit would notice, is felt by a model of 6 cm",
    ),
    Guard(
        "test_speeds_and_rest.py::test_a_rock_that_creeps_over_level_ground_without_friction_is_still_moving_when_time_"
        "is_up[reference]",
        SLIDING,
        "CREEP = 1e-9\n",
        "CREEP = 1e-5\n",
        "`slide_on_line`, CREEP: only below 1e-9 m/s a rock has stopped whatever stop_speed says",
        "a rock of 1e-6 m/s is called stopped",
    ),
    Guard(
        "test_speeds_and_rest.py::test_a_rock_of_300_m_per_s_passes_through_no_sheet_however_thin[reference]",
        ARC,
        "    return t if t >= 0.0 else math.inf\n",
        "    return math.ceil(1e3 * t) / 1e3 if t >= 0.0 else math.inf\n",
        "by construction: contact is a root, not a step; here it is rounded up to steps of 1 ms",
        "rocks of 300 m/s are through the sheet before it is looked at",
    ),
    Guard(
        "test_speeds_and_rest.py::test_a_rock_that_no_ground_model_carries_on_stays_where_the_thesis_stops_it[reference]",
        SUSTAINED,
        "STOPPED if norm(state.motion.v) <= surface.stop_speed else UNRESOLVED",
        "STOPPED",
        "`stop_or_give_up`: without a ground model a fast rock in contact is unresolved",
        "a rock of 3 m/s on 60 degrees is called stopped",
    ),
    Guard(
        "test_leaving.py::test_a_rock_leaves_through_the_side_where_its_parabola_does[way0-none-reference]",
        SEARCH,
        "    for k in range(2):\n        if arc.v[k] > 0.0:",
        "    for k in range(0):\n        if arc.v[k] > 0.0:",
        "`flight_end`: a flight ends at the sides of the terrain's box",
        "the rock is followed in the air, down to the lowest corner",
    ),
    Guard(
        "test_leaving.py::test_a_rock_at_its_limit_of_impacts_has_made_exactly_so_many[7-reference]",
        MARCH,
        "    if state.tally.contacts >= physics.settings.max_impacts:\n",
        "    if state.tally.contacts > physics.settings.max_impacts:\n",
        "`next_event`: the limit is looked at before the next event",
        "one impact too many",
    ),
    Guard(
        "test_reproducible.py::test_the_order_of_the_facets_and_of_their_corners_changes_no_bit"
        "[cube's corner-sliding-reference]",
        TIES,
        "    if approach != other:\n        return approach > other\n"
        "    n, m = stored_normal(facets, f), stored_normal(facets, g)\n"
        "    for k in range(3):\n        if n[k] != m[k]:\n            return n[k] > m[k]\n",
        "    n, m = stored_normal(facets, f), stored_normal(facets, g)\n"
        "    if approach != other or n != m:\n        return f < g\n",
        "`wins_tie`: of facets in several planes speed and normal decide, not the number",
        "another order of the facets in the file gives another answer",
    ),
    Guard(
        "test_reproducible.py::test_on_a_plane_cut_into_facets_their_order_changes_no_bit[0.35-reference]",
        TIES,
        "    for axis in (cross(n, way), way):\n",
        "    for axis in ():\n",
        "`_lies_first`: of facets in one plane the place counts, not the number",
        "slides along edges are cut in other places, and end at other times",
    ),
    Guard(
        "test_reproducible.py::test_a_scene_turned_by_a_quarter_gives_the_turned_answer_to_the_last_bit[1-none-reference]",
        "rpf3d_core/vectors.py",
        "    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]\n",
        "    return a[0] * b[0] + (a[1] * b[1] + a[2] * b[2])\n",
        "by construction: `dot` adds x and y first, so that they may change places",
        "a quarter turn changes the last bits",
    ),
    Guard(
        "test_reproducible.py::test_hard_places_give_the_same_bits_on_both_engines[rough slope-none]",
        "rpf3d_core/jit/dispatch.py",
        'OPTIONS = {"error_model": "numpy", "_nrt": False}\n',
        'OPTIONS = {"error_model": "numpy", "_nrt": False, "fastmath": True}\n',
        "OPTIONS: no fastmath, so sums keep their order and nothing is contracted",
        "the compiled engine differs in the last bits",
    ),
    Guard(
        "test_effects.py::test_rocks_that_come_in_flat_on_rough_ground_bounce_off_it_whichever_way_it_is_tilted[reference]",
        LANDING,
        "    if physics.effects is not None and dot(after.v, n) < 0.0:\n",
        "    if False:\n",
        "`rebounded`: a felt normal that would send the rock into the ground is dropped",
        "the rock loses its speed off the ground, and never bounces again",
    ),
    Guard(
        "test_effects.py::test_rocks_that_skim_a_rough_floor_are_thrown_up_and_those_on_a_smooth_floor_settle[reference]",
        SETTLING,
        "    return off * off if as_a_plane else dot(v, v)\n",
        "    return off * off\n",
        "`_rising2`: bounces of a rock that a tilt may throw up are not summed up as on a plane",
        "a rock of 10 m/s stops within a metre of rough ground",
    ),
    Guard(
        "test_effects.py::test_air_gives_nothing_back_to_a_rock_that_lands_early_in_a_stretch[reference]",
        "rpf3d_core/simulation/parabola.py",
        "        if longest == math.inf or not t < 0.5 * longest:",
        "        if True:",
        "`next_parabola`: a flight that ends early in a stretch is flown again with a shorter one",
        "what the air took too much is given back, at another speed: energy rises",
    ),
    Guard(
        "test_effects.py::test_a_rock_that_hovers_comes_to_an_end_that_says_so",
        MARCH,
        "ended(on, MAX_IMPACTS) if hovers(physics.settings.max_impacts, tally) else on\n",
        "on\n",
        "`hovers`: stretches of flight are bounded",
        "a light rock in a drag layer is followed for a million stretches of a millisecond",
    ),
    Guard(
        "test_steep_holes.py::test_no_rock_from_the_rim_flies_below_the_ground[seed 262, 78 degrees]",
        "rpf3d_core/detection/caps.py",
        "    for g in range(len(caps.layout.ring)):\n        if _lies_behind",
        "    for g in range(0):\n        if _lies_behind",
        "`_cap_beyond`: at a corner of a gap, each cap that meets there is asked, not only the cap that was passed",
        "a rock that falls into a hole from its corner flies on below the ground",
    ),
    Guard(
        "test_steep_holes.py::test_no_rock_from_the_rim_flies_below_the_ground[seed 511, 76 degrees]",
        "rpf3d_core/terrain/steep_gaps.py",
        "RATHER_STEEP = 0.7\n",
        "RATHER_STEEP = STEEP\n",
        "RATHER_STEEP: a steep hole whose rim overhangs is closed in its own plane",
        "a rock flies into the hole without passing through a cap",
    ),
    Guard(
        "test_effects.py::test_a_sphere_that_slips_over_the_edges_in_a_plane_feels_none_of_them[40.0-reference]",
        "rpf3d_core/detection/sphere_rim.py",
        "RIM = 2.0\n",
        "RIM = 0.0\n",
        "RIM: edges and corners lie two tolerances deeper than faces",
        "a sphere that rolls over a plane stumbles over the edges in it",
    ),
    Guard(
        "test_never_below.py::test_rocks_that_a_campaign_saw_fall_stay_above_the_ground[seams-30-constant-15]",
        NARROW,
        "    if facets.tolerance < facets.crack:\n        return False\n    return goes_beside(",
        "    if facets.tolerance <= facets.crack:\n        return False\n    return goes_beside(",
        "`_goes_beside`: in a second look a facet takes back a rock that goes along its edge",
        "the rock leaves the floor by rounding at the foot of a wall, which does not press it on, and falls",
    ),
    Guard(
        "test_never_below.py::test_a_rock_that_slides_along_the_foot_of_a_wall_passes_the_seams_of_the_mesh"
        "[overhanging-reference]",
        SUSTAINED,
        "        slack = facets.crack if stuck and",
        "        slack = 0.0 * facets.crack if stuck and",
        "`_slide`: such a rock slides on, up to a crack outside the facet",
        "the facet takes the rock back where it has left it, again and again, and it gets nowhere",
    ),
    Guard(
        "test_never_below.py::test_a_rock_in_the_corner_under_an_overhang_does_not_fall_through_the_floor[reference]",
        NARROW,
        "    if left.resting and b < 0.0 and (a > 0.0 or facets.tolerance >= facets.crack):\n",
        "    if left.resting and b < 0.0 and facets.tolerance >= facets.crack and a < 0.0:\n",
        "`_time_from_near`: a rock that slides into an overhang meets it, though gravity pulls it away",
        "the rock falls past the overhang and through the floor that it has left",
    ),
    Guard(
        "test_never_below.py::test_a_wall_of_many_strips_is_never_hit_from_behind[float32-reference]",
        NARROW,
        "        if side < 0.0 and _glances(",
        "        if False and _glances(",
        "`_prefer`: a rock that comes from the front over the edge of a facet does not hit its back",
        "seams of a rounded wall throw rocks into it",
    ),
    Guard(
        "test_never_below.py::test_a_rock_under_the_ground_is_not_counted_as_one_that_left[reference]",
        MARCH,
        "    if is_fall(flown.contact) and ",
        "    if False and ",
        "`fly_on`: a rock that leaves from below the ground has fallen through it",
        "it counts as one that left the terrain",
    ),
    Guard(
        "test_pieces.py::test_no_rock_passes_below_a_muck_pile_that_cuts_through_the_slope[sliding-constant-reference]",
        SUSTAINED,
        "    if contact.t < obstacle_on(physics.effects, state, piece, rock).t:\n",
        "    if False:\n",
        "`up_to_other_piece`: a slide ends where another piece of terrain cuts its segment",
        "a rock slides on below a muck pile that cuts through the slope",
    ),
    Guard(
        "test_pieces.py::test_rocks_slide_past_the_pile_as_in_segments_sixteen_times_as_short",
        SUSTAINED,
        "        if contact.facet < 0 or _moves_into(",
        "        if True or _moves_into(",
        "`up_to_other_piece`: a chord that enters a facet from which the rock moves away is halved",
        "each contact turns the rock into the chord, and rocks stop in the valley before a muck pile",
    ),
    Guard(
        "test_gullies.py::test_copies_of_facets_do_not_stop_a_rock_that_slides_along_an_edge_within_a_plane"
        "[50-reference]",
        HOLDING,
        "        return line if _is_level_across(n, line) else ZERO\n",
        "        return line\n",
        "`_held_line`: an edge within a plane holds no rock that gravity pulls across it",
        "a rock stops on an edge within a plane, although friction does not hold it",
    ),
    Guard(
        "test_gullies.py::test_a_rock_that_slides_squarely_into_the_foot_of_an_overhang_slides_on_along_the_foot"
        "[7.0-5.0-15.0-0.0-reference]",
        HOLDING,
        "        if on_last and contact.side",
        "        if False and contact.side",
        "`held_by`: where an overhang ends at a vertex of its foot, the floor carries the rock on",
        "impacts without end take the rock's speed, and it stops in a foot that slopes",
    ),
    Guard(
        "test_never_below.py::test_a_rock_at_rest_at_a_vertex_of_the_foot_of_an_overhang_begins_to_slide[reference]",
        "rpf3d_core/simulation/state.py",
        "    if speed2 > GAINED * tally.speed2:\n",
        "    if False:\n",
        "`with_piece`: a rock that is faster than ever makes progress, however short the segment",
        "a rock without friction stops at a vertex while its speed grows",
    ),
    Guard(
        "test_pieces.py::test_tiles_of_one_plane_that_touch_change_no_result"
        "[overlapping by half a crack-sliding-constant-reference]",
        "rpf3d_core/detection/terrain_pieces.py",
        "    if b >= 0.0 or c < -NEAR * facets.crack or c + b >= -facets.tolerance:\n",
        "    if c < -NEAR * facets.crack:\n",
        "`earlier_on_ground`: only a facet that the path passes through stops a slide",
        "a slide is cut at a tile that continues its plane",
    ),
)


def copy_of(folder: Path) -> Path:
    """Copy all files that the tests need into a folder; return this folder."""
    for name in COPIED:
        source = ROOT / name
        if source.is_dir():
            shutil.copytree(source, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(source, folder / name)
    return folder


def changed(guard: Guard, folder: Path) -> None:
    """Remove the guard from the copy in a folder; raise SystemExit unless its text occurs exactly once."""
    path = folder / guard.file
    source = path.read_text()
    if source.count(guard.text) != 1:
        raise SystemExit(f"{guard.file} holds {source.count(guard.text)} times: {guard.text!r}")
    path.write_text(source.replace(guard.text, guard.becomes))


def run(tests: list[str], folder: Path) -> int:
    """Run tests of the copy in a folder, with a separate cache of compiled loops; return the exit code of pytest.

    The code is FAILED if the tests do not end within LONGEST.
    """
    command = [sys.executable, "-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider"]
    command += [f"test/hard/{test}" for test in tests]
    environment = os.environ | {"XDG_CACHE_HOME": str(folder / "cache")}
    try:
        return subprocess.run(command, cwd=folder, env=environment, capture_output=True, timeout=LONGEST).returncode
    except subprocess.TimeoutExpired:
        return FAILED


def holds(guard: Guard) -> bool:
    """Return whether the test of a guard fails without the guard."""
    with tempfile.TemporaryDirectory() as name:
        folder = copy_of(Path(name))
        changed(guard, folder)
        return run([guard.test], folder) == FAILED


def listed() -> str:
    """Return the guards as a list in Markdown: the test of each guard, the guard, and what happens without it."""
    lines = []
    for one in GUARDS:
        guard = f"  - Guard: `{one.file.split('/', 1)[1]}`: {one.guard}."
        lines += [f"- `{one.test}`", *map(_wrapped, (guard, f"  - Without it: {one.without}."))]
    return "\n".join(lines)


def _wrapped(text: str) -> str:
    return textwrap.fill(text, 120, subsequent_indent=" " * 4, break_long_words=False, break_on_hyphens=False)


def main(chosen: list[str]) -> int:
    """Check all guards, or those whose test contains one of the words `chosen`; return the exit code, 0 if all hold."""
    guards = [guard for guard in GUARDS if not chosen or any(word in guard.test for word in chosen)]
    with tempfile.TemporaryDirectory() as name:
        if run(sorted({guard.test for guard in guards}), copy_of(Path(name))) != 0:
            print("some of the tests fail as they are, or cannot be found")
            return 1
    idle = 0
    for guard in guards:
        red = holds(guard)
        idle += not red
        print("red  " if red else "GREEN", guard.test, "|", guard.guard, flush=True)
    print(f"{len(guards) - idle} of {len(guards)} tests fail without their guard")
    return int(idle > 0)


if __name__ == "__main__":
    if sys.argv[1:] == ["--list"]:
        print(listed())
    else:
        sys.exit(main(sys.argv[1:]))
