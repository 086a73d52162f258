// Burley's principled BRDF: the counterpart of jaxbrdf/models/principled.py. JB_BODY is the place of
// (1 - metallic) base / pi for R, G and B; JB_SURFACE that of alpha_x^2, alpha_y^2, their reciprocals, 1 / (pi alpha_x
// alpha_y), roughness and eta^2 - 1. F is grey F_exact + f0 (1 - S) + edge S with Schlick's weight S: JB_TINTED is the
// place of grey, edge and f0 for R, G and B, where F is not F_exact alone. JB_FLATNESS, JB_SHEEN (its colour times
// 1 - metallic) and JB_COAT (strength / 4 of the distribution's norm, and alpha^2) are there if the effect is.
#include "directions.cl"
#include "fresnel.cl"
#include "microfacet.cl"
#include "output.cl"

// The coat's reflectance at normal incidence, and the alpha^2 that masks it.
#define JB_COAT_F0 0.04f
#define JB_COAT_MASKING 0.0625f

// From one at the normal to `end` at grazing angles, in light times view.
JB_INLINE jb_real JB_NAME(bent)(const jb_real end, const jb_real grazing_i, const jb_real grazing_o) {
    const jb_real slope = end - 1.0f;
    return (1.0f + slope * grazing_i) * (1.0f + slope * grazing_o);
}

JB_INLINE jb_real3 JB_NAME(model)(const jb_real3 wi, const jb_real3 wo, JB_WEIGHTS const float *weights) {
    const jb_real3 light = jb_lift(wi);
    const jb_real3 view = jb_lift(wo);
    const jb_Facet facet = jb_facet(light, view);
    const jb_real grazing = jb_schlick_weight(facet.cos);
    JB_WEIGHTS const float *body = weights + JB_BODY;
    JB_WEIGHTS const float *surface = weights + JB_SURFACE;

    const jb_real grazing_i = jb_schlick_weight(light.z);
    const jb_real grazing_o = jb_schlick_weight(view.z);
    const jb_real retro = surface[5] * facet.cos * facet.cos;
    jb_real diffuse = JB_NAME(bent)(2.0f * retro + 0.5f, grazing_i, grazing_o);
#ifdef JB_FLATNESS
    const jb_real flattened = JB_NAME(bent)(retro, grazing_i, grazing_o);
    const jb_real beneath = 1.25f * (flattened * (1.0f / (light.z + view.z) - 0.5f) + 0.5f);
    diffuse += weights[JB_FLATNESS] * (beneath - diffuse);
#endif

    const jb_real lobe = jb_separable_ggx_lobe(
        light, view, facet.wh, surface[0], surface[1], surface[2], surface[3], surface[4]);
    const jb_real exact = jb_dielectric(facet.cos, surface[6]);
#ifdef JB_TINTED
    JB_WEIGHTS const float *tinted = weights + JB_TINTED;
    const jb_real even = tinted[0] * exact + tinted[1] * grazing;
    const jb_real rest = 1.0f - grazing;
    jb_real3 f = {
        body[0] * diffuse + lobe * (even + tinted[2] * rest), body[1] * diffuse + lobe * (even + tinted[3] * rest),
        body[2] * diffuse + lobe * (even + tinted[4] * rest)};
#else
    const jb_real glossy = lobe * exact;
    jb_real3 f = {body[0] * diffuse + glossy, body[1] * diffuse + glossy, body[2] * diffuse + glossy};
#endif

#ifdef JB_SHEEN
    f.x += weights[JB_SHEEN] * grazing;
    f.y += weights[JB_SHEEN + 1] * grazing;
    f.z += weights[JB_SHEEN + 2] * grazing;
#endif

#ifdef JB_COAT
    // G1 = 2 cos / (s + cos)
    const jb_real masked_i = light.z + jb_stretched(light, JB_COAT_MASKING, JB_COAT_MASKING);
    const jb_real masked_o = view.z + jb_stretched(view, JB_COAT_MASKING, JB_COAT_MASKING);
    const jb_real sine_squared = facet.wh.x * facet.wh.x + facet.wh.y * facet.wh.y;
    const jb_real spread = sine_squared + weights[JB_COAT + 1] * facet.wh.z * facet.wh.z;
    const jb_real coat = weights[JB_COAT] * 4.0f * light.z * view.z * (JB_COAT_F0 + (1.0f - JB_COAT_F0) * grazing) /
                         (spread * masked_i * masked_o);
    f.x += coat;
    f.y += coat;
    f.z += coat;
#endif
    return jb_above_horizon(wi, wo, f);
}
#undef JB_COAT_F0
#undef JB_COAT_MASKING
