// The facets and the geometry of a facet: rpf3d_core/terrain/facets.py, rpf3d_core/terrain/facet_geometry.py.
#pragma once
#include <algorithm>

#include "vectors.hpp"

constexpr double ALONG_EDGE = 1e-14, NEAR = 4.0, TIP = 2.0, REACH = 1024.0;

struct Facets {
    const double* geometry;  // (12 F,) three corners, normal
    const int32_t* zone;     // (F,)
    Vec low, high;
    double tolerance;
};

inline Vec vector_at(const double* p) { return {p[0], p[1], p[2]}; }
inline Vec corner(const Facets& facets, int64_t f, int k) { return vector_at(facets.geometry + 12 * f + 3 * k); }
inline Vec stored_normal(const Facets& facets, int64_t f) { return vector_at(facets.geometry + 12 * f + 9); }

inline Vec edge_of(const Facets& facets, int64_t f, int k) {
    return subtract(corner(facets, f, (k + 1) % 3), corner(facets, f, k));
}

struct EdgeDistance {
    double squared, distance;
};

inline EdgeDistance edge_distance(const Facets& facets, int64_t f, int k, Vec p) {
    Vec edge = edge_of(facets, f, k), inward = cross(stored_normal(facets, f), edge);
    return {dot(edge, edge), dot(inward, subtract(p, corner(facets, f, k)))};
}

inline Vec on_plane(const Facets& facets, int64_t f, Vec x) {
    Vec n = stored_normal(facets, f);
    return subtract(x, scale(dot(n, subtract(x, corner(facets, f, 0))), n));
}

inline bool is_at_box(const Facets& facets, int64_t f, Vec p, double slack) {
    Vec a = corner(facets, f, 0), b = corner(facets, f, 1), c = corner(facets, f, 2);
    auto apart = [slack](double q, double u, double v, double w) {
        return q < std::min({u, v, w}) - slack || q > std::max({u, v, w}) + slack;
    };
    return !(apart(p.x, a.x, b.x, c.x) || apart(p.y, a.y, b.y, c.y) || apart(p.z, a.z, b.z, c.z));
}

inline bool contains(const Facets& facets, int64_t f, Vec p, bool strictly, double slack) {
    for (int k = 0; k < 3; ++k) {
        auto [squared, distance] = edge_distance(facets, f, k, p);
        bool near = distance * distance <= slack * slack * squared;
        if (!(strictly ? distance > 0.0 && !near : distance >= 0.0 || near)) return false;
    }
    return is_at_box(facets, f, on_plane(facets, f, p), TIP * slack);
}

inline double line_exit(const Facets& facets, int64_t f, Vec x, Vec direction, double parallel) {
    double leave = INF;
    for (int k = 0; k < 3; ++k) {
        Vec inward = cross(stored_normal(facets, f), edge_of(facets, f, k));
        double closing = -dot(inward, direction);
        if (closing > parallel * norm(inward))
            leave = least(leave, most(edge_distance(facets, f, k, x).distance, 0.0) / closing);
    }
    return leave;
}

inline bool leads_on(const Facets& facets, int64_t f, Vec x, Vec direction, double parallel) {
    return line_exit(facets, f, x, direction, parallel) > facets.tolerance;
}
