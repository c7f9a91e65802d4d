// The distance of a convex body and a triangle: rpf3d_core/body/distance.py, in the same order.
#pragma once
#include "simplex.hpp"

constexpr double CLOSED = 1e-14, ROUNDING = 1e-15, TOUCHING = 1e-14;
constexpr int STALLS = 4, ROUNDS = 100;

struct Triangle {
    Vec corners[3];
};

struct Separation {
    double distance;
    Vec normal, on_facet, on_body;
    bool overlap;
};

// The row of the corner least far in the direction n, by two searches at a time, each over every second corner. Masks
// select the rows, because g++ compiles conditions to branches here, and the processor cannot predict them.
inline int lowest(const Vec* corners, int first, int last, Vec n) {
    double lowest_height = INF, other_lowest = INF;
    int row = first, other = first;
    for (int i = first; i < last - 1; i += 2) {
        double height = dot(n, corners[i]), other_height = dot(n, corners[i + 1]);
        int64_t lower = -int64_t(height < lowest_height), other_lower = -int64_t(other_height < other_lowest);
        row ^= (row ^ i) & int(lower);
        other ^= (other ^ (i + 1)) & int(other_lower);
        lowest_height = least(lowest_height, height);
        other_lowest = least(other_lowest, other_height);
    }
    if ((last - first) % 2 == 1 && dot(n, corners[last - 1]) < lowest_height)
        lowest_height = dot(n, corners[last - 1]), row = last - 1;
    return other_lowest < lowest_height || (other_lowest == lowest_height && other < row) ? other : row;
}

inline int highest(const Triangle& facet, Vec n) {
    double a = dot(facet.corners[0], n), b = dot(facet.corners[1], n), c = dot(facet.corners[2], n);
    if (a >= b && a >= c) return 0;
    return b >= c ? 1 : 2;
}

inline Vec unit(Vec a) {
    double square = dot(a, a);
    return square > 0.0 ? scale(1.0 / std::sqrt(square), a) : a;
}

inline Vertex vertex(Vec corner, int row, const Triangle& facet, int i) {
    return {subtract(corner, facet.corners[i]), row, i};
}

inline double reach(const Vertex& a) { return std::fabs(a.w.x) + std::fabs(a.w.y) + std::fabs(a.w.z); }

inline Vec mixed(Vec weights, Vec a, Vec b, Vec c) {
    return add(scale(weights.x, a), add(scale(weights.y, b), scale(weights.z, c)));
}

inline Separation found(const Vec* corners, double size, const Triangle& facet, const Simplex& now, Vec n,
                        bool overlap) {
    const Vertex &a = now.a, &b = now.b, &c = now.c;
    const Vec* ground = facet.corners;
    Vec on_facet = mixed(now.weights, ground[a.corner], ground[b.corner], ground[c.corner]);
    Vec on_body = mixed(now.weights, scale(size, corners[a.body]), scale(size, corners[b.body]),
                        scale(size, corners[c.body]));
    return {overlap ? 0.0 : std::sqrt(now.square), unit(n), on_facet, on_body, overlap};
}

inline Separation separation(const Vec* corners, int first, int last, double size, const Triangle& facet, Vec guess) {
    int row = lowest(corners, first, last, guess), stalls = 0;
    Vec begin = scale(size, corners[row]), normal = guess;
    Simplex now = on_face(vertex(begin, row, facet, 0), vertex(begin, row, facet, 1), vertex(begin, row, facet, 2));
    double longest = most(reach(now.a), reach(now.c)), lower = -INF;
    for (int round = 0; round < ROUNDS; ++round) {
        Vec n = direction(now);
        double length = std::sqrt(now.square), square = dot(n, n);
        if (length <= TOUCHING * longest || square <= 0.0) break;
        row = lowest(corners, first, last, n);
        Vertex added = vertex(scale(size, corners[row]), row, facet, highest(facet, n));
        double bound = dot(n, added.w) / std::sqrt(square);
        longest = most(longest, reach(added));
        if (bound > lower) lower = bound, normal = n;
        double allowed = CLOSED * length + ROUNDING * longest;
        if (length - lower <= allowed || holds(now, added)) break;
        Simplex then = extended(added, now, lower > 0.0);
        if (then.square >= now.square) ++stalls;
        if (stalls > STALLS || std::sqrt(then.square) > length + allowed) break;
        now = then;
    }
    return found(corners, size, facet, now, lower > 0.0 ? normal : guess, lower <= 0.0);
}
