// Directions about a shading normal: the counterpart of `reciprocal_normal_mapped` in jaxbrdf/brdf/normal_mapped.py.
#ifndef JB_NORMAL_MAPPED_CL
#define JB_NORMAL_MAPPED_CL

#include "directions.cl"

// Both directions in the frame of the normal, and (cos_i' / cos_i + cos_o' / cos_o) / 2, by which the base is multiplied there:
// zero where either is below the normal's horizon.
typedef struct {
    jb_real3 wi;
    jb_real3 wo;
    jb_real gain;
} jb_NormalMapped;

// w in the frame of the unit vector n, which is the surface's turned by the shortest way (`untilt` in directions.py).
JB_INLINE jb_real3 jb_untilt(const jb_real3 w, const jb_real3 n) {
    const jb_real along = n.x * w.x + n.y * w.y;
    const jb_real a = w.z + along / (1.0f + n.z);
    const jb_real3 seen = {w.x - a * n.x, w.y - a * n.y, w.z * n.z + along};
    return seen;
}

// Of a vector along the normal, whose z is positive.
JB_INLINE jb_NormalMapped jb_normal_mapped(const jb_real3 upward, const jb_real3 wi, const jb_real3 wo) {
    const jb_real scale = jb_safe_rsqrt(jb_dot(upward, upward));
    const jb_real3 n = {upward.x * scale, upward.y * scale, upward.z * scale};
    jb_NormalMapped out;
    out.wi = jb_untilt(wi, n);
    out.wo = jb_untilt(wo, n);
    const jb_real light = jb_lift(out.wi).z / jb_lift(wi).z, view = jb_lift(out.wo).z / jb_lift(wo).z;
    const jb_integer is_lit = (out.wi.z > 0.0f) & (out.wo.z > 0.0f);
    out.gain = is_lit ? 0.5f * (light + view) : JB_REAL(0.0f);
    return out;
}

#endif
