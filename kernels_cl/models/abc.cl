// f = diffuse / pi + a / pi F (1 + b t)^-c G / (cos_i cos_o): the counterpart of jaxbrdf/models/abc.py. JB_DIFFUSE is the
// place of diffuse / pi and JB_HEIGHTS that of a / pi, each for R, G and B; JB_FALL that of b, c and eta^2 - 1.
#include "directions.cl"
#include "fresnel.cl"
#include "microfacet.cl"
#include "output.cl"

JB_INLINE jb_real3 JB_NAME(model)(const jb_real3 wi, const jb_real3 wo, JB_WEIGHTS const float *weights) {
    const jb_real3 light = jb_lift(wi);
    const jb_real3 view = jb_lift(wo);
    const jb_Facet facet = jb_facet(light, view);
    JB_WEIGHTS const float *fall = weights + JB_FALL;
    // 1 - cos_h, which keeps its digits at the peak
    const jb_real t = (facet.wh.x * facet.wh.x + facet.wh.y * facet.wh.y) / (1.0f + facet.wh.z);
    const jb_real peak = jb_exp2(-fall[1] * jb_log2(1.0f + fall[0] * t));
    // G / (cos_i cos_o) = min(1 / (cos_i cos_o), 4 (1 + smaller / larger cosine) / |wi + wo|^2)
    const jb_real ratio = jb_min(light.z, view.z) / jb_max(light.z, view.z);
    const jb_real masking = jb_min(1.0f / (light.z * view.z), 4.0f * (1.0f + ratio) / facet.squared);
    const jb_real lobe = jb_dielectric(facet.cos, fall[2]) * peak * masking;
    const jb_real3 f = {
        weights[JB_DIFFUSE] + weights[JB_HEIGHTS] * lobe, weights[JB_DIFFUSE + 1] + weights[JB_HEIGHTS + 1] * lobe,
        weights[JB_DIFFUSE + 2] + weights[JB_HEIGHTS + 2] * lobe};
    return jb_above_horizon(wi, wo, f);
}
