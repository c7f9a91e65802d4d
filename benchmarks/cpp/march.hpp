// From event to event: rpf3d_core/simulation/{march,state,sustained}.py and rpf3d_core/kinetics/rebound.py, for constant
// restitution and no ground model. Cases that such a fall cannot reach are marked and end the program.
#pragma once
#include <cstdio>
#include <cstdlib>

#include "walk.hpp"

constexpr int MOVING = -1, STOPPED = 0, LEFT_TERRAIN = 1, MAX_TIME = 4, MAX_IMPACTS = 5, UNRESOLVED = 6;
constexpr double SETTLED = 1e-6;

struct Surface {
    double R_n, R_t, mu, stop_speed;
};

struct Settings {
    double gravity, smallest_bounce, max_time;
    int64_t max_impacts;
};

struct Tally {
    double path = 0.0;
    int64_t impacts = 0, pieces = 0, contacts = 0;
    double speed2 = 0.0, height = 0.0, ground_speed = NAN;
    int64_t facet = -1, idle = 0;
};

struct State {
    Motion motion;
    Left left = NOTHING_LEFT;
    bool stands = false;
    Tally tally;
    int64_t outcome = MOVING;
};

struct World {
    Facets facets;
    Locator locator;
    const Surface* surfaces;
    Settings settings;
};

inline void add_piece(Tally& tally, double length, const Motion& motion, double tolerance) {
    tally.idle = length > tolerance ? 0 : tally.idle + 1;
    tally.speed2 = most(tally.speed2, dot(motion.v, motion.v));
    tally.path = tally.path + length;
    tally.pieces += 1;
}

inline void stand(const World& world, State& state, Vec v) {
    state.motion.x = on_plane(world.facets, state.left.facet, state.motion.x);
    state.motion.v = v;
    if (std::isnan(state.tally.ground_speed)) state.tally.ground_speed = norm(v);
    state.tally.facet = state.left.facet;
    state.left.resting = true;
    state.stands = true;
}

struct Rest {
    Vec along, down, v;
    double t;
    bool ends;
};

inline Rest rest_of_bounces(const Surface& surface, const Motion& motion, Vec n, double gravity) {
    double r = surface.R_n, q = surface.R_t;
    Vec zero = {0.0, 0.0, 0.0};
    if (r >= 1.0) return {zero, zero, motion.v, 0.0, false};
    double g_n = gravity * n.z;
    Vec g_t = gravity_along(n, gravity), u = without(motion.v, n);
    double T = 2.0 * most(dot(motion.v, n), 0.0) / g_n;
    if (T == 0.0) return {zero, zero, u, 0.0, true};
    double weight = (r * q / (1.0 - r * q) + 0.5) / (1.0 - r * r), t = T / (1.0 - r);
    Vec v = q == 1.0 ? add(u, scale(t, g_t)) : zero;
    return {scale(T / (1.0 - r * q), u), scale(weight * T * T, g_t), v, t, true};
}

inline bool stays_on(const Facets& facets, int64_t f, Vec x, Vec along, Vec down) {
    return contains(facets, f, add(x, along), false, facets.tolerance) &&
           contains(facets, f, add(x, down), false, facets.tolerance) &&
           contains(facets, f, add(x, add(along, down)), false, facets.tolerance);
}

inline void settle(const World& world, State& state, const Surface& surface, Vec n) {
    const Settings& settings = world.settings;
    const Facets& facets = world.facets;
    Motion motion = state.motion;
    double g_n = settings.gravity * n.z, rise2 = dot(motion.v, n) * dot(motion.v, n);
    if (g_n <= 0.0 || rise2 >= 2.0 * g_n * settings.smallest_bounce) return;
    Rest rest = rest_of_bounces(surface, motion, n, settings.gravity);
    Vec x = add(motion.x, add(rest.along, rest.down));
    if (rest.ends && motion.t + rest.t <= settings.max_time &&
        stays_on(facets, state.left.facet, motion.x, rest.along, rest.down)) {
        state.motion = {motion.t + rest.t, x, rest.v};
        add_piece(state.tally, norm(add(rest.along, rest.down)), state.motion, facets.tolerance);
        return stand(world, state, along(rest.v, n));
    }
    if (rise2 < 2.0 * g_n * settings.smallest_bounce * SETTLED) stand(world, state, along(motion.v, n));
}

inline void land(const World& world, State& state, const Contact& contact) {
    if (state.left.resting || (state.left.facet < 0 && contact.t == 0.0)) {
        std::fputs("a rock was released on the ground: sliding is not part of this program\n", stderr);
        std::exit(1);
    }
    Vec n = scale(contact.side, stored_normal(world.facets, contact.facet));
    const Surface& surface = world.surfaces[world.facets.zone[contact.facet]];
    Vec v = state.motion.v;
    state.motion.v = add(scale(-surface.R_n * dot(v, n), n), scale(surface.R_t, without(v, n)));
    state.tally.speed2 = most(state.tally.speed2, dot(state.motion.v, state.motion.v));
    state.tally.impacts += 1;
    state.tally.contacts += 1;
    state.tally.facet = contact.facet;
    state.left = {contact.facet, -1, contact.side, false, -1};
    settle(world, state, surface, n);
}

inline void fly_on(const World& world, State& state) {
    const Settings& settings = world.settings;
    Arc arc = {state.motion.x, state.motion.v, settings.gravity};
    double end = flight_end(world.facets, arc);
    Contact contact = first_contact(world.locator, world.facets, arc, state.left, end);
    double left = settings.max_time - state.motion.t;
    double t = least(contact.t, end, left);
    state.motion = advance(state.motion, settings.gravity, t);
    add_piece(state.tally, arc_length(arc, t), state.motion, world.facets.tolerance);
    if (t == left) state.outcome = MAX_TIME;
    else if (contact.t > end) state.outcome = LEFT_TERRAIN;
    else land(world, state, contact);
}

inline State follow(const World& world, Vec x, Vec v) {
    State state;
    state.motion = {0.0, x, v};
    state.tally.speed2 = dot(v, v);
    while (state.outcome == MOVING) {
        if (state.tally.contacts >= world.settings.max_impacts) {
            state.outcome = MAX_IMPACTS;
        } else if (state.stands) {
            const Surface& surface = world.surfaces[world.facets.zone[state.left.facet]];
            state.outcome = norm(state.motion.v) <= surface.stop_speed ? STOPPED : UNRESOLVED;
        } else {
            fly_on(world, state);
        }
    }
    return state;
}
