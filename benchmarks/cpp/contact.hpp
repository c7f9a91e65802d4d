// Contact of an arc with a facet: rpf3d_core/detection/narrow_phase.py.
#pragma once
#include <array>

#include "facets.hpp"

struct Contact {
    double t;
    int64_t facet;
    double side, approach;
};

struct Left {
    int64_t facet, other;
    double side;
    bool resting;
    int64_t before;
};

constexpr double GRAZING = 1e-9;
constexpr Contact NO_CONTACT = {INF, -1, 1.0, 0.0};
constexpr Left NOTHING_LEFT = {-1, -1, 1.0, false, -1};

inline double falling_time(double c, double b, double a) {
    if (c < 0.0 && a >= 0.0) return INF;
    double discriminant = b * b - 4.0 * a * c;
    if (discriminant < 0.0) return INF;
    if (b > 0.0) return a < 0.0 ? (-b - std::sqrt(discriminant)) / (2.0 * a) : INF;
    double denominator = std::sqrt(discriminant) - b;
    if (denominator == 0.0) return c == 0.0 && a < 0.0 ? 0.0 : INF;
    double t = 2.0 * c / denominator;
    return t >= 0.0 ? t : INF;
}

inline double return_time(const Left& left, double b, double a) {
    double rising = left.side * b, bending = left.side * a;
    return rising > 0.0 && bending < 0.0 ? -rising / bending : INF;
}

inline bool carries(const Facets& facets, int64_t f, const Arc& arc, const Left& left) {
    if (!left.resting) return true;
    if (f == left.facet) return false;
    double speed = norm(arc.v);
    return speed == 0.0 || leads_on(facets, f, arc.x, scale(1.0 / speed, arc.v), ALONG_EDGE);
}

inline bool passes_over(const Facets& facets, int64_t f, const Arc& arc, const Left& left) {
    Vec n = stored_normal(facets, f), origin = corner(facets, f, 0);
    double highest = -INF, lowest = INF;
    for (int k = 0; k < 3; ++k) {
        double height = left.side * dot(n, subtract(corner(facets, left.facet, k), origin));
        highest = most(highest, height);
        lowest = least(lowest, height);
    }
    if (highest > facets.tolerance || lowest >= -facets.tolerance) return false;
    Vec onward = without(arc.v, n);
    double speed = norm(onward);
    return speed > 0.0 && !leads_on(facets, f, arc.x, scale(1.0 / speed, onward), ALONG_EDGE);
}

inline double time_from_near(const Facets& facets, int64_t f, const Arc& arc, const Left& left, double c, double b,
                             double a) {
    if (b * b <= GRAZING * GRAZING * dot(arc.v, arc.v)) return a < 0.0 && carries(facets, f, arc, left) ? 0.0 : INF;
    if (b < 0.0 && left.facet >= 0 && passes_over(facets, f, arc, left)) return INF;
    return falling_time(most(c, 0.0), b, a);
}

inline double approach_of(const Facets& facets, int64_t f, const Arc& arc, Vec n, double t) {
    if (t == 0.0 && arc.v.x == 0.0 && arc.v.y == 0.0 && arc.v.z == 0.0) {
        Vec down = gravity_along(n, arc.gravity);
        double pull = norm(down);
        return pull > 0.0 && leads_on(facets, f, arc.x, scale(1.0 / pull, down), ALONG_EDGE) ? pull : 0.0;
    }
    return std::fabs(dot(n, arc.v) - arc.gravity * n.z * t);
}

inline std::array<double, 3> reach(const Facets& facets, int64_t f, Vec p, Vec axis) {
    double a = dot(subtract(corner(facets, f, 0), p), axis), b = dot(subtract(corner(facets, f, 1), p), axis),
           c = dot(subtract(corner(facets, f, 2), p), axis);
    return {std::max({a, b, c}), std::max(std::min(a, b), std::min(std::max(a, b), c)), std::min({a, b, c})};
}

inline bool lies_first(const Facets& facets, int64_t f, int64_t g, const Arc& arc, double t, Vec n) {
    Vec p = position(arc, t), v = {arc.v.x, arc.v.y, arc.v.z - arc.gravity * t};
    Vec way = v.x != 0.0 || v.y != 0.0 || v.z != 0.0 ? without(v, n) : gravity_along(n, arc.gravity);
    for (Vec axis : {cross(n, way), way}) {
        auto mine = reach(facets, f, p, axis), others = reach(facets, g, p, axis);
        for (int k = 0; k < 3; ++k)
            if (mine[k] != others[k]) return mine[k] > others[k];
    }
    return f < g;
}

inline bool wins_tie(const Facets& facets, int64_t f, const Arc& arc, double t, double approach, const Contact& best) {
    if (approach != best.approach) return approach > best.approach;
    Vec n = stored_normal(facets, f), m = stored_normal(facets, best.facet);
    if (n.x != m.x) return n.x > m.x;
    if (n.y != m.y) return n.y > m.y;
    if (n.z != m.z) return n.z > m.z;
    return lies_first(facets, f, best.facet, arc, t, n);
}

inline Contact prefer(const Facets& facets, int64_t f, const Arc& arc, Vec n, double t, double side, Contact best) {
    if (t > best.t || t == INF) return best;
    double approach = approach_of(facets, f, arc, n, t);
    if (t == best.t && !wins_tie(facets, f, arc, t, approach, best)) return best;
    double slack = t == 0.0 ? NEAR * facets.tolerance : facets.tolerance;
    if (!contains(facets, f, position(arc, t), side < 0.0, slack)) return best;
    return {t, f, side, approach};
}

inline Contact earlier_contact(const Facets& facets, int64_t f, const Arc& arc, const Left& left, Contact best) {
    Vec n = stored_normal(facets, f);
    if (n.x == 0.0 && n.y == 0.0 && n.z == 0.0) return best;
    double b = dot(n, arc.v), a = -0.5 * arc.gravity * n.z;
    if (f == left.facet && !left.resting) return prefer(facets, f, arc, n, return_time(left, b, a), left.side, best);
    double c = dot(n, subtract(arc.x, corner(facets, f, 0)));
    if (std::fabs(c) <= NEAR * facets.tolerance) {
        double s = left.side, t = time_from_near(facets, f, arc, left, s * c, s * b, s * a);
        return prefer(facets, f, arc, n, t, s, best);
    }
    best = prefer(facets, f, arc, n, falling_time(c, b, a), 1.0, best);
    return prefer(facets, f, arc, n, falling_time(-c, -b, -a), -1.0, best);
}

inline double flight_end(const Facets& facets, const Arc& arc) {
    double slack = facets.tolerance;
    double end = fall_time(arc.v.z, most(arc.x.z - facets.low.z + slack, 0.0), arc.gravity);
    auto sideways = [&](double x, double v, double low, double high) {
        if (v > 0.0) end = least(end, most((high + slack - x) / v, 0.0));
        else if (v < 0.0) end = least(end, most((low - slack - x) / v, 0.0));
    };
    sideways(arc.x.x, arc.v.x, facets.low.x, facets.high.x);
    sideways(arc.x.y, arc.v.y, facets.low.y, facets.high.y);
    return end;
}
