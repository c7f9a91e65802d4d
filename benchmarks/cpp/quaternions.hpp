// Unit quaternions (w, x, y, z): rpf3d_core/body/quaternions.py, in the same order.
#pragma once
#include "vectors.hpp"

struct Quaternion {
    double w, x, y, z;
};

inline Quaternion multiply(Quaternion p, Quaternion q) {
    return {
        p.w * q.w - p.x * q.x - p.y * q.y - p.z * q.z,
        p.w * q.x + p.x * q.w + p.y * q.z - p.z * q.y,
        p.w * q.y - p.x * q.z + p.y * q.w + p.z * q.x,
        p.w * q.z + p.x * q.y - p.y * q.x + p.z * q.w,
    };
}

inline Quaternion inverse(Quaternion q) { return {q.w, -q.x, -q.y, -q.z}; }

inline Vec turned(Quaternion q, Vec a) {
    double x = 2.0 * (q.y * a.z - q.z * a.y), y = 2.0 * (q.z * a.x - q.x * a.z), z = 2.0 * (q.x * a.y - q.y * a.x);
    return {
        a.x + q.w * x + q.y * z - q.z * y,
        a.y + q.w * y + q.z * x - q.x * z,
        a.z + q.w * z + q.x * y - q.y * x,
    };
}

inline Vec turned_back(Quaternion q, Vec a) { return turned(inverse(q), a); }

inline Quaternion normalised(Quaternion q) {
    double k = 1.0 / std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
    return {k * q.w, k * q.x, k * q.y, k * q.z};
}

inline Quaternion turn_by(Vec angle) {
    const double small_angle = 1e-4;
    double half = 0.5 * norm(angle);
    double k = half < small_angle ? 0.5 * (1.0 - half * half / 6.0) : 0.5 * std::sin(half) / half;
    return {std::cos(half), k * angle.x, k * angle.y, k * angle.z};
}
