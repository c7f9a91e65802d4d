// The walk over the cells under an arc: rpf3d_core/detection/{bucket_locator,slabs,stretch,plan_boxes}.py.
#pragma once
#include <algorithm>

#include "contact.hpp"

constexpr int SHIFT = 2, LEVELS = 4, CLEAR = 3;
constexpr int64_t PARTS = 128, GUARDS = 0x80808080;
constexpr double SLOWEST = 1e-100;

struct Locator {
    double x, y, cell;
    int64_t nx, ny;
    const int64_t* starts;
    const int32_t* ids;
    const uint32_t* boxes;
    const double* planes;
    const int64_t* first;
};

struct Stretch {
    Vec p, q, v;
    double bend;
    int64_t probe;
};

inline int64_t cell_index(double value, double origin, double cell, int64_t count) {
    return std::min(std::max(int64_t(std::floor((value - origin) / cell)), int64_t(0)), count - 1);
}

inline int64_t width_of(int64_t count, int level) { return ((count - 1) >> (SHIFT * level)) + 1; }

inline bool flies_over(const Locator& locator, int level, int64_t k, Vec p, Vec q, double slack) {
    const double* plane = locator.planes + 4 * (locator.first[level] + k);
    Vec n = vector_at(plane);
    return least(dot(n, p), dot(n, q)) > plane[3] + slack;
}

inline int64_t part_of(double value, double origin, double per_cell, int64_t index) {
    return int64_t(least(most(((value - origin) * per_cell - double(index)) * PARTS, 0.0), PARTS - 1.0));
}

inline Stretch stretch_of(const Locator& grid, int64_t i, int64_t j, const Arc& arc, double begin, double end) {
    Vec p = position(arc, begin), q = position(arc, end);
    double lasts = end - begin, per_cell = 1.0 / grid.cell;
    int64_t low_x = part_of(least(p.x, q.x), grid.x, per_cell, i), high_x = part_of(most(p.x, q.x), grid.x, per_cell, i);
    int64_t low_y = part_of(least(p.y, q.y), grid.y, per_cell, j), high_y = part_of(most(p.y, q.y), grid.y, per_cell, j);
    int64_t probe = GUARDS | high_x | (PARTS - 1 - low_x) << 8 | high_y << 16 | (PARTS - 1 - low_y) << 24;
    return {p, q, arc.v, 0.125 * arc.gravity * lasts * lasts, probe};
}

inline double left_of(Vec v, Vec p, Vec corner) { return v.x * (corner.y - p.y) - v.y * (corner.x - p.x); }

inline bool out_of_reach(const Facets& facets, int64_t f, const Stretch& s) {
    double slack = REACH * facets.tolerance;
    Vec origin = corner(facets, f, 0);
    double a = left_of(s.v, s.p, origin);
    double b = left_of(s.v, s.p, corner(facets, f, 1)), c = left_of(s.v, s.p, corner(facets, f, 2));
    double speed = std::fabs(s.v.x) + std::fabs(s.v.y);
    if (speed > SLOWEST && (most(a, b, c) < -slack * speed || least(a, b, c) > slack * speed)) return true;
    Vec n = stored_normal(facets, f);
    double begin = dot(n, subtract(s.p, origin)), end = dot(n, subtract(s.q, origin)), bend = n.z * s.bend;
    return least(begin, end) + least(bend, 0.0) > slack || most(begin, end) + most(bend, 0.0) < -slack;
}

inline Contact earliest_in_bucket(const Locator& locator, const Facets& facets, const Arc& arc, const Left& left,
                                  int64_t i, int64_t j, double begin, double leave, Contact best) {
    int64_t k = j * locator.nx + i, stop = locator.starts[k + 1];
    double until = least(leave, best.t);
    Stretch stretch = stretch_of(locator, i, j, arc, begin, until);
    for (int64_t entry = locator.starts[k]; entry < stop; ++entry) {
        if (((stretch.probe - locator.boxes[entry]) & GUARDS) != GUARDS) continue;
        int64_t f = locator.ids[entry];
        if (f == left.facet || out_of_reach(facets, f, stretch)) continue;
        best = earlier_contact(facets, f, arc, left, best);
        if (best.t < until) {
            until = best.t;
            stretch = stretch_of(locator, i, j, arc, begin, until);
        }
    }
    return best;
}

inline double pace_of(double v) { return std::fabs(v) > SLOWEST ? 1.0 / v : INF; }

inline double leave_time(int64_t index, int64_t count, int level, double origin, double cell, double x, double pace) {
    if (pace == INF || index == (pace > 0.0 ? count - 1 : 0)) return INF;
    int64_t edge = (pace > 0.0 ? index + 1 : index) << (SHIFT * level);
    return (origin + double(edge) * cell - x) * pace;
}

inline int64_t beyond(int64_t index, int level, double pace) {
    return pace > 0.0 ? (index + 1) << (SHIFT * level) : (index << (SHIFT * level)) - 1;
}

inline int64_t still_in(int64_t index, int level, double x, double origin, double cell, int64_t count) {
    if (level == 0) return index;
    int64_t first = index << (SHIFT * level), behind = (index + 1) << (SHIFT * level);
    return std::min(std::max(cell_index(x, origin, cell, count), first), behind - 1);
}

inline Contact first_contact(const Locator& locator, const Facets& facets, const Arc& arc, const Left& left, double end) {
    Contact best = left.facet >= 0 ? earlier_contact(facets, left.facet, arc, left, NO_CONTACT) : NO_CONTACT;
    int64_t i = cell_index(arc.x.x, locator.x, locator.cell, locator.nx);
    int64_t j = cell_index(arc.x.y, locator.y, locator.cell, locator.ny);
    double pace_x = pace_of(arc.v.x), pace_y = pace_of(arc.v.y), begin = 0.0;
    Vec p = arc.x;
    int level = 0, clear = 0;
    while (0 <= i && i < locator.nx && 0 <= j && j < locator.ny) {
        int64_t column = i >> (SHIFT * level), row = j >> (SHIFT * level);
        int64_t columns = width_of(locator.nx, level), rows = width_of(locator.ny, level);
        double leave_x = leave_time(column, columns, level, locator.x, locator.cell, arc.x.x, pace_x);
        double leave_y = leave_time(row, rows, level, locator.y, locator.cell, arc.x.y, pace_y);
        double leave = least(leave_x, leave_y, end);
        Vec q = position(arc, leave);
        if (flies_over(locator, level, row * columns + column, p, q, REACH * facets.tolerance)) {
            ++clear;
        } else if (level > 0) {
            --level;
            clear = 0;
            continue;
        } else {
            best = earliest_in_bucket(locator, facets, arc, left, i, j, begin, leave, best);
            clear = 0;
        }
        if (best.t <= leave || leave >= end) break;
        begin = leave;
        p = q;
        if (leave_x <= leave_y) {
            i = beyond(column, level, pace_x);
            j = still_in(row, level, q.y, locator.y, locator.cell, locator.ny);
        } else {
            i = still_in(column, level, q.x, locator.x, locator.cell, locator.nx);
            j = beyond(row, level, pace_y);
        }
        if (clear >= CLEAR && level < LEVELS - 1) {
            ++level;
            clear = 1;
        }
    }
    return best;
}
