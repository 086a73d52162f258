// Shading frames that a latent chooses: the counterpart of jaxbrdf/models/shading_frame.py.
#ifndef JB_FRAME_CL
#define JB_FRAME_CL

#include "directions.cl"

// |v|^2 from which a vector gives a whole axis (LEAST_SQUARE in shading_frame.py).
#define JB_LEAST_SQUARE 1e-6f

#define JB_FRAME_NUMBERS 6

typedef struct {
    jb_real3 tangent;
    jb_real3 bitangent;
    jb_real3 normal;
} jb_Frame;

JB_INLINE jb_real3 jb_unit(const jb_real3 v) {
    const jb_real scale = jb_rsqrt(jb_max(jb_dot(v, v), JB_REAL(JB_LEAST_SQUARE)));
    const jb_real3 unit = {v.x * scale, v.y * scale, v.z * scale};
    return unit;
}

// The frame of JB_FRAME_NUMBERS numbers: the surface's own for zeros.
JB_INLINE jb_Frame jb_frame(const jb_real *numbers) {
    const jb_real3 up = {numbers[0], numbers[1], 1.0f + numbers[2]};
    const jb_real3 n = jb_unit(up);
    const jb_real3 side = {1.0f + numbers[3], numbers[4], numbers[5]};
    const jb_real along = jb_dot(side, n);
    const jb_real3 across = {side.x - along * n.x, side.y - along * n.y, side.z - along * n.z};
    const jb_real3 t = jb_unit(across);
    const jb_real3 b = {n.y * t.z - n.z * t.y, n.z * t.x - n.x * t.z, n.x * t.y - n.y * t.x};
    const jb_Frame frame = {t, b, n};
    return frame;
}

JB_INLINE jb_real3 jb_seen(const jb_Frame frame, const jb_real3 w) {
    const jb_real3 seen = {jb_dot(frame.tangent, w), jb_dot(frame.bitangent, w), jb_dot(frame.normal, w)};
    return seen;
}

// The half and the difference vector of directions seen in the frame, each projected to the unit disk and lifted again:
// `pair_above`, then `half_difference`. Sum and difference are seen instead of the directions, which in float32 loses
// nothing where these are almost opposed. Of the heights a = n.wi and b = n.wo, |a| + |b| is the larger one of |a + b| and
// |a - b|, and |a| - |b| the other one, with its partner's sign.
JB_INLINE jb_HalfDifference jb_seen_half_difference(const jb_Frame frame, const jb_real3 wi, const jb_real3 wo) {
    jb_real3 sum = jb_seen(frame, jb_long_sum(wi, wo)), across = jb_seen(frame, jb_across(wi, wo));
    const jb_real other = 2.0f * JB_LONG * across.z;
    const jb_integer same_side = jb_abs(sum.z) >= jb_abs(other);
    const jb_real larger = same_side ? sum.z : other;
    const jb_real smaller = 0.5f / JB_LONG * (same_side ? other : sum.z);
    sum.z = jb_abs(larger);
    across.z = larger < 0.0f ? -smaller : smaller;
    return jb_half_difference_of(sum, across);
}

#endif
