// The inelastic impact of a body at several contacts: rpf3d_core/body/inelastic.py, in the same order.
#pragma once
#include "one_point.hpp"

constexpr int SWEEPS = 200, UNDAMPED = 100, HALVED = 150;
constexpr double SETTLED = 0.5, ALIGNED = 0.9;

inline Velocity pushed(const Row& row, Velocity velocity, Vec change) {
    const double along[3] = {change.x, change.y, change.z};
    for (int k = 0; k < 3; ++k) {
        velocity.v = add(velocity.v, scale(along[k], row.axes[k]));
        velocity.w = add(velocity.w, scale(along[k], row.turn[k]));
    }
    return velocity;
}

inline Vec local_velocity(const Row& row, Velocity velocity) {
    return {
        dot(row.axes[0], velocity.v) + dot(row.lever[0], velocity.w) - row.aim.x,
        dot(row.axes[1], velocity.v) + dot(row.lever[1], velocity.w) - row.aim.y,
        dot(row.axes[2], velocity.v) + dot(row.lever[2], velocity.w) - row.aim.z,
    };
}

// Solves one contact while the others keep their impulses; returns the change of its velocity.
inline double solve_contact(Row& row, Velocity& velocity, double mu, double share) {
    Vec old = row.local, u = local_velocity(row, velocity);
    Vec free = {
        u.x - row.nn * old.x - row.nt * old.y - row.ns * old.z,
        u.y - row.nt * old.x - row.tt * old.y - row.ts * old.z,
        u.z - row.ns * old.x - row.ts * old.y - row.ss * old.z,
    };
    Vec solved = one_point(row, free, mu), change = subtract(solved, old);
    if (share < 1.0) {
        change = scale(share, change);
        solved = add(old, change);
    }
    if (change.x == 0.0 && change.y == 0.0 && change.z == 0.0) return 0.0;
    row.local = solved;
    velocity = pushed(row, velocity, change);
    return row.nn * std::fabs(change.x) + row.tt * std::fabs(change.y) + row.ss * std::fabs(change.z);
}

// Extrapolates slowly converging sweeps; returns the number of sweeps since the last extrapolation.
inline int leap(Row* rows, int count, Velocity& velocity, int sweeps) {
    double now = 0.0, along = 0.0, before = 0.0;
    for (int i = 0; i < count; ++i) {
        Row& row = rows[i];
        Vec change = subtract(row.local, row.last), old = row.change;
        now += dot(change, change), along += dot(change, old), before += dot(old, old);
        row.change = change;
        row.last = row.local;
    }
    if (sweeps < 2 || !(along > SETTLED * before) || !(along * along > ALIGNED * ALIGNED * now * before))
        return sweeps + 1;
    double reach = along < before ? along / (before - along) : INF;
    for (int i = 0; i < count; ++i)
        if (rows[i].change.x < 0.0) reach = least(reach, -rows[i].local.x / rows[i].change.x);
    if (!(reach < INF)) return sweeps + 1;
    for (int i = 0; i < count; ++i) {
        Vec change = scale(reach, rows[i].change);
        rows[i].local = rows[i].last = add(rows[i].local, change);
        velocity = pushed(rows[i], velocity, change);
    }
    return 0;
}

// Replaces the rolling moment for a new limit; returns the change of the spin, as a velocity.
inline double resist(Vec& moment, Velocity& velocity, Vec moments, double limit, double size) {
    Vec w = velocity.w, free = subtract(w, over(moment, moments));
    moment = rolling_impulse(free, moments, limit);
    velocity.w = add(free, over(moment, moments));
    Vec change = subtract(velocity.w, w);
    return (std::fabs(change.x) + std::fabs(change.y) + std::fabs(change.z)) * size;
}

inline double share_of(int sweep) { return sweep < UNDAMPED ? 1.0 : sweep < HALVED ? 0.5 : 0.2; }

// Solves all contacts in sweeps, and replaces their impulses; returns the velocity of the body afterwards.
inline Velocity inelastic(Contact* contacts, Row* rows, int count, Vec moments, Velocity velocity, double within) {
    Vec inverse = {1.0 / moments.x, 1.0 / moments.y, 1.0 / moments.z}, moment = {0.0, 0.0, 0.0};
    double size = norm({std::sqrt(moments.x), std::sqrt(moments.y), std::sqrt(moments.z)}), allowed = 0.0;
    bool resists = false;
    int leaps = 0;
    for (int i = 0; i < count; ++i) {
        prepare(contacts[i], rows[i], inverse);
        velocity = pushed(rows[i], velocity, rows[i].local);
        allowed += contacts[i].rolling * rows[i].local.x;
        resists = resists || contacts[i].rolling > 0.0;
    }
    if (resists) resist(moment, velocity, moments, allowed, size);
    for (int sweep = 0; sweep < SWEEPS; ++sweep) {
        double share = share_of(sweep), largest = 0.0, limit = 0.0;
        for (int i = 0; i < count; ++i) {
            largest = most(largest, solve_contact(rows[i], velocity, contacts[i].mu, share));
            limit += contacts[i].rolling * rows[i].local.x;
        }
        if (resists) {
            allowed = share == 1.0 ? limit : allowed + share * (limit - allowed);
            largest = most(largest, resist(moment, velocity, moments, allowed, size));
        }
        if (largest <= within || (count == 1 && !resists)) break;
        if (sweep + 1 < UNDAMPED) leaps = leap(rows, count, velocity, leaps);
    }
    for (int i = 0; i < count; ++i) {
        const Row& row = rows[i];
        Vec impulse = add({0.0, 0.0, 0.0}, scale(row.local.x, row.axes[0]));
        contacts[i].impulse = add(add(impulse, scale(row.local.y, row.axes[1])), scale(row.local.z, row.axes[2]));
    }
    return velocity;
}
