// Unit vectors in the local frame, z = normal, x = tangent: the counterpart of jaxbrdf/core/directions.py.
#ifndef JB_DIRECTIONS_CL
#define JB_DIRECTIONS_CL

#include "numerics.cl"

// 2^32, by which wi + wo is lengthened: where the directions are almost opposed its squares are normal numbers yet.
#define JB_LONG 4294967296.0f

typedef struct {
    jb_real3 wh;
    jb_real3 wd;
} jb_HalfDifference;

// Cosine and sine of an azimuth.
typedef jb_Angle jb_Azimuth;

// 2^-24: the least cosine of a direction above the horizon (LEAST_COSINE in smith.py).
#define JB_LEAST_LIFTED 5.9604645e-8f

// w with its cosine raised to JB_LEAST_LIFTED.
JB_INLINE jb_real3 jb_lift(const jb_real3 w) {
    const jb_real3 lifted = {w.x, w.y, jb_max(w.z, JB_REAL(JB_LEAST_LIFTED))};
    return lifted;
}

// Sine between w and the normal, from the components that keep their precision near the pole.
JB_INLINE jb_real jb_sin_theta(const jb_real3 w) { return jb_safe_sqrt(w.x * w.x + w.y * w.y); }

// Azimuth of w about the normal, zero at the pole.
JB_INLINE jb_Azimuth jb_azimuth_of(const jb_real3 w) {
    const jb_real inverse = jb_safe_rsqrt(w.x * w.x + w.y * w.y);
    const jb_Azimuth phi = {inverse > 0.0f ? w.x * inverse : JB_REAL(1.0f), w.y * inverse};
    return phi;
}

// w turned about the normal by -phi.
JB_INLINE jb_real3 jb_turn_back(const jb_Azimuth phi, const jb_real3 w) {
    const jb_real3 turned = {phi.cos * w.x + phi.sin * w.y, phi.cos * w.y - phi.sin * w.x, w.z};
    return turned;
}

// JB_LONG (wi + wo).
JB_INLINE jb_real3 jb_long_sum(const jb_real3 wi, const jb_real3 wo) {
    const jb_real3 sum = {JB_LONG * (wi.x + wo.x), JB_LONG * (wi.y + wo.y), JB_LONG * (wi.z + wo.z)};
    return sum;
}

// (wi - wo) / 2.
JB_INLINE jb_real3 jb_across(const jb_real3 wi, const jb_real3 wo) {
    const jb_real3 across = {0.5f * (wi.x - wo.x), 0.5f * (wi.y - wo.y), 0.5f * (wi.z - wo.z)};
    return across;
}

// wh = (wi + wo) / |wi + wo|, wd = Ry(-theta_h) Rz(-phi_h) wi (Rusinkiewicz 1998), of jb_long_sum and jb_across; x and y of
// wd from the latter, which is exact where the directions almost meet. The azimuth of wh is taken from the sum: so neither
// root waits for the other.
JB_INLINE jb_HalfDifference jb_half_difference_of(const jb_real3 sum, const jb_real3 across) {
    const jb_real inverse = jb_safe_rsqrt(jb_dot(sum, sum));
    const jb_real3 turned = jb_turn_back(jb_azimuth_of(sum), across);
    jb_HalfDifference out;
    out.wh.x = sum.x * inverse;
    out.wh.y = sum.y * inverse;
    out.wh.z = inverse > 0.0f ? sum.z * inverse : JB_REAL(1.0f);
    out.wd.x = out.wh.z * turned.x - jb_sin_theta(sum) * inverse * turned.z;
    out.wd.y = turned.y;
    out.wd.z = 0.5f / JB_LONG * jb_dot(out.wh, sum);
    return out;
}

JB_INLINE jb_HalfDifference jb_half_difference(const jb_real3 wi, const jb_real3 wo) {
    return jb_half_difference_of(jb_long_sum(wi, wo), jb_across(wi, wo));
}

#endif
