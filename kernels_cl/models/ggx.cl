// f = albedo / pi + sum of GGX lobes with Schlick's reflectance: the counterpart of jaxbrdf/models/ggx.py. JB_DIFFUSE is
// the place of albedo / pi, if there is a diffuse part; JB_LOBES that of JB_LOBE_COUNT lobes. Of each: f0 for R, G and B,
// alpha_x^2, alpha_y^2, their reciprocals and 1 / (2 pi alpha_x alpha_y), and, unless JB_ISOTROPIC, cosine and sine of the
// angle of its axes.
#include "directions.cl"
#include "fresnel.cl"
#include "microfacet.cl"
#include "output.cl"

#ifdef JB_ISOTROPIC
#define JB_LOBE_NUMBERS 8
#else
#define JB_LOBE_NUMBERS 10
#endif

JB_INLINE jb_real3 JB_NAME(model)(const jb_real3 wi, const jb_real3 wo, JB_WEIGHTS const float *weights) {
    const jb_real3 light = jb_lift(wi);
    const jb_real3 view = jb_lift(wo);
    const jb_Facet facet = jb_facet(light, view);
    const jb_real grazing = jb_schlick_weight(facet.cos);
#ifdef JB_DIFFUSE
    jb_real3 f = {
        JB_REAL(weights[JB_DIFFUSE]), JB_REAL(weights[JB_DIFFUSE + 1]), JB_REAL(weights[JB_DIFFUSE + 2])};
#else
    jb_real3 f = {JB_REAL(0.0f), JB_REAL(0.0f), JB_REAL(0.0f)};
#endif
    _Pragma("unroll") for (int k = 0; k < JB_LOBE_COUNT; ++k) {
        JB_WEIGHTS const float *own = weights + JB_LOBES + JB_LOBE_NUMBERS * k;
#ifdef JB_ISOTROPIC
        const jb_real lobe = jb_ggx_lobe(light, view, facet.wh, own[3], own[4], own[5], own[6], own[7]);
#else
        const jb_Azimuth axes = {JB_REAL(own[8]), JB_REAL(own[9])};
        const jb_real lobe = jb_ggx_lobe(
            jb_turn_back(axes, light), jb_turn_back(axes, view), jb_turn_back(axes, facet.wh), own[3], own[4], own[5],
            own[6], own[7]);
#endif
        f.x += lobe * (own[0] + (1.0f - own[0]) * grazing);
        f.y += lobe * (own[1] + (1.0f - own[1]) * grazing);
        f.z += lobe * (own[2] + (1.0f - own[2]) * grazing);
    }
    return jb_above_horizon(wi, wo, f);
}
#undef JB_LOBE_NUMBERS
