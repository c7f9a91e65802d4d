// The part of an edge, a triangle or a tetrahedron nearest to the origin: rpf3d_core/body/simplex.py, in its order.
#pragma once
#include "vectors.hpp"

struct Vertex {
    Vec w;
    int body, corner;
};

struct Simplex {
    int size;
    Vertex a, b, c;
    Vec weights, v;
    double square;
};

INLINED Simplex on_point(const Vertex& a) { return {1, a, a, a, {1.0, 0.0, 0.0}, a.w, dot(a.w, a.w)}; }

INLINED Simplex on_edge(const Vertex& a, const Vertex& b) {
    Vec edge = subtract(b.w, a.w);
    double length = dot(edge, edge), ahead = -dot(a.w, edge);
    if (ahead <= 0.0) return on_point(a);
    if (ahead >= length) return on_point(b);
    double share = ahead / length;
    Vec v = add(a.w, scale(share, edge));
    return {2, a, b, b, {1.0 - share, share, 0.0}, v, dot(v, v)};
}

INLINED void take_closer(Simplex& best, const Simplex& other) {
    if (other.square < best.square) best = other;
}

INLINED Simplex inside_face(const Vertex& a, const Vertex& b, const Vertex& c, Vec weights) {
    Vec v = add(a.w, add(scale(weights.y, subtract(b.w, a.w)), scale(weights.z, subtract(c.w, a.w))));
    return {3, a, b, c, weights, v, dot(v, v)};
}

INLINED Simplex on_face(const Vertex& a, const Vertex& b, const Vertex& c) {
    Vec ab = subtract(b.w, a.w), ac = subtract(c.w, a.w), n = cross(ab, ac);
    double whole = dot(n, n), of_b = dot(cross(ac, a.w), n), of_c = dot(cross(a.w, ab), n);
    double of_a = whole - of_b - of_c;
    bool flat = whole <= 0.0;
    if (!flat && of_a >= 0.0 && of_b >= 0.0 && of_c >= 0.0)
        return inside_face(a, b, c, {of_a / whole, of_b / whole, of_c / whole});
    Simplex best = on_point(a);
    if (flat || of_c < 0.0) take_closer(best, on_edge(a, b));
    if (flat || of_b < 0.0) take_closer(best, on_edge(a, c));
    if (flat || of_a < 0.0) take_closer(best, on_edge(b, c));
    return best;
}

INLINED bool hides(Vec a, Vec b, Vec c, Vec d) {
    Vec n = cross(subtract(b, a), subtract(c, a));
    return dot(n, subtract(d, a)) * -dot(n, a) > 0.0;
}

INLINED Simplex in_solid(const Vertex& a, const Simplex& old, bool apart) {
    const Vertex &b = old.a, &c = old.b, &d = old.c;
    bool no_abc = hides(a.w, b.w, c.w, d.w), no_acd = hides(a.w, c.w, d.w, b.w), no_abd = hides(a.w, b.w, d.w, c.w);
    bool all_hidden = no_abc && no_acd && no_abd;
    if (all_hidden && !apart) return {4, b, c, d, old.weights, {0.0, 0.0, 0.0}, 0.0};
    Simplex best = on_point(a);
    if (all_hidden || !no_abc) take_closer(best, on_face(a, b, c));
    if (all_hidden || !no_acd) take_closer(best, on_face(a, c, d));
    if (all_hidden || !no_abd) take_closer(best, on_face(a, b, d));
    return best;
}

INLINED Simplex extended(const Vertex& a, const Simplex& old, bool apart) {
    if (old.size == 1) return on_edge(a, old.a);
    if (old.size == 2) return on_face(a, old.a, old.b);
    return in_solid(a, old, apart);
}

INLINED bool same(const Vertex& a, const Vertex& b) { return a.body == b.body && a.corner == b.corner; }

INLINED bool holds(const Simplex& simplex, const Vertex& added) {
    return same(added, simplex.a) || (simplex.size > 1 && same(added, simplex.b)) ||
           (simplex.size > 2 && same(added, simplex.c));
}

INLINED Vec direction(const Simplex& simplex) {
    if (simplex.size == 1) return simplex.v;
    Vec along = subtract(simplex.b.w, simplex.a.w);
    if (simplex.size == 2) return subtract(simplex.v, scale(dot(simplex.v, along) / dot(along, along), along));
    Vec n = cross(along, subtract(simplex.c.w, simplex.a.w));
    return dot(n, simplex.a.w) >= 0.0 ? n : scale(-1.0, n);
}
