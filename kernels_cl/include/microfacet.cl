// Microfacet lobes: the counterpart of jaxbrdf/core/ggx.py and smith.py with numbers that the host has prepared.
#ifndef JB_MICROFACET_CL
#define JB_MICROFACET_CL

#include "directions.cl"

// What lobes read of a pair of lifted directions: the half vector, its cosine with either, and |wi + wo|^2.
typedef struct {
    jb_real3 wh;
    jb_real cos;
    jb_real squared;
} jb_Facet;

JB_INLINE jb_Facet jb_facet(const jb_real3 wi, const jb_real3 wo) {
    const jb_real3 sum = {wi.x + wo.x, wi.y + wo.y, wi.z + wo.z};
    const jb_real squared = jb_dot(sum, sum);
    const jb_real inverse = jb_safe_rsqrt(squared);
    jb_Facet out;
    out.wh.x = sum.x * inverse;
    out.wh.y = sum.y * inverse;
    out.wh.z = inverse > 0.0f ? sum.z * inverse : JB_REAL(1.0f);
    // wi . wh = |wi + wo| / 2 for unit vectors, and the length does not cancel where the two are opposed
    out.cos = jb_at_most(0.5f * squared * inverse, 1.0f);
    out.squared = squared;
    return out;
}

// |stretched w| = sqrt(ax^2 x^2 + ay^2 y^2 + z^2).
JB_INLINE jb_real jb_stretched(const jb_real3 w, const float squared_x, const float squared_y) {
    return jb_safe_sqrt(squared_x * w.x * w.x + squared_y * w.y * w.y + w.z * w.z);
}

// x^2 / ax^2 + y^2 / ay^2 + z^2, of the reciprocals of ax^2 and ay^2.
JB_INLINE jb_real jb_ggx_spread(const jb_real3 wh, const float inverse_x, const float inverse_y) {
    return inverse_x * wh.x * wh.x + inverse_y * wh.y * wh.y + wh.z * wh.z;
}

// D G2 / (4 cos_i cos_o) of GGX along its own axes, with masking correlated by height:
// 1 / (2 pi ax ay spread^2 (s_i cos_o + s_o cos_i)). `squared` is ax^2, ay^2 and `inverse` their reciprocals; `norm` is
// 1 / (2 pi ax ay).
JB_INLINE jb_real jb_ggx_lobe(
    const jb_real3 wi, const jb_real3 wo, const jb_real3 wh, const float squared_x, const float squared_y,
    const float inverse_x, const float inverse_y, const float norm) {
    const jb_real spread = jb_ggx_spread(wh, inverse_x, inverse_y);
    const jb_real across =
        jb_stretched(wi, squared_x, squared_y) * wo.z + jb_stretched(wo, squared_x, squared_y) * wi.z;
    return norm / (spread * spread * across);
}

// The same with masking and shadowing independent: 1 / (pi ax ay spread^2 (s_i + cos_i) (s_o + cos_o)), and `norm`
// 1 / (pi ax ay).
JB_INLINE jb_real jb_separable_ggx_lobe(
    const jb_real3 wi, const jb_real3 wo, const jb_real3 wh, const float squared_x, const float squared_y,
    const float inverse_x, const float inverse_y, const float norm) {
    const jb_real spread = jb_ggx_spread(wh, inverse_x, inverse_y);
    const jb_real light = jb_stretched(wi, squared_x, squared_y) + wi.z;
    const jb_real view = jb_stretched(wo, squared_x, squared_y) + wo.z;
    return norm / (spread * spread * light * view);
}

#endif
